#pragma once

#include <cstdint>
#include <vector>

#include "debulk/core/grid.hpp"
#include "debulk/core/runs.hpp"

namespace debulk {

// Foreground is connected over 8 neighbours, background over 4: two diagonal foreground points join, and a background
// region cannot leak between them. Every outline here follows the same rule. Images are runs of foreground, row by row and
// from left to right. The classes keep their memory.

// The runs of what is not foreground in an image of nx by ny points.
void complement(const std::vector<Run>& foreground, int nx, int ny, std::vector<Run>& out);

// Background regions that do not reach the grid's border become foreground (MATLAB's imfill; paper, segmentation).
class RunFilling {
 public:
  const std::vector<Run>& run(const std::vector<Run>& foreground, int nx, int ny);  // the filled image
  const std::vector<Run>& holes() const { return holes_; }                          // what became foreground

 private:
  std::vector<Run> background_, outside_, holes_, filled_;
  std::vector<int> first_;
  std::vector<std::uint8_t> open_;
};

// Runs region by region, each in the order of the image.
struct Regions {
  std::vector<Run> runs;
  std::vector<std::size_t> starts;  // of the regions in `runs`, and the end

  int count() const { return starts.empty() ? 0 : static_cast<int>(starts.size()) - 1; }
  const Run* begin(std::size_t region) const { return runs.data() + starts[region]; }
  const Run* end(std::size_t region) const { return runs.data() + starts[region + 1]; }
  long points(std::size_t region) const;
};

// Components in the order of their first points, row by row.
class RunJoining {
 public:
  const Regions& run(const std::vector<Run>& foreground);

 private:
  Regions regions_;
  std::vector<int> label_;
};

// Where the labels are 1 .. count: region k has the label k + 1.
Regions labelled(const Grid<std::int32_t>& labels, int count);
// Writes a region's label.
void paint(const Regions& regions, std::size_t region, std::int32_t label, Grid<std::int32_t>& labels);

}  // namespace debulk
