#include "debulk/rawscan/quiet_limits.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

constexpr int side = SquareLattice::side;
constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float quiet = 0.1f;          // of the scan's median; a lower difference or residual has no noise of this scan
constexpr float steps = 0.25f;         // of second differences may be alike; noise gives 0.11, with steps as high 0.29
constexpr float alike = 0.2f;          // width in which differences are alike, as a share of their median
constexpr int bins_alike = 10;         // number of bins in that width
constexpr float ulps = 4.0f;           // what rounding to single precision leaves of a smooth surface's differences
constexpr float level_ground = 1.2f;   // steps in the scatter; with fewer, fourth differences of noise are often 0
constexpr std::size_t for_steps = 60;  // squares whose levels are sorted
constexpr float fine = 6.0f;           // steps in the scatter; from there on a smooth surface shows even if rounded
constexpr float apart = 4.0f;          // standard deviations of the share, between squares with noise and without
constexpr float wary = 5.0f;           // standard deviations by which a square with noise never lies below the median
// Shares of a square's pixels. On a smooth surface that was rounded, fewer than least_share are beyond half a step and
// a tenth in 99 of 100 squares.
constexpr float least_share = 0.03f;
constexpr float most_share = 0.3f;
constexpr float to_deviation = 1 / 0.6745f;

// Quantile of the values that are finite; 0 if none is. The values are reordered.
float quantile(std::vector<float>& values, double share) {
  values.erase(std::remove_if(values.begin(), values.end(), [](float v) { return !std::isfinite(v); }), values.end());
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// The largest share of the sizes that lie in a window as wide as `alike` times their median. The sizes are reordered.
float most_alike(std::vector<float>& sizes) {
  const float median = quantile(sizes, 0.5);
  if (!(median > 0)) return 1;
  std::vector<int> bins(static_cast<std::size_t>(20 / alike) * bins_alike, 0);  // up to 20 medians
  const float scale = bins_alike / (alike * median);
  for (const float size : sizes)
    if (const float bin = size * scale; bin < static_cast<float>(bins.size())) ++bins[static_cast<std::size_t>(bin)];
  long inside = 0, most = 0;
  for (std::size_t k = 0; k < bins.size(); ++k) {
    inside += bins[k] - (k >= bins_alike ? bins[k - bins_alike] : 0);
    most = std::max(most, inside);
  }
  return static_cast<float>(most) / static_cast<float>(sizes.size());
}

// Determines the limits of one scan.
class Limits {
 public:
  Limits(const SquareLattice& lattice, const std::vector<int>& squares, int threads, const Stop& stop)
      : lattice_(lattice), squares_(squares), threads_(threads), stop_(stop) {}

  // The resolution that single precision leaves along an axis, mm.
  float grain(const Eigen::Vector3f& axis) const {
    float largest = 0;
    for (const int square : squares_)
      for (int c = 0; c < 3; ++c)
        if (const float size = std::abs(lattice_.point(square, side / 2, side / 2)[c]); axis[c] != 0 && std::isfinite(size))
          largest = std::max(largest, size);
    return std::nextafter(largest, std::numeric_limits<float>::infinity()) - largest;
  }

  // The limit of fourth differences; 0 if they cannot be used.
  float difference(const Eigen::Vector3f& axis) const {
    constexpr std::size_t rows = 4, seconds = RowDifferences<2>::count, fourths = RowDifferences<4>::count;
    std::vector<float> second(squares_.size() * rows * seconds), fourth(squares_.size() * rows * fourths);
    for_squares([&](std::size_t k) {
      for (std::size_t j = 0; j < rows; ++j) {
        const float* row = lattice_.point(squares_[k], 0, static_cast<int>(j * side / rows));
        const RowDifferences<2> two(row);
        const RowDifferences<4> four(row);
        for (std::size_t n = 0; n < seconds; ++n) second[(k * rows + j) * seconds + n] = std::abs(two.along(axis, static_cast<int>(n)));
        for (std::size_t n = 0; n < fourths; ++n) fourth[(k * rows + j) * fourths + n] = std::abs(four.along(axis, static_cast<int>(n)));
      }
    });
    const float limit = quiet * quantile(fourth, 0.5);
    if (limit < ulps * grain(axis)) return 0;
    // Squares that are almost free of noise do not count for the steps, because they are what is looked for.
    for (std::size_t k = 0; k < squares_.size(); ++k)
      if (share_of_low(lattice_, squares_[k], axis, limit) >= quiet_share)
        std::fill_n(second.begin() + static_cast<std::ptrdiff_t>(k * rows * seconds), rows * seconds, nan);
    return most_alike(second) > steps ? 0 : limit;
  }

  // Determines the steps along an axis, and the scatter.
  void take_steps(QuietLimits& limits, float same) const {
    const std::size_t every = squares_.size() / for_steps + 1;
    std::vector<float> gaps(squares_.size(), nan), depths(gaps), scatters(gaps);
    for_squares([&](std::size_t k) {
      if (k % every != 0) return;
      const SquareHeights heights(lattice_, squares_[k], limits.axis);
      if (!heights.whole()) return;
      scatters[k] = heights.scatter();
      const float gap = heights.levels(same).least_gap;
      if (gap > 0) gaps[k] = gap, depths[k] = lattice_.point(squares_[k], side / 2, side / 2)[2];
    });
    limits.scatter = quantile(scatters, 0.5);
    std::vector<float> some = depths;
    const float depth = quantile(some, 0.5);
    const auto spread = [&](bool squared) {
      std::vector<float> off = gaps;
      if (squared)
        for (std::size_t k = 0; k < off.size(); ++k) off[k] *= (depth / depths[k]) * (depth / depths[k]);
      std::vector<float> copy = off;
      const float middle = quantile(copy, 0.5);
      for (float& v : off) v = std::abs(v - middle);
      return std::pair<float, float>(quantile(off, 0.5), middle);
    };
    const auto same_everywhere = spread(false), of_disparity = spread(true);
    limits.rounding.depth = depth, limits.rounding.squared = depth != 0 && of_disparity.first < same_everywhere.first;
    limits.rounding.step = limits.rounding.squared ? of_disparity.second : same_everywhere.second;
  }

  // The share of pixels beyond the bound up to which a square counts as free of noise, from the shares in squares with
  // noise; 0 if the two cannot be distinguished.
  float share(const QuietLimits& limits) const {
    std::vector<float> shares(squares_.size(), nan);
    for_squares([&](std::size_t k) {
      const SquareHeights heights(lattice_, squares_[k], limits.axis);
      const float depth = lattice_.point(squares_[k], side / 2, side / 2)[2];
      if (heights.whole() && std::isfinite(depth)) shares[k] = heights.share_beyond(limits.bound(depth));
    });
    const float median = quantile(shares, 0.5);
    // Patches without noise have the lowest shares, so the upper half is free of them.
    const float deviation = to_deviation * (quantile(shares, 0.75) - median);
    if (median - apart * deviation < least_share) return 0;
    return std::clamp(median - wary * deviation, least_share, most_share);
  }

 private:
  template <class Body>
  void for_squares(const Body& body) const {
    parallel_for(static_cast<long>(squares_.size()), 64, threads_, stop_, [&](long begin, long end) {
      for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k) body(k);
    });
  }

  const SquareLattice& lattice_;
  const std::vector<int>& squares_;
  const int threads_;
  const Stop& stop_;
};

}  // namespace

