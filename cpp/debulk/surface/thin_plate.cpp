#include "debulk/surface/thin_plate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include "debulk/core/point_index.hpp"

namespace debulk {
namespace {

// One difference of heights: its nodes (as offsets), their factors, and the weight of its square.
struct Difference {
  int points;
  std::array<int, 4> di, dj;
  std::array<double, 4> factor;
  double weight;
};

constexpr std::array<Difference, 3> kBending{{
    {3, {0, 1, 2, 0}, {0, 0, 0, 0}, {1, -2, 1, 0}, 1.0},
    {3, {0, 0, 0, 0}, {0, 1, 2, 0}, {1, -2, 1, 0}, 1.0},
    {4, {0, 1, 0, 1}, {0, 0, 1, 1}, {1, -1, -1, 1}, 2.0},
}};
constexpr std::array<Difference, 2> kTilt{{
    {2, {0, 1, 0, 0}, {0, 0, 0, 0}, {-1, 1, 0, 0}, 1.0},
    {2, {0, 0, 0, 0}, {0, 1, 0, 0}, {-1, 1, 0, 0}, 1.0},
}};

// A smaller factor means that the known heights leave the plate free to move. (The energy's coefficients are of
// order 1.)
constexpr double kLeastFactor = 1e-12;

// Limit for one factorisation, which cannot be stopped. For so many heights in the shape of a disc it takes
// some 40 ms.
constexpr std::size_t kMostUnknown = 6'000;

// The normal equations of the plate: half the derivative of its energy.
template <class Number>
class PlateEquations {
 public:
  PlateEquations(const Grid<Number>& heights, const std::vector<std::size_t>& unknown)
      : heights_(heights), points_(unknown, heights.nx), right_(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(unknown.size()))) {}

  void add_all(double levelling) {
    std::vector<int> columns;  // of the differences that begin in row j and reach an unknown height
    for (int j = std::max(points_.first_row() - 2, 0); j <= points_.last_row(); ++j) {
      columns.clear();
      for (int row = j; row <= j + 2; ++row)
        for (std::size_t n = points_.begin(row); n < points_.end(row); ++n)
          for (int i = std::max(points_.column(n) - 2, 0); i <= points_.column(n); ++i) columns.push_back(i);
      std::sort(columns.begin(), columns.end());
      columns.erase(std::unique(columns.begin(), columns.end()), columns.end());
      for (const int i : columns) {
        for (const Difference& d : kBending) add(i, j, d, d.weight);
        if (levelling > 0)
          for (const Difference& d : kTilt) add(i, j, d, levelling * d.weight);
      }
    }
  }

  std::vector<double> solved() const {
    if (!anchored_) return {};
    Eigen::SparseMatrix<double> matrix(right_.size(), right_.size());
    matrix.setFromTriplets(entries_.begin(), entries_.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors(matrix);
    if (factors.info() != Eigen::Success || !(factors.vectorD().minCoeff() > kLeastFactor)) return {};
    const Eigen::VectorXd solution = factors.solve(right_);
    if (!solution.allFinite()) return {};
    return {solution.begin(), solution.end()};
  }

 private:
  void add(int i, int j, const Difference& d, double weight) {
    std::array<int, 4> numbers{};
    double known = 0;
    bool involved = false, anchored = false;
    for (std::size_t p = 0; p < static_cast<std::size_t>(d.points); ++p) {
      const int qi = i + d.di[p], qj = j + d.dj[p];
      if (!heights_.contains(qi, qj)) return;
      numbers[p] = static_cast<int>(points_.find(qi, qj));
      if (numbers[p] >= 0) {
        involved = true;
        continue;
      }
      const auto height = static_cast<double>(heights_.at(qi, qj));
      if (std::isnan(height)) return;
      known += d.factor[p] * height;
      anchored = true;
    }
    if (!involved) return;
    anchored_ |= anchored;
    for (std::size_t p = 0; p < static_cast<std::size_t>(d.points); ++p) {
      if (numbers[p] < 0) continue;
      right_[numbers[p]] -= weight * d.factor[p] * known;
      for (std::size_t q = 0; q < static_cast<std::size_t>(d.points); ++q)
        if (numbers[q] >= 0 && numbers[q] <= numbers[p]) entries_.emplace_back(numbers[p], numbers[q], weight * d.factor[p] * d.factor[q]);
    }
  }

  const Grid<Number>& heights_;
  PointIndex points_;                            // the unknown heights
  std::vector<Eigen::Triplet<double>> entries_;  // lower triangle
  Eigen::VectorXd right_;
  bool anchored_ = false;
};

// Solves the plate by one factorisation.
template <class Number>
std::vector<double> direct_plate(const Grid<Number>& heights, const std::vector<std::size_t>& unknown, double levelling) {
  if (unknown.empty()) return {};
  PlateEquations<Number> equations(heights, unknown);
  equations.add_all(levelling);
  return equations.solved();
}

// The stride of a coarser grid on which no more than kMostUnknown of the points lie.
int coarse_stride(const PointIndex& points, std::size_t count) {
  const int i0 = points.column(0), j0 = points.first_row();
  int stride = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(count) / kMostUnknown)));
  for (;; ++stride) {
    std::size_t on_grid = 0;
    for (int j = j0; j <= points.last_row(); j += stride)
      for (std::size_t n = points.begin(j); n < points.end(j); ++n) on_grid += (points.column(n) - i0) % stride == 0;
    if (on_grid <= kMostUnknown) return stride;
  }
}

