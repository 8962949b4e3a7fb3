#pragma once

#include <cstdint>
#include <vector>

#include "debulk/cloud/window_pass.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// Exact nearest four of the points that the pixel window (window_pass.hpp) left open, over the whole image. Points are
// of two kinds. The certain ones lie close together, in tiles whose depth ranges are narrow; a tile is looked into
// only if its box reaches within the distance found so far. The open ones themselves (mostly flying pixels) are sorted
// into bins of pixels. The number of pixels round a point that must be looked at follows from the bound in
// window_pass.hpp. For a point of a noisy sheet, the 5 by 5 round it are enough.
class OpenSearch {
 public:
  // Sorts the open points into bins.
  void prepare(const WindowPass& pass, const std::vector<WindowBand>& bands, int threads);

  // Mean distance to the nearest four of each open point, bin by bin; infinite if there are not four. `pass` and what it
  // points to must still exist.
  void run(std::vector<float>& distances, int threads, const Stop& stop) const;

  std::uint32_t pixel(std::size_t k) const { return index_[k]; }  // in the same order

 private:
  WindowPass pass_;
  double stretch_ = 1;                                  // largest sqrt(1 + u²) in the image
  std::vector<float> u_low_, u_high_, v_low_, v_high_;  // rays that bound each column and row of tiles
  int bins_x_ = 0;
  std::size_t count_ = 0;
  std::vector<std::uint32_t> starts_, index_;  // start of each bin's points; their pixels, bin by bin
  std::vector<float> x_, y_, z_, limit_;       // the open points, bin by bin
};

}  // namespace debulk
