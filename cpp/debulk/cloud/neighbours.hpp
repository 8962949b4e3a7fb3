#pragma once

#include <cstdint>
#include <vector>

#include "debulk/cloud/cloud_view.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// For every point, the exact mean distance to its `neighbours` nearest others, or to all others if there are fewer.
// NaN where nothing was seen, and for a point that is alone. Copies of a point count as neighbours at distance 0. Of a
// sample, one point in `every`, the others are NaN, too.
//
// Distances are defined as the square root of the float sum dx² + dy² + dz², which is what PCL computes, so that every
// search below gives the same bits. GridSearch handles all points, in whatever order they come, except those for which
// it would be slow: these are left to TreeSearch, which uses PCL's trees.
//
// Why there are four searches (window_pass.hpp, open_search.hpp, grid_search.hpp, tree_search.hpp): CPU time of the
// four nearest neighbours of all 1,204,432 points of a virtual scan of 1280 by 960 pixels, on one thread of the
// machine of 2026-11-22:
//   pinhole camera:  window and open search       5 ms (5,157 points are left open by the window)
//                    a tree in place of the open search     360 ms for the tree and 6 ms for its searches
//   organised:       grid 225 ms                            tree 1,800 ms
//   in any order:    grid 400 ms                            tree 4,250 ms
// Without any one of the searches, its work would take at least eight times as long, and the tree bounds the cost where
// a cloud is not a sheet.
std::vector<float> mean_neighbour_distances(const CloudView& cloud, int neighbours, int threads = 0, const Stop& stop = Stop(),
                                            std::uint32_t every = 1);

// Squared distance as defined above.
inline float squared_distance(const float* a, const float* b) {
  const float dx = a[0] - b[0], dy = a[1] - b[1], dz = a[2] - b[2];
  return dx * dx + dy * dy + dz * dz;
}

// Mean of the distances whose squares are given (ascending), summed in that order in double.
float mean_distance(const float* squared, int count);

}  // namespace debulk
