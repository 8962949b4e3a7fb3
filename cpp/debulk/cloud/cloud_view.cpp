#include "debulk/cloud/cloud_view.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <vector>

#include "debulk/core/parallel.hpp"
#include "debulk/core/simd.hpp"

namespace debulk {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();

#define DEBULK_KERNEL "debulk/cloud/bounds_kernel.inl"
#include "debulk/core/simd_dispatch.inl"

}  // namespace

CloudBounds bounds(const CloudView& cloud, int threads) {
  constexpr long chunk = 1 << 18;
  const long count = static_cast<long>(cloud.size());
  const CloudBounds nothing{Eigen::Vector3d::Constant(infinity), Eigen::Vector3d::Constant(-infinity), 0};
  std::vector<CloudBounds> parts(static_cast<std::size_t>((count + chunk - 1) / chunk), nothing);
  parallel_for(count, chunk, threads, [&](long begin, long end) {
    CloudBounds& part = parts[static_cast<std::size_t>(begin / chunk)];
    Eigen::Vector3f low, high;
    part.seen = DEBULK_ON(best_isa(), run(cloud.point(static_cast<std::size_t>(begin)), end - begin, low.data(), high.data()));
    part.low = low.cast<double>(), part.high = high.cast<double>();
  });
  CloudBounds all = nothing;
  for (const CloudBounds& part : parts) {
    all.low = all.low.cwiseMin(part.low);
    all.high = all.high.cwiseMax(part.high);
    all.seen += part.seen;
  }
  return all;
}

}  // namespace debulk
