#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <pybind11/stl.h>

#include "bindings/convert.hpp"
#include "debulk/cloud/cloud_view.hpp"

namespace debulk {

// A cloud from Python. A C-contiguous float32 array is used without a copy.
using CloudArray = Array<float>;

inline std::vector<py::ssize_t> shape(const py::array& a) {
  return {a.shape(), a.shape() + a.ndim()};
}

// An (H, W, 3) array is an organised cloud, an (N, 3) array is not.
inline CloudView cloud_view(const CloudArray& a, const char* name) {
  const bool fits = (a.ndim() == 3 && a.shape(2) == 3) || (a.ndim() == 2 && a.shape(1) == 3);
  require(fits, name, "an (H, W, 3) or (N, 3) array of points", shape_of(a));
  require(a.size() / 3 <= std::numeric_limits<int>::max(), name, "at most 2^31 points", a.size() / 3);
  const bool organised = a.ndim() == 3;
  return {a.data(), static_cast<int>(organised ? a.shape(1) : a.shape(0)), organised ? static_cast<int>(a.shape(0)) : 1};
}

// The mask of an organised cloud, true where a pixel is not to be used.
inline const std::uint8_t* mask_of(const std::optional<Array<std::uint8_t>>& mask, const CloudView& cloud) {
  if (!mask) return nullptr;
  require(mask->ndim() == 2 && mask->shape(0) == cloud.height && mask->shape(1) == cloud.width, "mask", "a mask of the scan's shape",
          shape_of(*mask));
  return mask->data();
}

// Reads a rigid motion, x_mold = T x_scanner.
inline Eigen::Matrix4d pose_of(const Array<double>& a) {
  require(a.ndim() == 2 && a.shape(0) == 4 && a.shape(1) == 4, "mold_from_scanner", "a (4, 4) array", shape_of(a));
  return Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(a.data());
}

}  // namespace debulk
