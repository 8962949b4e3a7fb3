#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace debulk {

// Values on a regular grid in the mold's XY plane, row-major: values[j * nx + i] belongs to the point
// origin + spacing * (i, j), in mm. A missing value of a floating-point grid is NaN.
template <class T>
struct Grid {
  int nx = 0;
  int ny = 0;
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  // mm
  double spacing = 1.0;                              // mm
  std::vector<T> values;

  Grid() = default;
  Grid(int columns, int rows, const Eigen::Vector2d& first, double step, T fill = T())
      : nx(columns), ny(rows), origin(first), spacing(step), values(static_cast<std::size_t>(columns) * rows, fill) {}

  // A grid of the same points with other values, all equal to `fill`.
  template <class U>
  Grid<U> like(U fill = U()) const {
    return Grid<U>(nx, ny, origin, spacing, fill);
  }

  // Takes over the points of another grid, in the memory that is there. The values mean nothing until they are set.
  template <class U>
  void reshape(const Grid<U>& other) {
    nx = other.nx, ny = other.ny, origin = other.origin, spacing = other.spacing;
    values.resize(other.size());
  }

  std::size_t size() const { return values.size(); }
  std::size_t index(int i, int j) const { return static_cast<std::size_t>(j) * nx + i; }
  bool contains(int i, int j) const { return i >= 0 && j >= 0 && i < nx && j < ny; }
  T& at(int i, int j) { return values[index(i, j)]; }
  const T& at(int i, int j) const { return values[index(i, j)]; }
  Eigen::Vector2d position(double i, double j) const { return origin + spacing * Eigen::Vector2d(i, j); }
  // Fractional column and row of a point.
  Eigen::Vector2d locate(const Eigen::Vector2d& xy) const { return (xy - origin) / spacing; }
};

}  // namespace debulk
