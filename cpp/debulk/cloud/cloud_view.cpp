#include "debulk/cloud/cloud_view.hpp"

#include <limits>
#include <vector>

#include "debulk/core/parallel.hpp"

namespace debulk {

CloudBounds bounds(const CloudView& cloud, int threads) {
  constexpr long chunk = 1 << 18;
  const long count = static_cast<long>(cloud.size());
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const CloudBounds nothing{Eigen::Vector3d::Constant(infinity), Eigen::Vector3d::Constant(-infinity), 0};
  std::vector<CloudBounds> parts(static_cast<std::size_t>((count + chunk - 1) / chunk), nothing);
  parallel_for(count, chunk, threads, [&](long begin, long end) {
    CloudBounds& part = parts[static_cast<std::size_t>(begin / chunk)];
    Eigen::Array3f low = Eigen::Array3f::Constant(std::numeric_limits<float>::infinity()), high = -low;
    for (long i = begin; i < end; ++i) {
      const auto at = static_cast<std::size_t>(i);
      if (!cloud.seen(at)) continue;
      const Eigen::Map<const Eigen::Array3f> p(cloud.point(at));
      low = low.min(p);
      high = high.max(p);
      ++part.seen;
    }
    part.low = low.matrix().cast<double>();
    part.high = high.matrix().cast<double>();
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
