#include "debulk/surface/reference_gaps.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace debulk {
namespace {

// A gap in the scan of the mold hides no pocket, because the ply above it is seen; only the mold has to be guessed in
// a strip. A gap as narrow as this, as a share of the diameter of holes in a scan that are filled, may therefore be
// longer than those.
constexpr double kNarrow = 0.8;

// Whether every point of the runs has a known point within `reach`, all in steps of the grid.
bool is_narrow(const std::vector<Run>& runs, const std::vector<std::size_t>& gap, const Grid<float>& seen, double reach) {
  const int steps = static_cast<int>(reach);
  const auto near_known = [&](int i, int j) {
    for (int dj = -steps; dj <= steps; ++dj)
      for (int di = -steps; di <= steps; ++di)
        if (di * di + dj * dj <= reach * reach && seen.contains(i + di, j + dj) && !std::isnan(seen.at(i + di, j + dj))) return true;
    return false;
  };
  for (const std::size_t k : gap)
    for (int i = runs[k].begin; i < runs[k].end; ++i)
      if (!near_known(i, runs[k].row)) return false;
  return true;
}

// 1 where the reference is known.
Grid<std::uint8_t> known_in(const Grid<float>& seen, double diameter_mm) {
  auto known = seen.like<std::uint8_t>();
  for (std::size_t k = 0; k < seen.size(); ++k) known.values[k] = !std::isnan(seen.values[k]);
  const std::vector<Run> runs = find_runs(known, false);
  const std::vector<int> first = join_runs(runs, 1);
  struct Extent {
    int left = std::numeric_limits<int>::max(), right = -1, low = std::numeric_limits<int>::max(), high = -1;
  };
  std::vector<Extent> extents(runs.size());
  std::vector<std::vector<std::size_t>> members(runs.size());
  for (std::size_t k = 0; k < runs.size(); ++k) {
    Extent& e = extents[static_cast<std::size_t>(first[k])];
    e.left = std::min(e.left, runs[k].begin), e.right = std::max(e.right, runs[k].end - 1);
    e.low = std::min(e.low, runs[k].row), e.high = std::max(e.high, runs[k].row);
    members[static_cast<std::size_t>(first[k])].push_back(k);
  }
  for (std::size_t g = 0; g < runs.size(); ++g) {
    if (members[g].empty()) continue;
    const Extent& e = extents[g];
    const bool inside = e.left > 0 && e.low > 0 && e.right < seen.nx - 1 && e.high < seen.ny - 1;
    const double width = std::max(e.right - e.left, e.high - e.low) * seen.spacing + seen.spacing;
    if (!inside || width > 2 * diameter_mm) continue;
    if (width > diameter_mm && !is_narrow(runs, members[g], seen, kNarrow * diameter_mm / (2 * seen.spacing))) continue;
    for (const std::size_t k : members[g])
      std::fill(&known.at(runs[k].begin, runs[k].row), &known.at(runs[k].begin, runs[k].row) + (runs[k].end - runs[k].begin), 1);
  }
  return known;
}

}  // namespace

ReferenceGaps::ReferenceGaps(const Grid<float>& seen, const Grid<float>& frame, double diameter_mm) {
  const Grid<std::uint8_t> known = known_in(seen, diameter_mm);
  std::vector<int> column(static_cast<std::size_t>(frame.nx));  // the nearest column of `seen`
  for (int i = 0; i < frame.nx; ++i)
    column[static_cast<std::size_t>(i)] = static_cast<int>(std::lround(seen.locate(frame.position(i, 0)).x()));
  first_.push_back(0);
  for (int j = 0; j < frame.ny; ++j) {
    const int row = static_cast<int>(std::lround(seen.locate(frame.position(0, j)).y()));
    RunWriter gaps(runs_, j);
    for (int i = 0; i < frame.nx; ++i) {
      const int at = column[static_cast<std::size_t>(i)];
      gaps.add(i, !known.contains(at, row) || known.at(at, row) == 0, 1);
    }
    gaps.end(frame.nx);
    first_.push_back(runs_.size());
  }
}

void ReferenceGaps::hide(Grid<float>& heights) const {
  for (const Run& gap : runs_)
    std::fill(&heights.at(gap.begin, gap.row), &heights.at(gap.begin, gap.row) + (gap.end - gap.begin),
              std::numeric_limits<float>::quiet_NaN());
}

std::pair<const Run*, const Run*> ReferenceGaps::in_row(int j) const {
  if (first_.empty()) return {nullptr, nullptr};
  const auto row = static_cast<std::size_t>(j);
  return {runs_.data() + first_[row], runs_.data() + first_[row + 1]};
}

}  // namespace debulk
