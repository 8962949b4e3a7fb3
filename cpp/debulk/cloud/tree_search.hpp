#pragma once

#include <cstdint>
#include <vector>

#include "debulk/cloud/cloud_view.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// Exact nearest neighbours in any cloud, with PCL's kd-trees (not with its organised search, which is wrong on such
// clouds).
//
// The cloud is cut along x into slabs, each with its own tree, so that no thread is busy with one tree for more than
// some tens of milliseconds; the stop is checked between trees. A search begins in the slab of its point and goes on
// into the next slabs as long as they are nearer than the farthest neighbour so far.
class TreeSearch {
 public:
  // Throws Stopped.
  TreeSearch(const CloudView& cloud, int neighbours, int threads = 0, const Stop& stop = Stop());
  ~TreeSearch();

  // Fills means[i] for each i of `which`, the indices of points that were seen. Throws Stopped.
  void mean_distances(const std::vector<std::uint32_t>& which, float* means, int threads, const Stop& stop) const;

 private:
  struct Slab;
  CloudView cloud_;
  int neighbours_;
  std::vector<Slab> slabs_;  // ascending x
};

}  // namespace debulk
