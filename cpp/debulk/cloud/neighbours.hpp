#pragma once

#include <stdexcept>
#include <vector>

#include "debulk/cloud/cloud_view.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// For every point the mean distance to its `neighbours` nearest others, exact; to all others where there are fewer. NaN
// where nothing was seen, and for a point that is alone. Copies of a point count as neighbours at distance 0.
//
// Distances are defined as the square root of the float sum dx² + dy² + dz², which is what PCL computes, so that every
// search below gives the same bits. Organised clouds go through GridSearch, and to TreeSearch with those points for which
// it would be slow; unorganised ones go through TreeSearch.
std::vector<float> mean_neighbour_distances(const CloudView& cloud, int neighbours, int threads = 0, const Stop& stop = Stop());

// Squared distance as defined above.
inline float squared_distance(const float* a, const float* b) {
  const float dx = a[0] - b[0], dy = a[1] - b[1], dz = a[2] - b[2];
  return dx * dx + dy * dy + dz * dz;
}

// Mean of the distances whose squares are given, in their order (ascending); summed in double.
float mean_distance(const float* squared, int count);

}  // namespace debulk
