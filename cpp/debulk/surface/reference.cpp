#include "debulk/surface/reference.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/surface/spline_row.hpp"

namespace debulk {
namespace {

// Computes the cubic B-spline coefficients c[-1..n] of the spline through f[0..n-1], so that
// (c[i-1] + 4 c[i] + c[i+1]) / 6 = f[i], along `wide` columns of n rows at once, in place. Row j of f is row j + 1 of
// `rows`, which are `stride` apart and whose first and last are set, too. The not-a-knot condition,
// c[-1] - 4 c[0] + 6 c[1] - 4 c[2] + c[3] = 0, and the first three equations give c[1] = (8 f[1] - f[0] - f[2]) / 6
// directly, and likewise at the other end. A tridiagonal system remains between them.
template <int kWide = Eigen::Dynamic>
void spline_columns(double* rows, int wide, int stride, int n) {
  using Row = Eigen::Array<double, kWide, 1>;
  const auto c = [&](int j) { return Eigen::Map<Row>(rows + static_cast<long>(j + 1) * stride, wide); };
  const Row first = c(0), second = c(1), next_to_last = c(n - 2), last = c(n - 1), third_from_last = c(n - 3);
  c(1) = (8 * second - first - c(2)) / 6;
  c(n - 2) = (8 * next_to_last - last - third_from_last) / 6;
  std::vector<double> above(static_cast<std::size_t>(n), 0.0);
  for (int j = 2; j <= n - 3; ++j) {  // c[j-1] + 4 c[j] + c[j+1] = 6 f[j], forward elimination
    const double pivot = 4 - (j == 2 ? 0.0 : above[static_cast<std::size_t>(j - 1)]);
    above[static_cast<std::size_t>(j)] = 1 / pivot;
    c(j) = (6 * c(j) - c(j - 1)) / pivot;
  }
  for (int j = n - 3; j >= 2; --j) c(j) -= above[static_cast<std::size_t>(j)] * c(j + 1);
  c(0) = 6 * second - 4 * c(1) - c(2);
  c(-1) = 6 * first - 4 * c(0) - c(1);
  c(n - 1) = 6 * next_to_last - 4 * c(n - 2) - c(n - 3);
  c(n) = 6 * last - 4 * c(n - 1) - c(n - 2);
}

// The four B-splines that are not zero at parameter u (in spacings), with first and second derivatives with respect to
// u.
struct Weights {
  int first;
  std::array<double, 4> value, slope, curvature;
};

inline Weights weights_inside(double u, int n) {
  Weights w;
  w.first = std::clamp(static_cast<int>(std::floor(u)), 0, n - 2);
  const double t = u - w.first, s = 1 - t;
  w.value = {s * s * s / 6, (4 - 6 * t * t + 3 * t * t * t) / 6, (4 - 6 * s * s + 3 * s * s * s) / 6, t * t * t / 6};
  w.slope = {-s * s / 2, (3 * t * t - 4 * t) / 2, (4 * s - 3 * s * s) / 2, t * t / 2};
  w.curvature = {s, 3 * t - 2, 3 * s - 2, t};
  return w;
}

// Outside, at a signed distance d from the border, the value is value + d slope + log cosh(d) curvature, which is C2
// there.
inline Weights weights(double u, int n) {
  const double border = std::clamp(u, 0.0, n - 1.0);
  Weights w = weights_inside(border, n);
  const double d = u - border;
  if (d == 0) return w;
  const double log_cosh = std::abs(d) + std::log1p(std::exp(-2 * std::abs(d))) - std::log(2.0);
  const double tanh_d = std::tanh(d);
  for (std::size_t k = 0; k < 4; ++k) {
    w.value[k] += d * w.slope[k] + log_cosh * w.curvature[k];
    w.slope[k] += tanh_d * w.curvature[k];
    w.curvature[k] *= 1 - tanh_d * tanh_d;
  }
  return w;
}

double along_row(const double* row, const Weights& wx) {
  double v = 0;
  for (std::size_t a = 0; a < 4; ++a) v += wx.value[a] * row[static_cast<std::size_t>(wx.first) + a];
  return v;
}

// The splines at places one after the other, number by number.
struct Splines {
  std::vector<int> first;
  std::vector<double> values;

