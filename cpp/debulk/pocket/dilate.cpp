#include "debulk/pocket/dilate.hpp"

#include <algorithm>

namespace debulk {

Grid<std::uint8_t> dilate(const Grid<std::uint8_t>& marks, int reach) {
  const auto add = [](std::uint8_t* to, const std::uint8_t* from, int count) {
    for (int i = 0; i < count; ++i) to[i] |= from[i];
  };
  Grid<std::uint8_t> rows = marks;
  for (int k = 1; k <= std::min(reach, marks.nx - 1); ++k)
    for (int j = 0; j < marks.ny; ++j)
      add(&rows.at(k, j), &marks.at(0, j), marks.nx - k), add(&rows.at(0, j), &marks.at(k, j), marks.nx - k);
  Grid<std::uint8_t> out = rows;
  for (int k = 1; k <= reach; ++k)
    for (int j = k; j < marks.ny; ++j) add(&out.at(0, j), &rows.at(0, j - k), marks.nx), add(&out.at(0, j - k), &rows.at(0, j), marks.nx);
  return out;
}

}  // namespace debulk
