#pragma once

#include <utility>
#include <vector>

#include "debulk/core/grid.hpp"
#include "debulk/core/row_runs.hpp"

namespace debulk {

// Where the scan of the reference saw nothing. A fitted Reference is a surface everywhere, but in a gap it is a guess,
// and a height above a guess is not known.
class ReferenceGaps {
 public:
  ReferenceGaps() = default;  // no gaps
  // seen: the heights that the reference was fitted to, NaN where nothing was seen. frame: the grid of the height map,
  // with any values. As in a scan, a gap counts as seen if it is no wider than diameter_mm and does not reach the
  // border of `seen`. A gap up to twice as long counts as seen, too, if none of its points is farther than 0.4 of that
  // diameter from a known one.
  ReferenceGaps(const Grid<float>& seen, const Grid<float>& frame, double diameter_mm);

  // Sets heights on the frame to NaN where they lie in the gaps.
  void hide(Grid<float>& heights) const;
  std::pair<const Run*, const Run*> in_row(int j) const;  // the gaps of a row of the frame, in order

 private:
  std::vector<Run> runs_;           // of the frame, in order
  std::vector<std::size_t> first_;  // number of each row's first run, and the end; empty: no gaps
};

}  // namespace debulk
