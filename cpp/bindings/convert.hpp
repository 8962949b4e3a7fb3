#pragma once

#include <pybind11/numpy.h>

#include <cstring>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "debulk/core/error.hpp"
#include "debulk/core/grid.hpp"

// Conversions between NumPy arrays and the core's types. Shapes are checked here, once, with the argument's name in the
// message.
namespace debulk {

namespace py = pybind11;

template <class T>
using Array = py::array_t<T, py::array::c_style | py::array::forcecast>;

inline std::string shape_of(const py::array& a) {
  std::string text = "(";
  for (py::ssize_t d = 0; d < a.ndim(); ++d) text += (d ? ", " : "") + std::to_string(a.shape(d));
  return "shape " + text + (a.ndim() == 1 ? ",)" : ")");
}

// Returns the rows of an (N, K) array as fixed-size Eigen vectors, as in points<3>(nodes, "nodes_mm").
template <int K>
std::vector<Eigen::Matrix<double, K, 1>> points(const Array<double>& a, const char* name) {
  const std::string expected = "an (N, " + std::to_string(K) + ") array";
  require(a.ndim() == 2 && a.shape(1) == K, name, expected.c_str(), shape_of(a));
  std::vector<Eigen::Matrix<double, K, 1>> out(static_cast<std::size_t>(a.shape(0)));
  if (!out.empty()) std::memcpy(static_cast<void*>(out.data()), a.data(), out.size() * K * sizeof(double));
  return out;
}

template <int K>
py::array_t<double> to_array(const std::vector<Eigen::Matrix<double, K, 1>>& rows) {
  py::array_t<double> out({static_cast<py::ssize_t>(rows.size()), static_cast<py::ssize_t>(K)});
  if (!rows.empty()) std::memcpy(out.mutable_data(), rows.data(), rows.size() * K * sizeof(double));
  return out;
}

// Takes over the vector's memory without a copy.
template <class T>
py::array_t<T> to_array(std::vector<T>&& values, std::vector<py::ssize_t> shape) {
  auto owned = std::make_unique<std::vector<T>>(std::move(values));
  T* data = owned->data();
  py::capsule owner(owned.release(), [](void* p) { delete static_cast<std::vector<T>*>(p); });
  return py::array_t<T>(std::move(shape), data, owner);
}

template <class T>
Grid<T> to_grid(const Array<T>& values, const Eigen::Vector2d& origin, double spacing, const char* name) {
  require(values.ndim() == 2, name, "an (ny, nx) array", shape_of(values));
  Grid<T> grid;
  grid.nx = static_cast<int>(values.shape(1)), grid.ny = static_cast<int>(values.shape(0));
  grid.origin = origin, grid.spacing = spacing;
  grid.values.assign(values.data(), values.data() + values.size());
  return grid;
}

template <class T>
py::array_t<T> grid_values(Grid<T>&& grid) {
  return to_array(std::move(grid.values), {grid.ny, grid.nx});
}

}  // namespace debulk
