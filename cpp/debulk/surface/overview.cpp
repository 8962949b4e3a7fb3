#include "debulk/surface/overview.hpp"

#include <algorithm>

namespace debulk {

Overview overview_of(const HeightMap& map, const ReferenceGaps& gaps) {
  const Grid<float>& fine = map.heights;
  const int step = std::max(1, static_cast<int>(Overview::spacing_mm / fine.spacing));
  Overview out;
  out.heights = Grid<float>((fine.nx - 1) / step + 1, (fine.ny - 1) / step + 1, fine.origin, step * fine.spacing);
  out.measured = out.heights.like<std::uint8_t>(), out.reference = out.heights.like<std::uint8_t>(1);
  for (int j = 0; j < out.heights.ny; ++j) {
    for (int i = 0; i < out.heights.nx; ++i) {
      out.heights.at(i, j) = fine.at(i * step, j * step);
      out.measured.at(i, j) = map.measured.at(i * step, j * step);
    }
    const auto [first, end] = gaps.in_row(j * step);
    for (const Run* gap = first; gap != end; ++gap)
      for (int i = (gap->begin + step - 1) / step; i * step < gap->end; ++i) out.reference.at(i, j) = 0;
  }
  return out;
}

}  // namespace debulk
