#include "debulk/pocket/nearest_marked.hpp"

#include <algorithm>

namespace debulk {

std::vector<std::vector<Columns>> unmarked_within(const Grid<std::uint8_t>& marked, int reach) {
  std::vector<Columns> extent(static_cast<std::size_t>(marked.ny), {marked.nx, 0});  // of a row's marks
  for (int j = 0; j < marked.ny; ++j) {
    const std::uint8_t *row = &marked.at(0, j), *end = row + marked.nx, *first = std::find(row, end, 1);
    if (first == end) continue;
    while (end[-1] == 0) --end;
    extent[static_cast<std::size_t>(j)] = {static_cast<int>(first - row), static_cast<int>(end - row)};
  }
  std::vector<std::vector<Columns>> out(extent.size());
  const int near = std::min(reach, std::max(marked.nx, marked.ny));
  for (int j = 0; j < marked.ny; ++j) {
    Columns within{marked.nx, 0};
    for (int k = std::max(0, j - near); k <= std::min(marked.ny - 1, j + near); ++k) {
      within.begin = std::min(within.begin, extent[static_cast<std::size_t>(k)].begin);
      within.end = std::max(within.end, extent[static_cast<std::size_t>(k)].end);
    }
    if (within.begin >= within.end) continue;
    const std::uint8_t *row = &marked.at(0, j), *last = row + std::min(marked.nx, within.end + near);
    for (const std::uint8_t* at = row + std::max(0, within.begin - near); at != last;) {
      const std::uint8_t* begin = std::find(at, last, 0);
      at = std::find(begin, last, 1);
      if (begin != at) out[static_cast<std::size_t>(j)].push_back({static_cast<int>(begin - row), static_cast<int>(at - row)});
    }
  }
  return out;
}

Grid<Offset> nearest_marked(const Grid<std::uint8_t>& marked, const std::vector<std::vector<Columns>>& unmarked, int reach) {
  auto nearest = marked.like<Offset>();
  std::transform(marked.values.begin(), marked.values.end(), nearest.values.begin(),
                 [](std::uint8_t mark) { return mark ? Offset{0, 0} : Offset(); });
  const int farthest = reach < Offset::kNone ? reach * reach : std::numeric_limits<int>::max();
  const auto take = [&](Offset& here, const Offset* row, int i, int di, int dj) {
    if (i + di < 0 || i + di >= marked.nx || !row[i + di].found()) return;
    const Offset o{static_cast<std::int16_t>(row[i + di].i + di), static_cast<std::int16_t>(row[i + di].j + dj)};
    if (const int squared = o.squared(); squared <= farthest && (!here.found() || squared < here.squared())) here = o;
  };
  const auto sweep_row = [&](int j, int dj) {
    Offset* row = &nearest.at(0, j);
    for (const Columns& span : unmarked[static_cast<std::size_t>(j)]) {
      if (j + dj >= 0 && j + dj < marked.ny) {
        const Offset* beside = &nearest.at(0, j + dj);
        for (int i = span.begin; i < span.end; ++i)
          for (int di = -1; di <= 1; ++di) take(row[i], beside, i, di, dj);
      }
      for (int i = span.begin; i < span.end; ++i) take(row[i], row, i, -1, 0);
      for (int i = span.end - 1; i >= span.begin; --i) take(row[i], row, i, 1, 0);
    }
  };
  for (int j = 0; j < marked.ny; ++j) sweep_row(j, -1);
  for (int j = marked.ny - 1; j >= 0; --j) sweep_row(j, 1);
  return nearest;
}

}  // namespace debulk
