#include "debulk/scanner/rectified_row.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace debulk {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float nearly_whole = 1.0f / 1024;  // a place nearer to a pixel than this is on it; the next one is not needed

#define DEBULK_KERNEL "debulk/scanner/rectified_row_kernel.inl"
#include "debulk/core/simd_dispatch.inl"

}  // namespace

void rectify_row(const PhaseView& view, int row, RectifiedRow& out, Isa isa) {
  const std::size_t width = static_cast<std::size_t>(view.rectified_width), padded = (width + 15) / 16 * 16;
  out.phase.resize(padded), out.noise.resize(padded), out.fraction.resize(padded);
  if (view.map_x) {
    DEBULK_ON(isa, run(view, row, out));
    return;
  }
  const std::size_t first = static_cast<std::size_t>(row) * width;
  std::copy_n(view.phase + first, width, out.phase.begin());
  if (view.noise)
    std::copy_n(view.noise + first, width, out.noise.begin());
  else
    std::fill(out.noise.begin(), out.noise.end(), 0.0f);
  std::fill(out.fraction.begin(), out.fraction.end(), 0.0f);
}

float median_step(const PhaseView& view) {
  std::vector<float> steps;
  for (int row = view.height / 64; row < view.height; row += std::max(1, view.height / 32)) {
    const float* phase = view.phase + static_cast<std::size_t>(row) * static_cast<std::size_t>(view.width);
    for (int i = 0; i + 1 < view.width; ++i) {
      const float step = std::abs(phase[i + 1] - phase[i]);
      if (step == step) steps.push_back(step);
    }
  }
  if (steps.empty()) return 0;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

}  // namespace debulk
