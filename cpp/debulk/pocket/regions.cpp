#include "debulk/pocket/regions.hpp"

#include <algorithm>
#include <cstring>

#include "debulk/core/runs.hpp"

namespace debulk {
Grid<std::uint8_t> fill_holes(const Grid<std::uint8_t>& foreground) {
  Grid<std::uint8_t> image = foreground;
  for (std::uint8_t& v : image.values) v = v != 0;
  const std::vector<Run> runs = find_runs(foreground, false);
  const std::vector<int> first = join_runs(runs, 0);
  std::vector<std::uint8_t> outside(runs.size(), 0);
  for (std::size_t k = 0; k < runs.size(); ++k)
    if (runs[k].row == 0 || runs[k].row == image.ny - 1 || runs[k].begin == 0 || runs[k].end == image.nx)
      outside[static_cast<std::size_t>(first[k])] = 1;
  for (std::size_t k = 0; k < runs.size(); ++k)
    if (!outside[static_cast<std::size_t>(first[k])])
      std::memset(&image.at(runs[k].begin, runs[k].row), 1, static_cast<std::size_t>(runs[k].end - runs[k].begin));
  return image;
}

Grid<std::int32_t> connected_components(const Grid<std::uint8_t>& foreground, int& count) {
  auto labels = foreground.like<std::int32_t>();
  const std::vector<Run> runs = find_runs(foreground, true);
  const std::vector<int> first = join_runs(runs, 1);
  std::vector<std::int32_t> label(runs.size(), 0);
  count = 0;
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const auto root = static_cast<std::size_t>(first[k]);
    if (root == k) label[k] = ++count;
    std::int32_t* row = &labels.values[labels.index(0, runs[k].row)];
    std::fill(row + runs[k].begin, row + runs[k].end, label[root]);
  }
  return labels;
}

}  // namespace debulk
