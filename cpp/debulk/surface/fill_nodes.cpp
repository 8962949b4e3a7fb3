#include "debulk/surface/fill_nodes.hpp"

#include <array>
#include <cmath>
#include <vector>

#include <Eigen/SparseCholesky>

#include "debulk/core/error.hpp"

namespace debulk {
namespace {

// One second difference: nodes (as offsets) and their factors.
struct Difference {
  int points;
  std::array<int, 4> di, dj;
  std::array<double, 4> factor;
  double weight;
};

constexpr std::array<Difference, 3> differences{{
    {3, {0, 1, 2, 0}, {0, 0, 0, 0}, {1, -2, 1, 0}, 1.0},
    {3, {0, 0, 0, 0}, {0, 1, 2, 0}, {1, -2, 1, 0}, 1.0},
    {4, {0, 1, 0, 1}, {0, 0, 1, 1}, {1, -1, -1, 1}, 2.0},
}};

}  // namespace

Grid<double> fill_nodes(Grid<double> heights) {
  std::vector<int> unknown(heights.size(), -1);
  int count = 0;
  for (std::size_t k = 0; k < heights.size(); ++k)
    if (std::isnan(heights.values[k])) unknown[k] = count++;
  if (count == 0) return heights;
  const std::size_t known = heights.size() - static_cast<std::size_t>(count);
  require(known >= 3, "heights", "heights measured on enough of the grid to fit a surface", std::to_string(known) + " fitted nodes");

  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd right = Eigen::VectorXd::Zero(count);
  for (int j = 0; j < heights.ny; ++j)
    for (int i = 0; i < heights.nx; ++i)
      for (const Difference& d : differences) {
        std::array<std::size_t, 4> at{};
        bool inside = true, involved = false;
        for (std::size_t p = 0; p < static_cast<std::size_t>(d.points) && inside; ++p) {
          inside = heights.contains(i + d.di[p], j + d.dj[p]);
          if (!inside) break;
          at[p] = heights.index(i + d.di[p], j + d.dj[p]);
          involved |= unknown[at[p]] >= 0;
        }
        if (!inside || !involved) continue;
        double fixed = 0;
        for (std::size_t p = 0; p < static_cast<std::size_t>(d.points); ++p)
          if (unknown[at[p]] < 0) fixed += d.factor[p] * heights.values[at[p]];
        for (std::size_t p = 0; p < static_cast<std::size_t>(d.points); ++p) {
          if (unknown[at[p]] < 0) continue;
          right[unknown[at[p]]] -= d.weight * d.factor[p] * fixed;
          for (std::size_t q = 0; q < static_cast<std::size_t>(d.points); ++q)
            if (unknown[at[q]] >= 0) entries.emplace_back(unknown[at[p]], unknown[at[q]], d.weight * d.factor[p] * d.factor[q]);
        }
      }
  Eigen::SparseMatrix<double> plate(count, count);
  plate.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors(plate);
  const bool determined = factors.info() == Eigen::Success && factors.vectorD().minCoeff() > 1e-12;
  require(determined, "heights", "heights measured on enough of the grid to fit a surface", "too few, or all in a line");
  const Eigen::VectorXd filled = factors.solve(right);
  for (std::size_t k = 0; k < heights.size(); ++k)
    if (unknown[k] >= 0) heights.values[k] = filled[unknown[k]];
  return heights;
}

}  // namespace debulk
