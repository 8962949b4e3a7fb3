#pragma once

#include <cstdint>
#include <vector>

#include "debulk/cloud/cloud_view.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// An organised cloud seen as lines of pixels: its rows, or its columns if it is turned.
struct Lines {
  CloudView cloud;
  const std::uint8_t* masked = nullptr;  // nonzero: the pixel is not to be used
  bool turned = false;

  int count() const { return turned ? cloud.width : cloud.height; }
  int length() const { return turned ? cloud.height : cloud.width; }
  std::size_t pixel(int line, int at) const {
    return turned ? static_cast<std::size_t>(at) * static_cast<std::size_t>(cloud.width) + static_cast<std::size_t>(line)
                  : static_cast<std::size_t>(line) * static_cast<std::size_t>(cloud.width) + static_cast<std::size_t>(at);
  }
};

// A place where a pair of adjacent lines crosses a narrow elevation.
struct Crossing {
  int pair = 0;       // the pair's lines are pair * step and pair * step + 1
  int at = 0;         // position along the lines, pixels
  double height = 0;  // mm above the mean of the heights on both sides
};

struct CrossingOptions {
  int step = 2;               // lines from one pair to the next
  int side = 2;               // distance in pixels from a point to the two points beside it that it must stand out from
  float up_per_depth = -1;    // mm of height per mm of depth; negative because the camera looks down on the ply
  float stands_out_mm = 1.0;  // height above the points beside it, at least
  float highest_mm = 25.0;    // a point that stands out by more is the edge of another object
};

// Returns all crossings, sorted by pair and place: the highest point of each run of points that stand out narrowly in
// both lines of a pair, where the two lines may be shifted by up to two pixels. It reads only the depths on the pairs'
// lines. Throws Stopped.
std::vector<Crossing> find_crossings(const Lines& lines, const CrossingOptions& options, int threads = 0, const Stop& stop = Stop());

struct ChainOptions {
  int step = 2;           // lines from one pair to the next, as above
  int links = 4;          // minimum number of crossings in a chain
  int ahead = 3;          // most pairs from one crossing to the next: drop-outs on steep flanks hide some crossings
  double steepest = 2.0;  // pixels along the lines per line across; lines of the other direction find steeper wrinkles
  double alike = 3.0;     // largest ratio of the heights of neighbours in a chain
};

// Links crossings of successive pairs that lie on straight ways. Each crossing begins at most one chain, and a crossing
// that a longer chain has taken begins none. `crossings` must be in the order of find_crossings; a chain holds indices
// into it. Throws Stopped.
std::vector<std::vector<int>> link_crossings(const std::vector<Crossing>& crossings, const ChainOptions& options,
                                             const Stop& stop = Stop());

}  // namespace debulk