float QuietLimits::bound(float depth) const {
  const float step = rounding.at(depth);
  return 0.5f * step + quiet * std::max(step, scatter);
}

std::vector<QuietLimits> quiet_limits(const SquareLattice& lattice, const std::vector<int>& squares,
                                      const std::vector<Eigen::Vector3f>& axes, int threads, const Stop& stop) {
  require(lattice.step >= 1, "step", "a positive number of pixels", lattice.step);
  for (const int square : squares) require(square >= 0 && square < lattice.count(), "squares", "numbers of squares of the image", square);
  const Limits limits(lattice, squares, threads, stop);
  std::vector<QuietLimits> out(axes.size());
  Rounding coarsest;
  for (std::size_t k = 0; k < axes.size(); ++k) {
    out[k].axis = axes[k];
    out[k].difference = limits.difference(axes[k]);
    // The scanner's own z is a number of the cloud and has exact levels. Heights along another axis are computed from
    // three numbers.
    const bool own = axes[k] == Eigen::Vector3f::UnitZ();
    out[k].level = (own ? 0.5f : ulps) * limits.grain(axes[k]);
    limits.take_steps(out[k], out[k].level);
    if (out[k].rounding.step > coarsest.step) coarsest = out[k].rounding;
  }
  bool unresolved = false;
  for (QuietLimits& along : out) {
    const bool has_levels = along.axis == Eigen::Vector3f::UnitZ() && along.rounding.step > 2 * ulps * along.level;
    along.rounding = coarsest;  // what was rounded along one axis is rough by up to as much along the other
    along.stepped = along.scatter < fine * coarsest.step;
    if (along.stepped) along.share = limits.share(along);
    if (along.scatter < level_ground * coarsest.step) along.difference = 0;
    if (!along.stepped || !has_levels) along.level = 0;
    unresolved = unresolved || (along.stepped && !(along.share > 0));
  }
  for (QuietLimits& along : out) {  // both axes see the same noise
    if (unresolved) along.share = 0;
    if (!unresolved) along.level = 0;
  }
  return out;
}

}  // namespace debulk
