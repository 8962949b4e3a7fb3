#include "debulk/surface/fit_reference.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>

#include "debulk/core/error.hpp"
#include "debulk/core/median.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/core/pool.hpp"
#include "debulk/surface/cliffs.hpp"
#include "debulk/surface/fill_nodes.hpp"
#include "debulk/surface/misfit.hpp"
#include "debulk/surface/pooled.hpp"
#include "debulk/surface/strip_moments.hpp"

namespace debulk {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double bent_mm =
    0.03;  // so far off over several nodes, beyond noise, a fit does not follow the surface: a thin ply's level has 0.045
constexpr double bent_reach_mm = 8.0;  // distance from there to the nodes whose fits are the cause
constexpr int halvings = 2;            // of the window there; a shoulder of 5 mm radius needs a quarter of the window
constexpr double noisier = 30.0;       // a node is left out if its variance is so many times that with a full window

// Normal equations of the quadratic 1, x, y, x², xy, y², from the sums over rows.
struct Quadratic {
  static constexpr std::array<std::pair<std::size_t, std::size_t>, 6> powers{{{0, 0}, {1, 0}, {0, 1}, {2, 0}, {1, 1}, {0, 2}}};
  using Normal = Eigen::Matrix<double, 6, 6>;
  using Vector = Eigen::Matrix<double, 6, 1>;

  std::array<std::array<double, 5>, 5> weights{};  // of w x^a y^b at [b][a], a + b <= 4
  std::array<std::array<double, 3>, 3> heights{};  // of w x^a y^b z, a + b <= 2
  double squares = 0;

  void add_weights(const std::array<double, 5>& row, const std::array<double, 5>& y) {
    for (std::size_t b = 0; b < 5; ++b)
      for (std::size_t a = 0; a + b < 5; ++a) weights[b][a] += y[b] * row[a];
  }
  // From the sums that StripMoments gives for several nodes.
  void set_weights(const double* sums) {
    for (std::size_t a = 0; a < 5; ++a)
      for (std::size_t b = 0; a + b < 5; ++b, sums += kTogether) weights[b][a] = *sums;
  }
  void set_heights(const double* sums) {
    for (std::size_t b = 0; b < 3; ++b)
      for (std::size_t a = 0; a + b < 3; ++a, sums += kTogether) heights[b][a] = *sums;
    squares = *sums;
  }
  Normal normal() const {
    Normal out;
    for (std::size_t p = 0; p < 6; ++p)
      for (std::size_t q = 0; q < 6; ++q)
        out(static_cast<Eigen::Index>(p), static_cast<Eigen::Index>(q)) =
            weights[powers[p].second + powers[q].second][powers[p].first + powers[q].first];
    return out;
  }
  Vector right() const {
    Vector out;
    for (std::size_t p = 0; p < 6; ++p) out[static_cast<Eigen::Index>(p)] = heights[powers[p].second][powers[p].first];
    return out;
  }
  struct Fit {
    double height = nan;  // in the middle of the window, mm
    double variance = 0;  // of that height, in units of one measured height's
    double scatter2 = 0;  // variance of the heights about the fit, mm²
  };
};

// The factorised normal equations.
struct Factors {
  Eigen::LLT<Quadratic::Normal> solver;
  double weight = 0, variance = 0;  // of a fit's height, in units of one height's; 0: singular equations

