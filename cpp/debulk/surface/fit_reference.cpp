#include "debulk/surface/fit_reference.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Cholesky>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/surface/fill_nodes.hpp"

namespace debulk {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double noisier = 30.0;  // a node is left out if its variance is so many times that with a full window

using Moments = std::array<double, 9>;  // sums over a row of w x^a, a = 0 ... 4, of w x^a z, a = 0 ... 2, and of w z²

// Where the nodes lie: every `step` cells from `first_i`, `first_j`, from at or just before the grid's border to at or
// just behind it.
struct Nodes {
  int step, nx, ny, first_i, first_j;

  Nodes(const Grid<float>& heights, double spacing) : step(std::max(1, static_cast<int>(std::lround(spacing / heights.spacing)))) {
    nx = std::max(4, (heights.nx - 2 + step) / step + 1);
    ny = std::max(4, (heights.ny - 2 + step) / step + 1);
    first_i = -((nx - 1) * step - (heights.nx - 1)) / 2;
    first_j = -((ny - 1) * step - (heights.ny - 1)) / 2;
  }
};

// The weights and coordinates of one axis of the window.
struct Window {
  int reach;
  std::vector<double> weight, x;  // [d + reach]

  explicit Window(int r) : reach(r) {
    for (int d = -r; d <= r; ++d) {
      x.push_back(static_cast<double>(d) / (r + 1));
      weight.push_back(std::pow(1 - x.back() * x.back(), 2));
    }
  }
};

// Normal equations of the quadratic 1, x, y, x², xy, y².
struct Quadratic {
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
  double squares = 0;

