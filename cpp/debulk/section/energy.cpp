#include "debulk/section/energy.hpp"

#include <cmath>

namespace debulk {
namespace {

// A corner of the polyline: the turn from segment d1 to segment d2, which is the difference of their headings, and its
// derivatives.
struct Corner {
  Eigen::Vector2d d1, d2;

  Corner(const Eigen::Matrix2Xd& x, long i) : d1(x.col(i) - x.col(i - 1)), d2(x.col(i + 1) - x.col(i)) {}

  double turn() const { return std::atan2(d1.x() * d2.y() - d1.y() * d2.x(), d1.dot(d2)); }
  // The derivatives of the turn by the nodes before, at and behind the corner.
  std::array<Eigen::Vector2d, 3> gradient() const {
    const Eigen::Vector2d q1 = heading_gradient(d1), q2 = heading_gradient(d2);
    return {q1, -q1 - q2, q2};
  }

  static Eigen::Vector2d heading_gradient(const Eigen::Vector2d& d) { return Eigen::Vector2d(-d.y(), d.x()) / d.squaredNorm(); }
  static Eigen::Matrix2d heading_hessian(const Eigen::Vector2d& d) {
    const double r4 = d.squaredNorm() * d.squaredNorm();
    const double twice = 2 * d.x() * d.y() / r4, mixed = (d.y() * d.y() - d.x() * d.x()) / r4;
    return (Eigen::Matrix2d() << twice, mixed, mixed, -twice).finished();
  }
};

}  // namespace

SectionEnergy::SectionEnergy(const Eigen::VectorXd& segment_lengths, double natural_length, Pressure kind, const Eigen::Vector2d& up)
    : node_lengths_(Eigen::VectorXd::Zero(segment_lengths.size() + 1)),
      natural_length_(natural_length),
      stiffness_(std::pow(natural_length, 3)),
      kind_(kind),
      up_(up) {
  node_lengths_.head(segment_lengths.size()) += segment_lengths / 2;
  node_lengths_.tail(segment_lengths.size()) += segment_lengths / 2;
}

double SectionEnergy::value(const Eigen::Matrix2Xd& x) const {
  const long last = x.cols() - 1;
  double bending = 0, load = 0;
  for (long i = 1; i < last; ++i) {
    const double turn = Corner(x, i).turn();
    bending += stiffness_ * turn * turn / (2 * node_lengths_[i]);
  }
  if (kind_ == Pressure::following)
    for (long i = 0; i < last; ++i) load += (x(0, i + 1) - x(0, i)) * (x(1, i) + x(1, i + 1)) / 2;
  else
    for (long i = 0; i <= last; ++i) load += node_lengths_[i] * up_.dot(x.col(i));
  return bending + share_ * load;
}

void SectionEnergy::gradient(const Eigen::Matrix2Xd& x, Eigen::Matrix2Xd& out) const {
  const long last = x.cols() - 1;
  out.setZero(2, x.cols());
  for (long i = 1; i < last; ++i) {
    const Corner corner(x, i);
    const double moment = stiffness_ * corner.turn() / node_lengths_[i];
    const auto by = corner.gradient();
    for (int k = 0; k < 3; ++k) out.col(i - 1 + k) += moment * by[k];
  }
  if (kind_ == Pressure::following)
    for (long i = 0; i < last; ++i) {
      const double width = share_ * (x(0, i + 1) - x(0, i)) / 2, mean = share_ * (x(1, i) + x(1, i + 1)) / 2;
      out.col(i) += Eigen::Vector2d(-mean, width);
      out.col(i + 1) += Eigen::Vector2d(mean, width);
    }
  else
    for (long i = 0; i <= last; ++i) out.col(i) += share_ * node_lengths_[i] * up_;
}

void SectionEnergy::add_hessian(const Eigen::Matrix2Xd& x, double weight, SectionBlocks& out) const {
  const long last = x.cols() - 1;
  for (long i = 1; i < last; ++i) {
    const Corner corner(x, i);
    const double stiffness = weight * stiffness_ / node_lengths_[i], moment = stiffness * corner.turn();
    const auto by = corner.gradient();
    for (int a = 0; a < 3; ++a)
      for (int b = a; b < 3; ++b) out[i - 1 + a][b - a] += stiffness * by[a] * by[b].transpose();
    const Eigen::Matrix2d h1 = moment * Corner::heading_hessian(corner.d1), h2 = moment * Corner::heading_hessian(corner.d2);
    out[i - 1][0] -= h1;
    out[i - 1][1] += h1;
    out[i][0] += h2 - h1;
    out[i][1] -= h2;
    out[i + 1][0] += h2;
  }
  if (kind_ == Pressure::following) {
    const double half = weight * share_ / 2;
    Eigen::Matrix2d cross;  // of (x_j - x_i)(z_i + z_j) / 2 by node i, then j = i + 1; within a node +-x z / 2
    cross << 0, -half, half, 0;
    Eigen::Matrix2d own;
    own << 0, half, half, 0;
    for (long i = 0; i < last; ++i) {
      out[i][0] -= own;
      out[i][1] += cross;
      out[i + 1][0] += own;
    }
  }
}

}  // namespace debulk
