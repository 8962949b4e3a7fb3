#include "debulk/surface/gridding_unorganised.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Cholesky>

#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

// Points sorted into square cells as wide as the fit's radius. Within a cell they are in the order of the cloud.
struct Cells {
  Eigen::Vector2d low;
  double side;
  int columns, rows;
  std::vector<std::uint32_t> starts;
  std::vector<std::array<float, 3>> points;

  Cells(const CloudView& cloud, const Grid<float>& grid, double radius, const Stop& stop)
      : low(grid.position(0, 0).array() - radius), side(radius) {
    const Eigen::Vector2d extent = grid.position(grid.nx - 1, grid.ny - 1) - low;
    columns = static_cast<int>(extent.x() / side) + 2;
    rows = static_cast<int>(extent.y() / side) + 2;
    starts.assign(static_cast<std::size_t>(columns) * rows + 1, 0);
    const auto each = [&](const auto& body) {
      for (std::size_t i = 0; i < cloud.size(); ++i) {
        if (i % 65536 == 0 && stop.now()) throw Stopped("the height map was stopped");
        if (!cloud.seen(i)) continue;
        const double u = std::floor((cloud.point(i)[0] - low.x()) / side), v = std::floor((cloud.point(i)[1] - low.y()) / side);
        if (u >= 0 && v >= 0 && u < columns && v < rows) body(static_cast<std::size_t>(v) * columns + static_cast<std::size_t>(u), i);
      }
    };
    each([&](std::size_t cell, std::size_t) { ++starts[cell + 1]; });
    for (std::size_t c = 1; c < starts.size(); ++c) starts[c] += starts[c - 1];
    points.resize(starts.back());
    std::vector<std::uint32_t> next(starts.begin(), starts.end() - 1);
    each([&](std::size_t cell, std::size_t i) { std::copy_n(cloud.point(i), 3, points[next[cell]++].begin()); });
  }
};

// Height at the origin of the plane fitted to weighted points; NaN if it would be noisier than one point.
class PlaneFit {
 public:
  void add(double x, double y, double z, double weight) {
    const Eigen::Vector3d row(1, x, y);
    normal_ += weight * row * row.transpose();
    spread_ += weight * weight * row * row.transpose();
    right_ += weight * z * row;
    ++count_;
  }
  double height() const {
    constexpr double missing = std::numeric_limits<double>::quiet_NaN();
    if (count_ < 3) return missing;
    const Eigen::LDLT<Eigen::Matrix3d> factors(normal_);
    if (factors.info() != Eigen::Success || factors.vectorD().minCoeff() <= 1e-9 * factors.vectorD().maxCoeff()) return missing;
    const Eigen::Vector3d influence = factors.solve(Eigen::Vector3d::UnitX().eval());
    const double variance = influence.dot(spread_ * influence);
    return variance <= 1 ? influence.dot(right_) : missing;
  }

 private:
  Eigen::Matrix3d normal_ = Eigen::Matrix3d::Zero(), spread_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right_ = Eigen::Vector3d::Zero();
  int count_ = 0;
};

}  // namespace

double grid_unorganised(const CloudView& cloud, Grid<float>& grid, double pitch, int threads, const Stop& stop) {
  const double radius = std::max(grid.spacing, 2 * pitch);
  const Cells cells(cloud, grid, radius, stop);
  parallel_for(grid.ny, 8, threads, stop, [&](long begin, long end) {
    std::size_t visited = 0, next_check = 0;  // a cloud in a wrong unit has all of its points in one cell
    for (int j = static_cast<int>(begin); j < end; ++j)
      for (int i = 0; i < grid.nx; ++i) {
        if (visited >= next_check) {
          if (stop.now()) throw Stopped("the height map was stopped");
          next_check = visited + 65536;
        }
        const Eigen::Vector2d at = grid.position(i, j);
        const int column = static_cast<int>((at.x() - cells.low.x()) / radius), row = static_cast<int>((at.y() - cells.low.y()) / radius);
        PlaneFit fit;
        for (int r = std::max(0, row - 1); r <= std::min(cells.rows - 1, row + 1); ++r) {
          const std::size_t line = static_cast<std::size_t>(r) * cells.columns;
          const std::uint32_t from = cells.starts[line + std::max(0, column - 1)];
          const std::uint32_t to = cells.starts[line + std::min(cells.columns - 1, column + 1) + 1];
          visited += to - from;
          for (std::uint32_t k = from; k < to; ++k) {
            const std::array<float, 3>& p = cells.points[k];
            const double x = (p[0] - at.x()) / radius, y = (p[1] - at.y()) / radius, closeness = 1 - x * x - y * y;
            if (closeness > 0) fit.add(x, y, p[2], closeness * closeness);
          }
        }
        grid.at(i, j) = static_cast<float>(fit.height());
      }
  });
  return radius * radius / 8;  // the mean of x² over the disc with the weights (1 - d²/r²)²
}

}  // namespace debulk