  template <class Place>
  Splines(int count, int n, const Place& place) : first(static_cast<std::size_t>(count)), values(4 * first.size()) {
    std::vector<double> u(first.size());
    for (int k = 0; k < count; ++k) u[static_cast<std::size_t>(k)] = place(k);
    spline_weights(u.data(), count, n, first.data(), values.data());
    for (std::size_t k = 0; k < u.size(); ++k) {
      if (u[k] >= 0 && u[k] <= n - 1.0) continue;
      const Weights w = weights(u[k], n);
      first[k] = w.first;
      for (std::size_t a = 0; a < 4; ++a) values[a * u.size() + k] = w.value[a];
    }
  }
  const double* value(int a) const { return values.data() + static_cast<std::size_t>(a) * first.size(); }

  void along_row(const double* row, double* out) const {
    const double *v0 = value(0), *v1 = value(1), *v2 = value(2), *v3 = value(3);
    for (std::size_t k = 0; k < first.size(); ++k) {
      const double* c = row + first[k];
      double v = 0;
      v += v0[k] * c[0], v += v1[k] * c[1], v += v2[k] * c[2], v += v3[k] * c[3];
      out[k] = v;
    }
  }
};

}  // namespace

Reference::Reference(Grid<double> given) : heights_(std::move(given)) {
  const Grid<double>& heights = heights_;
  require(heights.nx >= 4 && heights.ny >= 4, "heights_mm", "a grid of at least 4 by 4 heights",
          std::to_string(heights.ny) + " by " + std::to_string(heights.nx));
  require(heights.size() == static_cast<std::size_t>(heights.nx) * heights.ny, "heights_mm", "nx * ny values", heights.size());
  require(std::isfinite(heights.spacing) && heights.spacing > 0, "spacing_mm", "a positive length in mm", heights.spacing);
  require(heights.origin.allFinite(), "origin_mm", "two finite coordinates in mm", heights.origin.transpose());
  const auto missing = std::find_if_not(heights.values.begin(), heights.values.end(), [](double h) { return std::isfinite(h); });
  if (missing != heights.values.end()) {
    const long at = missing - heights.values.begin();
    require(false, "heights_mm", "finite heights everywhere (fill drop-outs first)",
            std::to_string(*missing) + " at row " + std::to_string(at / heights.nx) + ", column " + std::to_string(at % heights.nx));
  }

  // First along the rows, some at a time, transposed into columns; then along the columns.
  constexpr int kRows = 8;
  const int nx = heights_.nx, ny = heights_.ny, wide = nx + 2;
  coefficients_.resize(static_cast<std::size_t>(ny + 2) * wide);
  std::vector<double> turned(static_cast<std::size_t>(wide) * kRows, 0.0);
  for (int j = 0; j < ny; j += kRows) {
    const int count = std::min(kRows, ny - j);
    const double* given_rows = &heights_.at(0, j);
    if (std::all_of(given_rows, given_rows + static_cast<long>(count) * nx, [](double h) { return h == 0; })) continue;
    for (int i = 0; i < nx; ++i)
      for (int r = 0; r < count; ++r) turned[static_cast<std::size_t>(i + 1) * kRows + r] = given_rows[static_cast<long>(r) * nx + i];
    spline_columns<kRows>(turned.data(), kRows, kRows, nx);
    for (int r = 0; r < count; ++r)
      for (int i = 0; i < wide; ++i)
        coefficients_[static_cast<std::size_t>(j + r + 1) * wide + i] = turned[static_cast<std::size_t>(i) * kRows + r];
  }
  constexpr int kColumns = 64;  // number at a time, so that they stay in the cache
  for (int i = 0; i < wide; i += kColumns) spline_columns(coefficients_.data() + i, std::min(kColumns, wide - i), wide, ny);
}

SurfaceSample Reference::sample_at(const Eigen::Vector2d& u) const {
  const Weights wx = weights(u.x(), heights_.nx), wy = weights(u.y(), heights_.ny);
  const int wide = heights_.nx + 2;
  double f = 0, fx = 0, fy = 0, fxx = 0, fxy = 0, fyy = 0;
  for (std::size_t b = 0; b < 4; ++b) {
    const double* row = &coefficients_[(static_cast<std::size_t>(wy.first) + b) * wide + wx.first];
    double v = 0, s = 0, k = 0;
    for (std::size_t a = 0; a < 4; ++a) {
      v += wx.value[a] * row[a];
      s += wx.slope[a] * row[a];
      k += wx.curvature[a] * row[a];
    }
    f += wy.value[b] * v;
    fx += wy.value[b] * s;
    fxx += wy.value[b] * k;
    fy += wy.slope[b] * v;
    fxy += wy.slope[b] * s;
    fyy += wy.curvature[b] * v;
  }
  const double step = heights_.spacing;
  SurfaceSample out;
  out.height = f;
  out.gradient = Eigen::Vector2d(fx, fy) / step;
  out.hessian << fxx, fxy, fxy, fyy;
  out.hessian /= step * step;
  return out;
}

double Reference::height(const Eigen::Vector2d& xy) const {
  const Eigen::Vector2d u = heights_.locate(xy);
  const Weights wx = weights(u.x(), heights_.nx), wy = weights(u.y(), heights_.ny);
  double f = 0;
  for (std::size_t b = 0; b < 4; ++b)
    f +=
        wy.value[b] * along_row(&coefficients_[(static_cast<std::size_t>(wy.first) + b) * (static_cast<std::size_t>(heights_.nx) + 2)], wx);
  return f;
}

// A row of the grid needs four rows of coefficients, and rows next to each other mostly the same four: their sums along
// x are kept, each at its number modulo four.
void Reference::heights_on(Grid<double>& grid, int threads) const {
  const Splines x(grid.nx, heights_.nx, [&](int i) { return heights_.locate(grid.position(i, 0)).x(); });
  const Splines y(grid.ny, heights_.ny, [&](int j) { return heights_.locate(grid.position(0, j)).y(); });
  parallel_for(grid.ny, 64, threads, [&](long begin, long end) {
    std::array<std::vector<double>, 4> sums;
    std::array<int, 4> row_of{-1, -1, -1, -1};
    for (int j = static_cast<int>(begin); j < end; ++j) {
      std::array<const double*, 4> rows;
      std::array<double, 4> weights;
      for (int b = 0; b < 4; ++b) {
        const int number = y.first[static_cast<std::size_t>(j)] + b;
        std::vector<double>& sum = sums[static_cast<std::size_t>(number % 4)];
        if (std::exchange(row_of[static_cast<std::size_t>(number % 4)], number) != number) {
          sum.resize(x.first.size());
          x.along_row(&coefficients_[static_cast<std::size_t>(number) * (static_cast<std::size_t>(heights_.nx) + 2)], sum.data());
        }
        rows[static_cast<std::size_t>(b)] = sum.data(), weights[static_cast<std::size_t>(b)] = y.value(b)[j];
      }
      weighted_rows(rows.data(), weights.data(), grid.nx, &grid.at(0, j));
    }
  });
}

// The four rows of coefficients are summed once for the whole row.
std::vector<Eigen::Vector2d> Reference::gradients_on_row(const std::vector<double>& x, double y) const {
  std::vector<Eigen::Vector2d> out(x.size());
  if (x.empty()) return out;
  const Weights wy = weights(heights_.locate({0, y}).y(), heights_.ny);
  const int first = weights(heights_.locate({x.front(), y}).x(), heights_.nx).first;
  const int last = weights(heights_.locate({x.back(), y}).x(), heights_.nx).first + 3, wide = heights_.nx + 2;
  Eigen::ArrayXd value = Eigen::ArrayXd::Zero(last - first + 1), slope = value;
  for (std::size_t b = 0; b < 4; ++b) {
    const std::size_t at = (static_cast<std::size_t>(wy.first) + b) * static_cast<std::size_t>(wide) + static_cast<std::size_t>(first);
    const Eigen::Map<const Eigen::ArrayXd> row(&coefficients_[at], value.size());
    value += wy.value[b] * row;
    slope += wy.slope[b] * row;
  }
  std::vector<double> u(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) u[k] = heights_.locate({x[k], y}).x();
  if (u.front() >= 0 && u.back() <= heights_.nx - 1) {
    std::vector<double> fx(x.size()), fy(x.size());
    spline_row(u.data(), static_cast<int>(u.size()), heights_.nx, first, value.data(), slope.data(), fx.data(), fy.data());
    for (std::size_t k = 0; k < x.size(); ++k) out[k] = Eigen::Vector2d(fx[k], fy[k]) / heights_.spacing;
    return out;
  }
  for (std::size_t k = 0; k < x.size(); ++k) {
    const Weights wx = weights(u[k], heights_.nx);
    double fx = 0, fy = 0;
    for (std::size_t a = 0; a < 4; ++a) {
      fx += wx.slope[a] * value[wx.first - first + static_cast<int>(a)];
      fy += wx.value[a] * slope[wx.first - first + static_cast<int>(a)];
    }
    out[k] = Eigen::Vector2d(fx, fy) / heights_.spacing;
  }
  return out;
}

bool Reference::inside(const Eigen::Vector2d& xy) const {
  const Eigen::Vector2d u = heights_.locate(xy);
  return u.x() >= 0 && u.y() >= 0 && u.x() <= heights_.nx - 1 && u.y() <= heights_.ny - 1;
}

}  // namespace debulk
