#pragma once

#include <cstdint>
#include <vector>

#include "debulk/cloud/window_pass.hpp"

namespace debulk {

// Exact nearest four of the points that the pixel window left open, over the whole image. Points fall into two kinds:
// the certain ones lie close together, in tiles whose depth ranges are narrow, and a tile is looked into only where its
// box reaches within the distance found so far; the open ones themselves (flying pixels, mostly) lie in bins of pixels.
// How many pixels round a point must be looked at follows from the bound of window_pass.hpp.
class OpenSearch {
 public:
  // Sorts the open points into bins. The arguments must outlive the search.
  void prepare(const WindowPass& pass, const std::vector<WindowBand>& bands);

  // Mean distance to the nearest four of each open point, in the order of the bands' lists; infinity if there are not four.
  void run(std::vector<float>& distances, int threads);

  std::size_t count() const { return index_.size(); }
  std::uint32_t pixel(std::size_t k) const { return order_[k]; }  // in the order of the bands' lists

 private:
  struct Finder;
  friend void search_open(const OpenSearch& search, std::size_t begin, std::size_t end, float* distances, std::vector<float>& scratch);

  const WindowPass* pass_ = nullptr;
  double stretch_ = 1;                 // sqrt(1 + u²), at most
  std::vector<float> u_low_, u_high_;  // rays that bound each column of tiles
  int bins_x_ = 0, bins_y_ = 0;
  std::vector<std::uint32_t> order_, starts_, index_;  // open pixels as listed; the bins' starts; pixels bin by bin
  std::vector<float> x_, y_, z_;                       // of the open points, bin by bin, and 16 more
};

}  // namespace debulk
