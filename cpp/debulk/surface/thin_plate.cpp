#include "debulk/surface/thin_plate.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

namespace debulk {
namespace {

// One difference of heights: nodes (as offsets), their factors, and the weight of its square.
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

// A factor below this means that the known heights leave the plate free to move. (The energy's coefficients are of order 1.)
constexpr double kLeastFactor = 1e-12;

// The normal equations of the plate: half the derivative of its energy.
template <class Number>
class PlateEquations {
 public:
  PlateEquations(const Grid<Number>& heights, const std::vector<std::size_t>& unknown)
      : heights_(heights), right_(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(unknown.size()))) {
    i0_ = heights.nx, j0_ = heights.ny;
    for (const std::size_t index : unknown) {
      i0_ = std::min(i0_, column(index)), i1_ = std::max(i1_, column(index));
      j0_ = std::min(j0_, row(index)), j1_ = std::max(j1_, row(index));
    }
    number_.assign(static_cast<std::size_t>(i1_ - i0_ + 1) * static_cast<std::size_t>(j1_ - j0_ + 1), -1);
    for (std::size_t n = 0; n < unknown.size(); ++n) number_[place(column(unknown[n]), row(unknown[n]))] = static_cast<int>(n);
  }

  void add_all(double levelling) {
    for (int j = std::max(j0_ - 2, 0); j <= j1_; ++j)
      for (int i = std::max(i0_ - 2, 0); i <= i1_; ++i) {
        for (const Difference& d : kBending) add(i, j, d, d.weight);
        if (levelling > 0)
          for (const Difference& d : kTilt) add(i, j, d, levelling * d.weight);
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
  int column(std::size_t index) const { return static_cast<int>(index % static_cast<std::size_t>(heights_.nx)); }
  int row(std::size_t index) const { return static_cast<int>(index / static_cast<std::size_t>(heights_.nx)); }
  std::size_t place(int i, int j) const {
    return static_cast<std::size_t>(j - j0_) * static_cast<std::size_t>(i1_ - i0_ + 1) + static_cast<std::size_t>(i - i0_);
  }
  // Of the unknown at (i, j); -1: not one of them.
  int number(int i, int j) const { return i < i0_ || i > i1_ || j < j0_ || j > j1_ ? -1 : number_[place(i, j)]; }

  void add(int i, int j, const Difference& d, double weight) {
    std::array<int, 4> numbers{};
    double known = 0;
    bool involved = false, anchored = false;
    for (std::size_t p = 0; p < static_cast<std::size_t>(d.points); ++p) {
      const int qi = i + d.di[p], qj = j + d.dj[p];
      if (!heights_.contains(qi, qj)) return;
      numbers[p] = number(qi, qj);
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
  int i0_ = 0, i1_ = 0, j0_ = 0, j1_ = 0;  // the box about the unknown nodes, both ends in it
  std::vector<int> number_;
  std::vector<Eigen::Triplet<double>> entries_;  // lower triangle
  Eigen::VectorXd right_;
  bool anchored_ = false;
};

}  // namespace

template <class Number>
std::vector<double> thin_plate(const Grid<Number>& heights, const std::vector<std::size_t>& unknown, double levelling) {
  if (unknown.empty()) return {};
  PlateEquations<Number> equations(heights, unknown);
  equations.add_all(levelling);
  return equations.solved();
}

template std::vector<double> thin_plate(const Grid<float>&, const std::vector<std::size_t>&, double);
template std::vector<double> thin_plate(const Grid<double>&, const std::vector<std::size_t>&, double);

}  // namespace debulk
