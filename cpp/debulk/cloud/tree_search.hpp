#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "debulk/cloud/cloud_view.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// Exact nearest neighbours in any cloud, with PCL's kd-tree (not its organised search, which is wrong on such clouds).
class TreeSearch {
 public:
  TreeSearch(const CloudView& cloud, int neighbours);
  ~TreeSearch();

  // Fills means[i] for each i of `which`, indices of points that were seen.
  void mean_distances(const std::vector<std::uint32_t>& which, float* means, int threads, const Stop& stop) const;

 private:
  struct Tree;
  CloudView cloud_;
  int neighbours_;
  std::unique_ptr<Tree> tree_;
};

}  // namespace debulk
