#include "debulk/pocket/regions.hpp"

#include <algorithm>
#include <cstring>
#include <numeric>

#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

// Points [begin, end) of a row that belong together.
struct Run {
  int row, begin, end;
};

// Where `wanted` (0 or anything else) begins and ends along the rows, in order.
std::vector<Run> find_runs(const Grid<std::uint8_t>& image, bool wanted) {
  constexpr long rows = 64;
  std::vector<std::vector<Run>> parts(static_cast<std::size_t>((image.ny + rows - 1) / rows));
  parallel_for(image.ny, rows, 0, [&](long first, long last) {
    std::vector<Run>& part = parts[static_cast<std::size_t>(first / rows)];
    for (int j = static_cast<int>(first); j < last; ++j) {
      const std::uint8_t* row = &image.values[image.index(0, j)];
      for (int i = 0; i < image.nx;) {
        // Eight zeros at once: most of an image is background.
        for (std::uint64_t eight = 0; !wanted ? false : i + 8 <= image.nx; i += 8) {
          std::memcpy(&eight, row + i, sizeof eight);
          if (eight != 0) break;
        }
        while (i < image.nx && (row[i] != 0) != wanted) ++i;
        const int begin = i;
        while (i < image.nx && (row[i] != 0) == wanted) ++i;
        if (i > begin) part.push_back({j, begin, i});
      }
    }
  });
  std::vector<Run> runs;
  for (const std::vector<Run>& part : parts) runs.insert(runs.end(), part.begin(), part.end());
  return runs;
}

// For each run the first run of its component. `reach`: 1 joins runs that touch diagonally, 0 does not.
std::vector<int> join(const std::vector<Run>& runs, int reach) {
  std::vector<int> parent(runs.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int k) {
    while (parent[static_cast<std::size_t>(k)] != k) {
      int& up = parent[static_cast<std::size_t>(k)];
      k = up = parent[static_cast<std::size_t>(up)];
    }
    return k;
  };
  std::size_t above = 0;
  for (std::size_t k = 0; k < runs.size(); ++k) {
    while (above < k &&
           (runs[above].row < runs[k].row - 1 || (runs[above].row == runs[k].row - 1 && runs[above].end + reach <= runs[k].begin)))
      ++above;
    for (std::size_t a = above; a < k && runs[a].row == runs[k].row - 1 && runs[a].begin < runs[k].end + reach; ++a) {
      const int one = root(static_cast<int>(a)), other = root(static_cast<int>(k));
      parent[static_cast<std::size_t>(std::max(one, other))] = std::min(one, other);
    }
  }
  for (std::size_t k = 0; k < runs.size(); ++k) parent[k] = root(static_cast<int>(k));
  return parent;
}

}  // namespace

Grid<std::uint8_t> fill_holes(const Grid<std::uint8_t>& foreground) {
  Grid<std::uint8_t> image = foreground;
  for (std::uint8_t& v : image.values) v = v != 0;
  const std::vector<Run> runs = find_runs(foreground, false);
  const std::vector<int> first = join(runs, 0);
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
  const std::vector<int> first = join(runs, 1);
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