  explicit Factors(const Quadratic::Normal& normal) : solver(normal), weight(normal(0, 0)) {
    if (solver.info() == Eigen::Success) variance = solver.solve(Quadratic::Vector::Unit(0))[0];
  }
  Quadratic::Fit fit(const Quadratic& sums) const {
    const Quadratic::Vector right = sums.right(), surface = solver.solve(right);
    return {surface[0], variance, std::max(0.0, sums.squares - surface.dot(right)) / weight};
  }
};

// The fits round the nodes that are wanted (all, if `wanted` is empty). Their height is NaN if there is too little to
// fit to.
Grid<Quadratic::Fit> fit_nodes(const Grid<float>& heights, const FitNodes& nodes, const FitWindow& window, const Grid<std::uint8_t>& wanted,
                               Pool<StripMoments>& memory, int threads, const Stop& stop) {
  const int reach = window.reach;
  Quadratic full;
  for (int d = -reach; d <= reach; ++d) full.add_weights(window.all, window.at(d));
  const Factors complete_factors(full.normal());
  const double limit = noisier * complete_factors.variance;

  Grid<Quadratic::Fit> out(nodes.nx, nodes.ny, heights.position(nodes.first_i, nodes.first_j), nodes.step * heights.spacing);
  parallel_for((nodes.nx + kTogether - 1) / kTogether, 1, threads, stop, [&](long strip, long) {
    const int first = static_cast<int>(strip) * kTogether, last = std::min(first + kTogether, nodes.nx);
    const std::shared_ptr<StripMoments> moments = memory.borrow();
    moments->read(heights, nodes, window, first, wanted);
    for (int j = 0; j < nodes.ny; ++j) {
      const int middle = nodes.first_j + j * nodes.step;
      const int low = std::max(0, middle - reach), high = std::min(heights.ny - 1, middle + reach);
      if (low > high) continue;  // the node lies beyond the border
      const auto asked = [&](int i) { return wanted.size() == 0 || wanted.at(i, j) != 0; };
      bool any = false;
      for (int i = first; i < last; ++i) any = any || asked(i);
      if (!any) continue;
      double found[kSquareSums * kTogether], weights[kSquareWeights * kTogether];
      moments->add_up(low, high, middle, found);
      const unsigned complete = moments->add_up_weights(low, high, middle, weights);
      for (int i = first; i < last; ++i) {
        if (!asked(i)) continue;
        Quadratic sums;
        sums.set_heights(found + (i - first));
        Quadratic::Fit& fit = out.at(i, j);
        if ((complete >> (i - first) & 1U) != 0) {
          fit = complete_factors.fit(sums);
          continue;
        }
        sums.set_weights(weights + (i - first));
        const Factors factors(sums.normal());
        if (factors.variance > 0 && factors.variance <= limit) fit = factors.fit(sums);
      }
    }
  });
  return out;
}

// Whether a wider window's fits follow the surface round node (i, j) as well as a narrower one's. They do if their
// difference is no larger than the noise and, like noise, changes its sign from place to place.
bool agree(const Grid<Quadratic::Fit>& narrow, const Grid<Quadratic::Fit>& wide, int i, int j, int reach, double scatter2) {
  double sum = 0, squares = 0, noise = 0;
  int count = 0;
  for (int b = std::max(0, j - reach); b <= std::min(narrow.ny - 1, j + reach); ++b)
    for (int a = std::max(0, i - reach); a <= std::min(narrow.nx - 1, i + reach); ++a) {
      const double off = wide.at(a, b).height - narrow.at(a, b).height;
      if (std::isnan(off)) continue;
      sum += off, squares += off * off, noise += scatter2 * narrow.at(a, b).variance;
      ++count;
    }
  const double mean2 = sum * sum / std::max(1, count);
  return 2 * count > (2 * reach + 1) * (2 * reach + 1) && squares <= 2 * noise && mean2 <= (squares - mean2) / 3;
}

// 1 for the nodes whose window is halved at least so many times.
Grid<std::uint8_t> halved(const Grid<std::uint8_t>& bent, int times) {
  Grid<std::uint8_t> out = bent;
  for (std::uint8_t& mark : out.values) mark = mark >= times;
  return out;
}

// The nodes' heights, each from the widest of a few windows such that every window up to it agrees with the next
// narrower one. At the `bent` nodes they are from the least window, halved as many times as is marked there. `fits` keeps
// those in the least window and in its doubles for another call with the same heights.
Grid<double> fit_heights(const Grid<float>& heights, const FitNodes& nodes, int reach, int doublings, const Grid<std::uint8_t>& bent,
                         std::vector<Grid<Quadratic::Fit>>& fits, Pool<StripMoments>& memory, int threads, const Stop& stop) {
  while (static_cast<int>(fits.size()) <= doublings)
    fits.push_back(fit_nodes(heights, nodes, FitWindow(reach << fits.size()), {}, memory, threads, stop));
  std::vector<Grid<Quadratic::Fit>> narrow;
  const int most = bent.size() == 0 ? 0 : *std::max_element(bent.values.begin(), bent.values.end());
  for (int k = 1; k <= most; ++k)
    narrow.push_back(fit_nodes(heights, nodes, FitWindow(std::max(2, reach >> k)), halved(bent, k), memory, threads, stop));
  Grid<double> out = fits.front().like<double>(nan);
  parallel_for(nodes.ny, 4, threads, stop, [&](long begin, long end) {
    for (int j = static_cast<int>(begin); j < end; ++j)
      for (int i = 0; i < nodes.nx; ++i) {
        std::size_t level = most == 0 ? 0 : bent.at(i, j);
        while (level > 0 && std::isnan(narrow[level - 1].at(i, j).height)) --level;
        if (level > 0) {
          out.at(i, j) = narrow[level - 1].at(i, j).height;
          continue;
        }
        const Quadratic::Fit& least = fits.front().at(i, j);
        std::size_t widest = 0;
        // The fits' noise varies within this reach, in nodes.
        const auto around = [&](std::size_t k) { return std::max(2, 3 * (reach << k) / (2 * nodes.step)); };
        while (!std::isnan(least.height) && widest + 1 < fits.size() &&
               agree(fits[widest], fits[widest + 1], i, j, around(widest), least.scatter2))
          ++widest;
        out.at(i, j) = fits[widest].at(i, j).height;
      }
  });
  return out;
}

// Marks the nodes near which a fit is off what was measured because the surface bends within a window. Empty if there
// are none.
Grid<std::uint8_t> bent_nodes(const Grid<float>& residual, const Grid<double>& nodes, int threads, const Stop& stop) {
  const Grid<std::uint8_t> squares = misfit_squares(residual, bent_mm, 1.0, threads, stop);
  if (std::find(squares.values.begin(), squares.values.end(), 1) == squares.values.end()) return {};
  return nodes_near(squares, nodes, bent_reach_mm);
}

// Removes heights far off the fit, which are caused by a scanner's spikes, clamps and tools.
void remove_strays(Grid<float>& heights, const Grid<float>& residual, double robust) {
  std::vector<float> sample;
  for (std::size_t k = 0; k < residual.size(); k += std::max<std::size_t>(1, residual.size() / 200'000))
    if (!std::isnan(residual.values[k])) sample.push_back(std::abs(residual.values[k]));
  if (sample.empty()) return;
  // At least 0.05 mm, because exact heights have no noise from which a limit could follow.
  const double limit = std::max(0.05, robust * 1.4826 * upper_median(sample));
  for (std::size_t k = 0; k < heights.size(); ++k)
    if (std::abs(residual.values[k]) > limit) heights.values[k] = std::numeric_limits<float>::quiet_NaN();
}

}  // namespace

void FitOptions::check() const {
  require(std::isfinite(spacing) && spacing > 0, "spacing_mm", "a positive length in mm", spacing);
  require(std::isfinite(window) && window > 0, "window_mm", "a positive length in mm", window);
  require(doublings >= 0 && doublings <= 4, "doublings", "0 to 4", doublings);
  require(std::isfinite(robust) && robust >= 3, "robust", "3 or more standard deviations", robust);
}

Reference fit_reference(const Grid<float>& heights, const FitOptions& options, int threads, const Stop& stop,
                        const Grid<std::uint8_t>& under_ply) {
  options.check();
  require(heights.nx >= 2 && heights.ny >= 2, "heights", "a grid of at least 2 by 2 heights",
          std::to_string(heights.ny) + " by " + std::to_string(heights.nx));
  require(std::isfinite(heights.spacing) && heights.spacing > 0, "heights", "a positive spacing in mm", heights.spacing);
  require(under_ply.size() == 0 || (under_ply.nx == heights.nx && under_ply.ny == heights.ny), "under_ply", "a mark for each height",
          std::to_string(under_ply.ny) + " by " + std::to_string(under_ply.nx));
  const FitNodes nodes(heights, options.spacing);
  const int reach = std::max({2, nodes.step, static_cast<int>(std::lround(options.window / heights.spacing))});
  Grid<float> kept = heights;
  const Grid<std::uint8_t> hidden = hide_beside_cliffs(kept, under_ply, threads, stop);
  Grid<std::uint8_t> bent;
  std::vector<Grid<Quadratic::Fit>> fits;
  Pool<StripMoments> memory;  // fresh pages for each would take a while
  const auto fitted = [&](int doublings) {
    Grid<double> out = fit_heights(kept, nodes, reach, doublings, bent, fits, memory, threads, stop);
    if (hidden.size() != 0) go_on_over_cliffs(out, hidden);
    return Reference(fill_nodes(std::move(out), stop));
  };
  {
    Reference first = fitted(0);
    Grid<float> residual = residuals(kept, first, threads, stop);
    for (int k = 0; k < halvings; ++k) {
      const Grid<std::uint8_t> off = bent_nodes(residual, first.heights(), threads, stop);
      if (off.size() == 0) break;
      if (bent.size() == 0) bent = off.like<std::uint8_t>();
      for (std::size_t n = 0; n < off.size(); ++n) bent.values[n] = static_cast<std::uint8_t>(bent.values[n] + off.values[n]);
      first = fitted(0);
      residual = residuals(kept, first, threads, stop);
    }
    remove_strays(kept, residual, options.robust);
    fits.clear();
  }
  return fitted(options.doublings);
}

}  // namespace debulk
