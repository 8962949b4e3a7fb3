#include "debulk/cloud/neighbours.hpp"

#include <cmath>
#include <cstdint>
#include <limits>

#include "debulk/cloud/grid_search.hpp"
#include "debulk/cloud/tree_search.hpp"
#include "debulk/core/error.hpp"

namespace debulk {

float mean_distance(const float* squared, int count) {
  double sum = 0;
  for (int k = 0; k < count; ++k) sum += std::sqrt(static_cast<double>(squared[k]));
  return count > 0 ? static_cast<float>(sum / count) : std::numeric_limits<float>::quiet_NaN();
}

std::vector<float> mean_neighbour_distances(const CloudView& cloud, int neighbours, int threads, const Stop& stop, std::uint32_t every) {
  require(neighbours >= 1 && neighbours <= 1000, "neighbours", "1 to 1000", neighbours);
  require(cloud.size() < std::numeric_limits<std::uint32_t>::max(), "points", "fewer than 2^32 points", cloud.size());
  std::vector<float> means(cloud.size(), std::numeric_limits<float>::quiet_NaN());
  const std::vector<std::uint32_t> left = GridSearch(cloud, neighbours, threads, stop).mean_distances(means.data(), every);
  if (!left.empty()) TreeSearch(cloud, neighbours, threads, stop).mean_distances(left, means.data(), threads, stop);
  return means;
}

}  // namespace debulk
