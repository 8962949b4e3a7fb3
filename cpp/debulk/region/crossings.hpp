#pragma once

#include <cstdint>
#include <vector>

#include "debulk/cloud/cloud_view.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// An organised cloud as lines of pixels: its rows, or its columns where it is turned.
struct Lines {
  CloudView cloud;
  const std::uint8_t* masked = nullptr;  // nonzero where a pixel is not to be used
  bool turned = false;

  int count() const { return turned ? cloud.width : cloud.height; }
  int length() const { return turned ? cloud.height : cloud.width; }
  std::size_t pixel(int line, int at) const {
    return turned ? static_cast<std::size_t>(at) * static_cast<std::size_t>(cloud.width) + static_cast<std::size_t>(line)
                  : static_cast<std::size_t>(line) * static_cast<std::size_t>(cloud.width) + static_cast<std::size_t>(at);
  }
};

// Where a pair of adjacent lines crosses something narrow that stands up.
struct Crossing {
  int pair = 0;       // its lines are pair * step and the one behind
  int at = 0;         // place along them, pixels
  double height = 0;  // mm above the middle of both sides
};

struct CrossingOptions {
  int step = 2;               // lines from one pair to the next
  int side = 2;               // pixels from a point to those on both sides that it must stand out from
  float up_per_depth = -1;    // mm of height for each mm of depth: the camera looks down on the ply
  float stands_out_mm = 1.0;  // at least
  float highest_mm = 25.0;    // what stands out by more is the edge of something else
};

// All crossings, by pair and place: the highest point of each run of points that stand out narrowly in both lines of a pair,
// shifted by up to two pixels. Only depths are read, of the pairs' lines. Throws Stopped.
std::vector<Crossing> find_crossings(const Lines& lines, const CrossingOptions& options, int threads = 0, const Stop& stop = Stop());

struct ChainOptions {
  int step = 2;           // as above
  int links = 4;          // crossings of a chain, at least
  int ahead = 3;          // pairs from one crossing to the next, at most: drop-outs on steep flanks hide some
  double steepest = 2.0;  // pixels along the lines for each line across; lines of the other direction follow steeper ways
  double alike = 3.0;     // the largest ratio of the heights of neighbours in a chain
};

// Links crossings of successive pairs on straight ways; each begins one chain at most, and none that a longer chain has
// taken. `crossings` as find_crossings orders them; a chain holds their indices. Throws Stopped.
std::vector<std::vector<int>> link_crossings(const std::vector<Crossing>& crossings, const ChainOptions& options,
                                             const Stop& stop = Stop());

}  // namespace debulk
