#include "debulk/surface/misfit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "debulk/core/median.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/core/row_runs.hpp"
#include "debulk/surface/pooled.hpp"

namespace debulk {
namespace {

constexpr double noisier = 8.0;       // robust standard deviations: seldom reached in a million squares of correlated noise
constexpr int enough = 7;             // known squares of nine
constexpr double least_mm2 = 64.0;    // area of four nodes, 4 mm apart
constexpr double tolerance_mm = 0.2;  // by which a height may be off where a ply lies on the mold (patch.mold_tol_mm)
constexpr float nan = std::numeric_limits<float>::quiet_NaN();

// The absolute value of the mean over the 3 by 3 squares round each, without the two highest and the two lowest,
// because there are spikes beside gaps. It is at most the share `most` of the largest. At least seven squares must be
// known.
Grid<float> smoothed(const Grid<float>& squares, double most, int threads, const Stop& stop) {
  Grid<float> out = squares.like<float>(nan);
  parallel_for(squares.ny, 8, threads, stop, [&](long begin, long end) {
    for (int j = static_cast<int>(begin); j < end; ++j)
      for (int i = 0; i < squares.nx; ++i) {
        std::array<float, 9> known{};
        int count = 0;
        for (int b = std::max(0, j - 1); b <= std::min(squares.ny - 1, j + 1); ++b)
          for (int a = std::max(0, i - 1); a <= std::min(squares.nx - 1, i + 1); ++a)
            if (!std::isnan(squares.at(a, b))) known[static_cast<std::size_t>(count++)] = squares.at(a, b);
        if (count < enough) continue;
        std::sort(known.begin(), known.begin() + count);
        double sum = 0;
        for (int k = 2; k < count - 2; ++k) sum += known[static_cast<std::size_t>(k)];
        const double largest = std::max(std::abs(known[0]), std::abs(known[static_cast<std::size_t>(count - 1)]));
        out.at(i, j) = static_cast<float>(std::min(std::abs(sum / (count - 4)), most * largest));
      }
  });
  return out;
}

double median_of(const Grid<float>& grid) {
  std::vector<float> known;
  known.reserve(grid.size());
  for (const float value : grid.values)
    if (!std::isnan(value)) known.push_back(value);
  return upper_median(known);
}

void drop_small(Grid<std::uint8_t>& marks) {
  const std::vector<Run> runs = find_runs(marks, true);
  const std::vector<int> first = join_runs(runs, 1);
  std::vector<double> area(runs.size(), 0.0);
  for (std::size_t k = 0; k < runs.size(); ++k)
    area[static_cast<std::size_t>(first[k])] += (runs[k].end - runs[k].begin) * marks.spacing * marks.spacing;
  for (std::size_t k = 0; k < runs.size(); ++k)
    if (area[static_cast<std::size_t>(first[k])] < least_mm2)
      std::fill(&marks.at(runs[k].begin, runs[k].row), &marks.at(runs[k].begin, runs[k].row) + (runs[k].end - runs[k].begin), 0);
}

Grid<std::uint8_t> widened(const Grid<std::uint8_t>& marks) {
  Grid<std::uint8_t> out = marks;
  for (int j = 0; j < marks.ny; ++j)
    for (int i = 0; i < marks.nx; ++i) {
      if (marks.at(i, j) == 0) continue;
      for (int b = std::max(0, j - 1); b <= std::min(marks.ny - 1, j + 1); ++b)
        for (int a = std::max(0, i - 1); a <= std::min(marks.nx - 1, i + 1); ++a) out.at(a, b) = 1;
    }
  return out;
}

}  // namespace

Grid<float> residuals(const Grid<float>& heights, const Reference& fit, int threads, const Stop& stop) {
  Grid<float> out = heights.like<float>();
  parallel_for(heights.ny, 32, threads, stop, [&](long begin, long end) {
    Grid<double> rows(heights.nx, static_cast<int>(end - begin), heights.position(0, static_cast<double>(begin)), heights.spacing);
    fit.heights_on(rows, 1);
    const std::size_t first = heights.index(0, static_cast<int>(begin));
    for (std::size_t k = 0; k < rows.size(); ++k) out.values[first + k] = static_cast<float>(heights.values[first + k] - rows.values[k]);
  });
  return out;
}

Grid<std::uint8_t> misfit_squares(const Grid<float>& residual, double tolerance, double most, int threads, const Stop& stop) {
  if (pool_side(residual) < 2) return residual.like<std::uint8_t>();  // a square would be a single height, and may be a spike
  const Grid<float> off = smoothed(pooled_medians(residual, pool_side(residual), threads, stop), most, threads, stop);
  const double limit = std::max(tolerance, noisier * 1.4826 * median_of(off));
  Grid<std::uint8_t> marks = off.like<std::uint8_t>();
  for (std::size_t k = 0; k < off.size(); ++k) marks.values[k] = off.values[k] > limit;
  drop_small(marks);
  return widened(marks);
}

Grid<std::uint8_t> misfits(const Grid<float>& heights, const Reference& fit, int threads, const Stop& stop) {
  // A broad, even misfit of a tenth or two does no harm, so half of the largest residual must be too much.
  const Grid<std::uint8_t> squares = misfit_squares(residuals(heights, fit, threads, stop), tolerance_mm, 0.5, threads, stop);
  const int side = pool_side(heights);
  Grid<std::uint8_t> out = heights.like<std::uint8_t>();
  for (int b = 0; b < squares.ny; ++b)
    for (int a = 0; a < squares.nx; ++a) {
      if (squares.at(a, b) == 0) continue;
      for (int j = b * side; j < std::min(heights.ny, (b + 1) * side); ++j)
        for (int i = a * side; i < std::min(heights.nx, (a + 1) * side); ++i) out.at(i, j) = !std::isnan(heights.at(i, j));
    }
  return out;
}

}  // namespace debulk
