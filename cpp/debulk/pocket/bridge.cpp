#include "debulk/pocket/bridge.hpp"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include <algorithm>
#include <cmath>

namespace debulk {
namespace {

struct Tap {
  int di, dj;
  double weight;
};

// A weak pull to level, for the directions in which a thin plate at the edge of the data is free to tilt.
constexpr double kLevelling = 1e-4;

}  // namespace

std::vector<float> bridge(const Grid<float>& heights, const std::vector<std::size_t>& region) {
  const auto unknown_number = [&](std::size_t index) -> int {  // -1: not of this region
    const auto at = std::lower_bound(region.begin(), region.end(), index);
    return at != region.end() && *at == index ? static_cast<int>(at - region.begin()) : -1;
  };

  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd right = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(region.size()));
  bool anchored = false;
  // Adds weight / 2 * (sum of taps * height)^2 to the energy, once: at the first of the stencil's unknown points.
  const auto add = [&](int i, int j, const std::vector<Tap>& taps, double weight, int owner) {
    int numbers[4];
    double known = 0;
    bool first = true;
    for (std::size_t k = 0; k < taps.size(); ++k) {
      const int qi = i + taps[k].di, qj = j + taps[k].dj;
      if (!heights.contains(qi, qj)) return;
      numbers[k] = unknown_number(heights.index(qi, qj));
      if (numbers[k] < 0) {
        const double h = heights.at(qi, qj);
        if (std::isnan(h)) return;
        known += taps[k].weight * h;
      } else if (first) {
        if (numbers[k] != owner) return;
        first = false;
      }
    }
    for (std::size_t a = 0; a < taps.size(); ++a) {
      if (numbers[a] < 0) {
        anchored = true;
        continue;
      }
      right[numbers[a]] -= weight * taps[a].weight * known;
      for (std::size_t b = 0; b < taps.size(); ++b)
        if (numbers[b] >= 0 && numbers[b] <= numbers[a])
          entries.emplace_back(numbers[a], numbers[b], weight * taps[a].weight * taps[b].weight);
    }
  };
  static const std::vector<Tap> xx = {{-1, 0, 1}, {0, 0, -2}, {1, 0, 1}}, yy = {{0, -1, 1}, {0, 0, -2}, {0, 1, 1}},
                                xy = {{0, 0, 1}, {1, 0, -1}, {0, 1, -1}, {1, 1, 1}}, x = {{0, 0, -1}, {1, 0, 1}},
                                y = {{0, 0, -1}, {0, 1, 1}};
  for (std::size_t n = 0; n < region.size(); ++n) {
    const int i = static_cast<int>(region[n] % heights.nx), j = static_cast<int>(region[n] / heights.nx), owner = static_cast<int>(n);
    for (int d = -1; d <= 1; ++d) add(i + d, j, xx, 1, owner), add(i, j + d, yy, 1, owner);
    for (int d = -1; d <= 0; ++d) {
      for (int e = -1; e <= 0; ++e) add(i + d, j + e, xy, 2, owner);
      add(i + d, j, x, kLevelling, owner);
      add(i, j + d, y, kLevelling, owner);
    }
  }
  if (!anchored) return {};

  Eigen::SparseMatrix<double> matrix(right.size(), right.size());
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors(matrix);
  if (factors.info() != Eigen::Success) return {};
  const Eigen::VectorXd solution = factors.solve(right);
  if (!solution.allFinite()) return {};
  std::vector<float> values(region.size());
  for (std::size_t n = 0; n < values.size(); ++n) values[n] = static_cast<float>(solution[static_cast<Eigen::Index>(n)]);
  return values;
}

}  // namespace debulk
