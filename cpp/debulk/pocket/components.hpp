#pragma once

#include <cstdint>
#include <vector>

#include "debulk/core/grid.hpp"
#include "debulk/core/row_runs.hpp"

namespace debulk {

// Foreground is connected over 8 neighbours and background over 4: two diagonal foreground points are joined, and a
// background component cannot leak between them. Every outline here follows the same rule. Images are given as runs of
// foreground, row by row and from left to right. The classes reuse their memory.

// The runs of the points that are not foreground in an image of nx by ny points.
void complement(const std::vector<Run>& foreground, int nx, int ny, std::vector<Run>& out);

// Turns background components that do not reach the grid's border into foreground (MATLAB's imfill; paper,
// segmentation).
class RunFilling {
 public:
  const std::vector<Run>& run(const std::vector<Run>& foreground, int nx, int ny);  // the filled image
  const std::vector<Run>& holes() const { return holes_; }                          // what became foreground

 private:
  std::vector<Run> background_, outside_, holes_, filled_;
  std::vector<int> first_;
  std::vector<std::uint8_t> open_;
};

// Runs sorted by component; those of one component are in the order of the image.
struct Components {
  std::vector<Run> runs;
  std::vector<std::size_t> starts;  // where each component starts in `runs`, and the end

  int count() const { return starts.empty() ? 0 : static_cast<int>(starts.size()) - 1; }
  const Run* begin(std::size_t component) const { return runs.data() + starts[component]; }
  const Run* end(std::size_t component) const { return runs.data() + starts[component + 1]; }
  long points(std::size_t component) const;
};

// Joins runs to components, in the order of the components' first points, row by row.
class RunJoining {
 public:
  const Components& run(const std::vector<Run>& foreground);

 private:
  Components components_;
  std::vector<int> label_;
};

// The components of the points with the labels 1 .. count. Component k has the label k + 1.
Components labelled(const Grid<std::int32_t>& labels, int count, int threads = 0);
// Writes a label to all points of a component.
void paint(const Components& components, std::size_t component, std::int32_t label, Grid<std::int32_t>& labels);

}  // namespace debulk
