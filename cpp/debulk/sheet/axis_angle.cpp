#include "debulk/sheet/axis_angle.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace debulk {

AxisAngle axis_angle(const Eigen::Vector3d& r, const Eigen::Vector3d& s, const Eigen::Vector3d& e, Order order) {
  using Vector9 = Eigen::Matrix<double, 9, 1>;
  using Matrix9 = Eigen::Matrix<double, 9, 9>;
  const double ee = e.squaredNorm(), length = std::sqrt(ee), rs = r.dot(s), re = r.dot(e), se = s.dot(e);
  const double det = e.dot(r.cross(s)), sine = length * det, cosine = rs * ee - re * se;
  AxisAngle out;
  out.theta = std::atan2(sine, cosine);
  if (order == Order::value) return out;

  const double square = std::max(sine * sine + cosine * cosine, 1e-24 * r.squaredNorm() * s.squaredNorm() * ee * ee);
  Vector9 by_length, by_det, by_cosine;
  by_length << Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), e / length;
  by_det << s.cross(e), e.cross(r), r.cross(s);
  by_cosine << ee * s - se * e, ee * r - re * e, 2 * rs * e - se * r - re * s;
  const Vector9 by_sine = length * by_det + det * by_length;
  out.gradient = (cosine * by_sine - sine * by_cosine) / square;
  if (order == Order::gradient) return out;

  const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
  Matrix9 det_twice = Matrix9::Zero(), cosine_twice = Matrix9::Zero();
  det_twice.block<3, 3>(0, 3) = -cross_matrix(e);
  det_twice.block<3, 3>(0, 6) = cross_matrix(s);
  det_twice.block<3, 3>(3, 6) = -cross_matrix(r);
  cosine_twice.block<3, 3>(0, 3) = ee * one - e * e.transpose();
  cosine_twice.block<3, 3>(0, 6) = 2 * s * e.transpose() - e * s.transpose() - se * one;
  cosine_twice.block<3, 3>(3, 6) = 2 * r * e.transpose() - e * r.transpose() - re * one;
  for (Matrix9* m : {&det_twice, &cosine_twice}) *m += m->transpose().eval();
  cosine_twice.block<3, 3>(6, 6) = 2 * rs * one - r * s.transpose() - s * r.transpose();
  Matrix9 sine_twice = length * det_twice + by_det * by_length.transpose() + by_length * by_det.transpose();
  sine_twice.block<3, 3>(6, 6) += det / length * (one - e * e.transpose() / ee);

  // The angle of (C, S) in a plane: the derivatives of the angle and of the logarithm of the radius, crossed.
  const Vector9 by_radius = (sine * by_sine + cosine * by_cosine) / square;
  const Matrix9 crossed = out.gradient * by_radius.transpose();
  out.hessian = (cosine * sine_twice - sine * cosine_twice) / square - crossed - crossed.transpose();
  return out;
}

}  // namespace debulk