// Solves the plate on every stride-th column and row, and interpolates bilinearly between them.
template <class Number>
std::vector<double> coarse_plate(const Grid<Number>& heights, const std::vector<std::size_t>& unknown, double levelling, const Stop& stop) {
  const PointIndex points(unknown, heights.nx);
  int left = heights.nx, right = 0;
  for (std::size_t n = 0; n < unknown.size(); ++n) left = std::min(left, points.column(n)), right = std::max(right, points.column(n));
  const int stride = coarse_stride(points, unknown.size());
  const auto floor_div = [](int a, int b) { return a >= 0 ? a / b : -((b - 1 - a) / b); };
  // There are two more nodes on each side, which determine the slopes.
  const int first_i = points.column(0) + (floor_div(left - points.column(0), stride) - 2) * stride,
            first_j = points.first_row() - 2 * stride;
  Grid<double> coarse((right - first_i) / stride + 4, (points.last_row() - first_j) / stride + 4, heights.origin, heights.spacing * stride);
  std::vector<std::size_t> wanted;
  for (int b = 0; b < coarse.ny; ++b) {
    if (stop.now()) throw Stopped("a hole's bridge was stopped");
    for (int a = 0; a < coarse.nx; ++a) {
      const int i = first_i + a * stride, j = first_j + b * stride;
      coarse.at(a, b) = heights.contains(i, j) ? static_cast<double>(heights.at(i, j)) : std::numeric_limits<double>::quiet_NaN();
      if (points.find(i, j) >= 0) wanted.push_back(coarse.index(a, b));
    }
  }
  const std::vector<double> solved = direct_plate(coarse, wanted, levelling);
  if (solved.empty() && !wanted.empty()) return {};
  for (std::size_t n = 0; n < wanted.size(); ++n) coarse.values[wanted[n]] = solved[n];
  std::vector<double> out(unknown.size());
  for (std::size_t n = 0; n < unknown.size(); ++n) {
    if (n % 65536 == 0 && stop.now()) throw Stopped("a hole's bridge was stopped");
    const int a = (points.column(n) - first_i) / stride, b = (points.row(n) - first_j) / stride;
    const double u = static_cast<double>((points.column(n) - first_i) % stride) / stride,
                 v = static_cast<double>((points.row(n) - first_j) % stride) / stride;
    double sum = 0, weights = 0;  // over the known nodes round the point: beside the ply there are none
    for (int q = 0; q <= 1; ++q)
      for (int p = 0; p <= 1; ++p) {
        const double weight = (p ? u : 1 - u) * (q ? v : 1 - v), height = coarse.at(a + p, b + q);
        if (weight > 0 && !std::isnan(height)) sum += weight * height, weights += weight;
      }
    out[n] = sum / weights;
  }
  return out;
}

}  // namespace

template <class Number>
std::vector<double> thin_plate(const Grid<Number>& heights, const std::vector<std::size_t>& unknown, double levelling, const Stop& stop) {
  if (stop.now()) throw Stopped("a hole's bridge was stopped");
  return unknown.size() <= kMostUnknown ? direct_plate(heights, unknown, levelling) : coarse_plate(heights, unknown, levelling, stop);
}

template std::vector<double> thin_plate(const Grid<float>&, const std::vector<std::size_t>&, double, const Stop&);
template std::vector<double> thin_plate(const Grid<double>&, const std::vector<std::size_t>&, double, const Stop&);

}  // namespace debulk