  void add_row(const Moments& row, double y, double weight) {
    static constexpr std::array<std::pair<int, int>, 6> powers{{{0, 0}, {1, 0}, {0, 1}, {2, 0}, {1, 1}, {0, 2}}};
    const std::array<double, 5> yw{weight, weight * y, weight * y * y, weight * y * y * y, weight * y * y * y * y};
    squares += weight * row[8];
    for (int p = 0; p < 6; ++p) {
      const auto [a, b] = powers[static_cast<std::size_t>(p)];
      right[p] += yw[static_cast<std::size_t>(b)] * row[static_cast<std::size_t>(5 + a)];
      for (int q = 0; q <= p; ++q) {
        const auto [c, d] = powers[static_cast<std::size_t>(q)];
        normal(p, q) += yw[static_cast<std::size_t>(b + d)] * row[static_cast<std::size_t>(a + c)];
      }
    }
  }
  struct Fit {
    double height = nan;  // at the middle
    double variance = 0;  // of that, in units of one height's
    double scatter2 = 0;  // variance of a height round the fit, mm²
  };
  Fit fit() const {
    const Eigen::LLT<Eigen::Matrix<double, 6, 6>> factors(normal);
    if (factors.info() != Eigen::Success) return {};
    const double variance = factors.solve(Eigen::Matrix<double, 6, 1>::Unit(0))[0];
    const Eigen::Matrix<double, 6, 1> surface = factors.solve(right);
    return {surface[0], variance, std::max(0.0, squares - surface.dot(right)) / normal(0, 0)};
  }
};

Moments row_moments(const float* row, int nx, int middle, const Window& window) {
  Moments m{};
  const int begin = std::max(0, middle - window.reach), end = std::min(nx - 1, middle + window.reach);
  for (int i = begin; i <= end; ++i) {
    if (std::isnan(row[i])) continue;
    const auto k = static_cast<std::size_t>(i - middle + window.reach);
    const double x = window.x[k], z = row[i];
    double w = window.weight[k];
    for (std::size_t a = 0; a < 5; ++a, w *= x) {
      m[a] += w;
      if (a < 3) m[5 + a] += w * z;
      if (a == 0) m[8] += w * z * z;
    }
  }
  return m;
}

// The fits round the nodes; their height is NaN where there is too little to fit to.
Grid<Quadratic::Fit> fit_nodes(const Grid<float>& heights, const Nodes& nodes, const Window& window, int threads, const Stop& stop) {
  std::vector<Moments> rows(static_cast<std::size_t>(heights.ny) * nodes.nx);
  parallel_for(heights.ny, 16, threads, stop, [&](long begin, long end) {
    for (long j = begin; j < end; ++j)
      for (int i = 0; i < nodes.nx; ++i)
        rows[static_cast<std::size_t>(j) * nodes.nx + i] =
            row_moments(&heights.values[heights.index(0, static_cast<int>(j))], heights.nx, nodes.first_i + i * nodes.step, window);
  });

  Quadratic full;
  const std::vector<float> complete(window.weight.size(), 0.0f);
  const Moments all = row_moments(complete.data(), static_cast<int>(complete.size()), window.reach, window);
  for (std::size_t k = 0; k < window.weight.size(); ++k) full.add_row(all, window.x[k], window.weight[k]);
  const double limit = noisier * full.fit().variance;

  Grid<Quadratic::Fit> out(nodes.nx, nodes.ny, heights.position(nodes.first_i, nodes.first_j), nodes.step * heights.spacing);
  parallel_for(nodes.ny, 4, threads, stop, [&](long begin, long end) {
    for (int j = static_cast<int>(begin); j < end; ++j)
      for (int i = 0; i < nodes.nx; ++i) {
        const int middle = nodes.first_j + j * nodes.step;
        Quadratic sums;
        for (int y = std::max(0, middle - window.reach); y <= std::min(heights.ny - 1, middle + window.reach); ++y) {
          const auto k = static_cast<std::size_t>(y - middle + window.reach);
          sums.add_row(rows[static_cast<std::size_t>(y) * nodes.nx + i], window.x[k], window.weight[k]);
        }
        Quadratic::Fit& fit = out.at(i, j);
        fit = sums.fit();
        if (!(fit.variance > 0 && fit.variance <= limit)) fit.height = nan;
      }
  });
  return out;
}

// Whether a wider window's fits follow the surface round node (i, j) as well as a narrower one's: what sets them apart is no
// larger than the noise, and like noise changes its sign from place to place.
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

// The nodes' heights, each from the widest window, of a few, that agrees with the next narrower one, as that does.
Grid<double> fit_heights(const Grid<float>& heights, const Nodes& nodes, int reach, int doublings, int threads, const Stop& stop) {
  std::vector<Grid<Quadratic::Fit>> fits;
  for (int k = 0; k <= doublings; ++k) fits.push_back(fit_nodes(heights, nodes, Window(reach << k), threads, stop));
  Grid<double> out = fits.front().like<double>(nan);
  parallel_for(nodes.ny, 4, threads, stop, [&](long begin, long end) {
    for (int j = static_cast<int>(begin); j < end; ++j)
      for (int i = 0; i < nodes.nx; ++i) {
        const Quadratic::Fit& least = fits.front().at(i, j);
        std::size_t widest = 0;
        const auto around = [&](std::size_t k) { return std::max(2, 3 * (reach << k) / (2 * nodes.step)); };  // noise differs over this
        while (!std::isnan(least.height) && widest + 1 < fits.size() &&
               agree(fits[widest], fits[widest + 1], i, j, around(widest), least.scatter2))
          ++widest;
        out.at(i, j) = fits[widest].at(i, j).height;
      }
  });
  return out;
}

// The heights without those far off the fit: what a scanner's spikes, clamps and tools leave.
Grid<float> without_strays(const Grid<float>& heights, const Reference& fit, double robust, int threads, const Stop& stop) {
  Grid<float> off = heights.like<float>();
  parallel_for(heights.ny, 16, threads, stop, [&](long begin, long end) {
    for (int j = static_cast<int>(begin); j < end; ++j)
      for (int i = 0; i < heights.nx; ++i)
        off.at(i, j) = std::isnan(heights.at(i, j)) ? heights.at(i, j)
                                                    : static_cast<float>(std::abs(heights.at(i, j) - fit.height(heights.position(i, j))));
  });
  std::vector<float> sample;
  for (std::size_t k = 0; k < off.size(); k += std::max<std::size_t>(1, off.size() / 200'000))
    if (!std::isnan(off.values[k])) sample.push_back(off.values[k]);
  if (sample.empty()) return heights;
  const auto middle = sample.begin() + static_cast<long>(sample.size() / 2);
  std::nth_element(sample.begin(), middle, sample.end());
  const double limit = std::max(0.05, robust * 1.4826 * *middle);  // 0.05 mm: exact heights have no noise that a limit could follow from

  Grid<float> out = heights;
  for (std::size_t k = 0; k < out.size(); ++k)
    if (off.values[k] > limit) out.values[k] = std::numeric_limits<float>::quiet_NaN();
  return out;
}

}  // namespace

void FitOptions::check() const {
  require(std::isfinite(spacing) && spacing > 0, "spacing_mm", "a positive length in mm", spacing);
  require(std::isfinite(window) && window > 0, "window_mm", "a positive length in mm", window);
  require(doublings >= 0 && doublings <= 4, "doublings", "0 to 4", doublings);
  require(std::isfinite(robust) && robust >= 3, "robust", "3 or more standard deviations", robust);
}

Reference fit_reference(const Grid<float>& heights, const FitOptions& options, int threads, const Stop& stop) {
  options.check();
  require(heights.nx >= 2 && heights.ny >= 2, "heights", "a grid of at least 2 by 2 heights",
          std::to_string(heights.ny) + " by " + std::to_string(heights.nx));
  require(std::isfinite(heights.spacing) && heights.spacing > 0, "heights", "a positive spacing in mm", heights.spacing);
  const Nodes nodes(heights, options.spacing);
  const int reach = std::max({2, nodes.step, static_cast<int>(std::lround(options.window / heights.spacing))});
  const Reference first(fill_nodes(fit_heights(heights, nodes, reach, 0, threads, stop), stop));
  const Grid<float> kept = without_strays(heights, first, options.robust, threads, stop);
  return Reference(fill_nodes(fit_heights(kept, nodes, reach, options.doublings, threads, stop), stop));
}

}  // namespace debulk
