#include "debulk/scanner/isolated.hpp"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <limits>
#include <vector>

#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

#define DEBULK_KERNEL "debulk/scanner/isolated_kernel.inl"
#include "debulk/core/each_isa.inl"

}  // namespace

long remove_isolated(float* phase_rad, int width, int height, int least, int threads, const Stop& stop, Isa isa) {
  if (width < 18 || height < 3) return 0;  // nothing but a border
  // All are found before any is removed: the order in which threads come must not matter.
  constexpr long strip = 16;
  std::vector<std::vector<long>> found(static_cast<std::size_t>((height + strip - 1) / strip));
  parallel_for(height, strip, threads, stop, [&](long begin, long end) {
    std::vector<long>& here = found[static_cast<std::size_t>(begin / strip)];
    for (long row = std::max(begin, 1L); row < std::min<long>(end, height - 1); ++row)
      DEBULK_ON(isa, run(phase_rad, width, row, least, here));
  });
  long count = 0;
  for (const std::vector<long>& strip_found : found) {
    for (long at : strip_found) phase_rad[at] = std::numeric_limits<float>::quiet_NaN();
    count += static_cast<long>(strip_found.size());
  }
  return count;
}

}  // namespace debulk
