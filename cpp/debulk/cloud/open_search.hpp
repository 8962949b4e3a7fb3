#pragma once

#include <cstdint>
#include <vector>

#include "debulk/cloud/window_pass.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// Exact nearest four of the points that the pixel window left open, over the whole image. Points fall into two kinds:
// the certain ones lie close together, in tiles whose depth ranges are narrow, and a tile is looked into only where its
// box reaches within the distance found so far; the open ones themselves (flying pixels, mostly) lie in bins of pixels.
// How many pixels round a point must be looked at follows from the bound in window_pass.hpp. A point of a noisy sheet needs
// no more than the 5 by 5 round it.
class OpenSearch {
 public:
  // Sorts the open points into bins.
  void prepare(const WindowPass& pass, const std::vector<WindowBand>& bands, int threads);

  // Mean distance to the nearest four of each open point, bin by bin; infinite if there are not four. Where OpenPixel::distance is known
  // nothing is searched, and it stands for the point's own.
  // `pass` and what it points to must still be there.
  void run(std::vector<float>& distances, int threads, const Stop& stop) const;

  std::uint32_t pixel(std::size_t k) const { return index_[k]; }  // in that order

 private:
  WindowPass pass_;
  double stretch_ = 1;                                  // sqrt(1 + u²), at most
  std::vector<float> u_low_, u_high_, v_low_, v_high_;  // rays that bound each column and row of tiles
  int bins_x_ = 0;
  std::size_t count_ = 0;
  std::vector<std::uint32_t> starts_, index_;        // of the bins; pixels bin by bin
  std::vector<float> x_, y_, z_, limit_, distance_;  // of the open points, bin by bin
};

}  // namespace debulk
