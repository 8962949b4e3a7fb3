#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "debulk/cloud/window_pass.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// The nearest four of the points that the pixel window (window_pass.hpp) left open, over the whole image. Points are
// of two kinds. The certain ones lie close together, in tiles whose depth ranges are narrow; a tile is looked into
// only if its box reaches within the distance found so far. The open ones themselves (mostly flying pixels) are sorted
// into bins of pixels. The number of pixels round a point that must be looked at follows from the bound in
// window_pass.hpp. For a point of a noisy sheet, the 5 by 5 round it are enough.
//
// The neighbours of a flying pixel are far away, so that their exact distances cost a look at wide windows. Whether
// their mean is above a threshold T needs less: if only k points lie within R, and their distances add up to s, the
// mean is at least (s + (4 - k) R) / 4. With R = 4/3 T this settles all points with k < 2, which most flying pixels are;
// twice as far it settles those with k = 2, and from 4 T on every point.
class OpenSearch {
 public:
  // Sorts the open points into bins.
  void prepare(const WindowPass& pass, const std::vector<WindowBand>& bands, int threads);
  std::size_t count() const { return count_; }

  // Mean distance to the nearest four of each `every`-th open point, bin by bin; infinite if there are not four. The
  // points lie some `pitch` (mm) apart; only the time depends on it. `pass` and what it points to must still exist.
  void measure(std::vector<float>& distances, std::size_t every, double pitch, int threads, const Stop& stop) const;
  // The same for all others, or something above the threshold (mm) if the mean distance is above it.
  void decide(std::vector<float>& distances, std::size_t every, double threshold, int threads, const Stop& stop) const;

  std::uint32_t pixel(std::size_t k) const { return index_[k]; }  // in the same order

 private:
  void run(std::vector<float>& distances, bool multiples, std::size_t every, double radius, double enough, int threads,
           const Stop& stop) const;

  WindowPass pass_;
  double stretch_ = 1;                                  // largest sqrt(1 + u²) in the image
  std::vector<float> u_low_, u_high_, v_low_, v_high_;  // rays that bound each column and row of tiles
  int bins_x_ = 0;
  std::size_t count_ = 0;
  std::vector<std::uint32_t> starts_, index_;  // start of each bin's points; their pixels, bin by bin
  std::vector<float> x_, y_, z_, limit_;       // the open points, bin by bin
};

}  // namespace debulk
