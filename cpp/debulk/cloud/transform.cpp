#include "debulk/cloud/transform.hpp"

#include <cmath>
#include <limits>

#include <Eigen/LU>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

void check_rigid(const Eigen::Matrix4d& matrix) {
  require(matrix.allFinite(), "matrix", "16 finite numbers", "a NaN or an infinity");
  const Eigen::RowVector4d bottom = matrix.row(3);
  require((bottom - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() <= 1e-9, "matrix",
          "a rigid motion with the bottom row 0 0 0 1 (is it transposed?)", bottom);
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const double error = (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  require(error <= 1e-4, "matrix", "a rigid motion, whose 3 by 3 part R is orthonormal (no scale, no shear)",
          "R'R off the identity by " + std::to_string(error));
  const double determinant = rotation.determinant();
  require(determinant > 0, "matrix", "a rotation, determinant +1", "a mirror, determinant " + std::to_string(determinant));
}

// Moves the points for which stays(k) holds from one place to another, which may be the same. All others become
// missing.
template <class Stays>
void move(const float* from, float* to, std::size_t count, const Eigen::Matrix4d& matrix, int threads, const Stop& stop,
          const Stays& stays) {
  check_rigid(matrix);
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const Eigen::Vector3d shift = matrix.topRightCorner<3, 1>();
  parallel_for(static_cast<long>(count), 1 << 16, threads, stop, [&](long begin, long end) {
    for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k) {
      const Eigen::Vector3f point = Eigen::Map<const Eigen::Vector3f>(from + 3 * k);
      Eigen::Map<Eigen::Vector3f> moved(to + 3 * k);
      if (stays(k) && std::isfinite(point.sum()))
        moved = (rotation * point.cast<double>() + shift).cast<float>();
      else
        moved.setConstant(std::numeric_limits<float>::quiet_NaN());
    }
  });
}

}  // namespace

std::vector<float> transform(const CloudView& cloud, const Eigen::Matrix4d& matrix, int threads, const Stop& stop) {
  std::vector<float> out(3 * cloud.size());
  move(cloud.xyz, out.data(), cloud.size(), matrix, threads, stop, [](std::size_t) { return true; });
  return out;
}

void move_kept(const float* from, float* to, const std::uint8_t* keep, std::size_t count, const Eigen::Matrix4d& matrix, int threads,
               const Stop& stop) {
  move(from, to, count, matrix, threads, stop, [keep](std::size_t k) { return keep[k] != 0; });
}

}  // namespace debulk
