#include "debulk/cloud/transform.hpp"

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

}  // namespace

std::vector<float> transform(const CloudView& cloud, const Eigen::Matrix4d& matrix, int threads, const Stop& stop) {
  check_rigid(matrix);
  std::vector<float> out(3 * cloud.size());
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const Eigen::Vector3d shift = matrix.topRightCorner<3, 1>();
  parallel_for(static_cast<long>(cloud.size()), 1 << 16, threads, stop, [&](long begin, long end) {
    for (long i = begin; i < end; ++i) {
      const auto at = static_cast<std::size_t>(i);
      Eigen::Map<Eigen::Vector3f> to(&out[3 * at]);
      if (cloud.seen(at))
        to = (rotation * Eigen::Map<const Eigen::Vector3f>(cloud.point(at)).cast<double>() + shift).cast<float>();
      else
        to.setConstant(std::numeric_limits<float>::quiet_NaN());
    }
  });
  return out;
}

}  // namespace debulk
