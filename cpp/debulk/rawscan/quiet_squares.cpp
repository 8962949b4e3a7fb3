#include "debulk/rawscan/quiet_squares.hpp"

#include <algorithm>
#include <cmath>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

constexpr int side = SquareLattice::side;
constexpr float share_of_row = 0.5f;      // of one row's differences are low; noise has so many in one square of 2000
constexpr float more_in_row = 0.2f;       // added to the share beyond the bound that is allowed in a whole square
constexpr float smooth = 0.15f;           // greatest scatter, in steps; what was rounded has 0.29, unless it is level
constexpr float levels_for_steps = 2.0f;  // a square must have more than this times as many levels as the steps allow

// Looks at one row alone, which costs a fraction of the whole square and rules out nearly all squares.
bool may_be_quiet(const float* row, const RowDifferences<4>& differences, const QuietLimits& limits) {
  if (limits.difference > 0) {
    int low = 0;
    for (int k = 0; k < differences.count; ++k) low += std::abs(differences.along(limits.axis, k)) <= limits.difference;
    if (static_cast<float>(low) >= share_of_row * differences.count) return true;
  }
  if (!(limits.share > 0 || limits.level > 0)) return false;
  const float bound = limits.share > 0 ? limits.bound(row[2]) : 2 * smooth * limits.rounding.at(row[2]);
  int beyond = 0;
  for (const float r : row_residuals(row, limits.axis)) beyond += std::abs(r) > bound;
  return beyond <= (more_in_row + limits.share) * side;
}

bool quiet(const SquareLattice& lattice, int square, const QuietLimits& limits) {
  if (limits.difference > 0 && share_of_low(lattice, square, limits.axis, limits.difference) >= quiet_share) return true;
  if (!(limits.share > 0 || limits.level > 0)) return false;
  const SquareHeights heights(lattice, square, limits.axis);
  const float depth = lattice.point(square, side / 2, side / 2)[2];
  if (!heights.whole() || !std::isfinite(depth)) return false;
  if (limits.share > 0) return heights.share_beyond(limits.bound(depth)) <= limits.share;
  const float step = limits.rounding.at(depth);
  if (heights.scatter() > smooth * step) return false;
  const SquareHeights::Levels levels = heights.levels(limits.level);
  return static_cast<float>(levels.count) > levels_for_steps * (levels.range / step + 2);
}

}  // namespace

std::vector<std::uint8_t> quiet_squares(const SquareLattice& lattice, const std::vector<QuietLimits>& limits, int threads,
                                        const Stop& stop) {
  require(lattice.step >= 1, "step", "a positive number of pixels", lattice.step);
  const int columns = lattice.columns();
  std::vector<std::uint8_t> out(static_cast<std::size_t>(lattice.count()), 0);
  parallel_for(lattice.rows(), 4, threads, stop, [&](long begin, long end) {
    for (int square = static_cast<int>(begin) * columns; square < end * columns; ++square) {
      const float* row = lattice.point(square, 0, side / 2);
      const RowDifferences<4> differences(row);
      out[static_cast<std::size_t>(square)] = std::any_of(limits.begin(), limits.end(), [&](const QuietLimits& along) {
        return may_be_quiet(row, differences, along) && quiet(lattice, square, along);
      });
    }
  });
  return out;
}

}  // namespace debulk
