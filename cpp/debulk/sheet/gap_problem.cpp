#include "debulk/sheet/gap_problem.hpp"

#include <limits>

namespace debulk {

GapProblem::GapProblem(const Sheet& sheet)
    : sheet_(sheet), length_(sheet.net().spacing), energy_(sheet.force_unit_n() * sheet.net().spacing), place_(sheet.start().size(), -1) {
  for (std::size_t k = 0; k < sheet.movable().size(); ++k) place_[static_cast<std::size_t>(sheet.movable()[k])] = static_cast<int>(k);
  for (const auto& [i, j] : sheet.segments())
    if (place_[static_cast<std::size_t>(i)] >= 0 || place_[static_cast<std::size_t>(j)] >= 0) constrained_.push_back({i, j});
}

Points GapProblem::to_points(const Eigen::VectorXd& y) const {
  Points x = sheet_.start();
  for (std::size_t k = 0; k < sheet_.movable().size(); ++k) {
    Eigen::Vector3d p = length_ * y.segment<3>(3 * static_cast<long>(k));
    p.z() += sheet_.mold().height(p.head<2>());
    x[static_cast<std::size_t>(sheet_.movable()[k])] = p;
  }
  return x;
}

Eigen::VectorXd GapProblem::from_points(const Points& x) const {
  Eigen::VectorXd y(variables());
  for (std::size_t k = 0; k < sheet_.movable().size(); ++k) {
    Eigen::Vector3d p = x[static_cast<std::size_t>(sheet_.movable()[k])];
    p.z() -= sheet_.mold().height(p.head<2>());
    y.segment<3>(3 * static_cast<long>(k)) = p / length_;
  }
  return y;
}

Eigen::VectorXd GapProblem::lower() const {
  Eigen::VectorXd out = Eigen::VectorXd::Constant(variables(), -std::numeric_limits<double>::infinity());
  for (long k = 2; k < out.size(); k += 3) out[k] = 0;
  return out;
}

double GapProblem::value(const Eigen::VectorXd& y) const {
  return sheet_.energy(to_points(y)) / energy_;
}

Eigen::Matrix3d GapProblem::tangent(const SurfaceSample& mold) {
  Eigen::Matrix3d t = Eigen::Matrix3d::Identity();
  t.block<1, 2>(2, 0) = mold.gradient.transpose();
  return t;
}

std::vector<SurfaceSample> GapProblem::mold_below(const Eigen::VectorXd& y) const {
  std::vector<SurfaceSample> out;
  out.reserve(sheet_.movable().size());
  for (long k = 0; k < y.size(); k += 3) out.push_back(sheet_.mold().sample(length_ * y.segment<2>(k)));
  return out;
}

void GapProblem::gradient(const Eigen::VectorXd& y, Eigen::Ref<Eigen::VectorXd> out) const {
  const Points g = sheet_.gradient(to_points(y));
  const std::vector<SurfaceSample> mold = mold_below(y);
  for (std::size_t k = 0; k < mold.size(); ++k)
    out.segment<3>(3 * static_cast<long>(k)) =
        (length_ / energy_) * tangent(mold[k]).transpose() * g[static_cast<std::size_t>(sheet_.movable()[k])];
}

void GapProblem::constraints(const Eigen::VectorXd& y, Eigen::Ref<Eigen::VectorXd> out) const {
  const Points x = to_points(y);
  for (std::size_t k = 0; k < constrained_.size(); ++k) {
    const auto [i, j] = constrained_[k];
    const Eigen::Vector3d d = x[static_cast<std::size_t>(i)] - x[static_cast<std::size_t>(j)];
    out[static_cast<long>(k)] = (d.squaredNorm() / (length_ * length_) - 1) / 2;
  }
}

std::vector<Problem::Entry> GapProblem::jacobian_pattern() const {
  std::vector<Entry> pattern;
  for (std::size_t k = 0; k < constrained_.size(); ++k)
    for (const int node : constrained_[k])
      if (const int place = place_[static_cast<std::size_t>(node)]; place >= 0)
        for (int a = 0; a < 3; ++a) pattern.push_back({static_cast<int>(k), 3 * place + a});
  return pattern;
}

void GapProblem::jacobian(const Eigen::VectorXd& y, Eigen::Ref<Eigen::VectorXd> values) const {
  const Points x = to_points(y);
  const std::vector<SurfaceSample> mold = mold_below(y);
  long next = 0;
  for (const auto& [i, j] : constrained_) {
    const Eigen::Vector3d d = (x[static_cast<std::size_t>(i)] - x[static_cast<std::size_t>(j)]) / length_;
    for (const auto& [node, sign] : {std::pair{i, 1.0}, std::pair{j, -1.0}})
      if (const int place = place_[static_cast<std::size_t>(node)]; place >= 0) {
        values.segment<3>(next) = sign * tangent(mold[static_cast<std::size_t>(place)]).transpose() * d;
        next += 3;
      }
  }
}

std::vector<Problem::Entry> GapProblem::hessian_pattern() const {
  std::vector<Entry> pattern;
  const BlockMatrix& blocks = sheet_.hessian_pattern();
  for (int slot = 0; slot < blocks.blocks(); ++slot) {
    const int i = place_[static_cast<std::size_t>(blocks.row(slot))], j = place_[static_cast<std::size_t>(blocks.column(slot))];
    if (i < 0 || j < 0) continue;
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < (i == j ? a + 1 : 3); ++b) pattern.push_back({3 * i + a, 3 * j + b});
  }
  return pattern;
}

// With x = x(y): Hessian by y = T^T H T + (sum of g_z) F'' on a node's x, y, all by the chain rule.
void GapProblem::hessian(const Eigen::VectorXd& y, double weight_of_f, const Eigen::VectorXd& lambda,
                         Eigen::Ref<Eigen::VectorXd> values) const {
  const Points x = to_points(y);
  const std::vector<SurfaceSample> mold = mold_below(y);
  BlockMatrix blocks = sheet_.hessian_pattern();
  blocks.set_zero();
  Points g(x.size(), Eigen::Vector3d::Zero());
  if (weight_of_f != 0) {
    sheet_.add_hessian(x, blocks);
    g = sheet_.gradient(x);
  }
  // Both parts in the units of the scaled problem, before the chain rule: d/dy = Delta T d/dx.
  const double weight = weight_of_f * length_ * length_ / energy_;
  std::vector<double> slope_z(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) slope_z[i] = weight_of_f * length_ / energy_ * g[i].z();
  BlockMatrix lengths = sheet_.hessian_pattern();
  lengths.set_zero();
  for (std::size_t k = 0; k < constrained_.size(); ++k) {
    const auto [i, j] = constrained_[k];
    const double l = lambda[static_cast<long>(k)];
    const Eigen::Matrix3d block = l * Eigen::Matrix3d::Identity();
    lengths.add(lengths.slot(i, i), i, i, block);
    lengths.add(lengths.slot(j, j), j, j, block);
    lengths.add(lengths.slot(i, j), i, j, -block);
    const double dz = l * (x[static_cast<std::size_t>(i)].z() - x[static_cast<std::size_t>(j)].z()) / length_;
    slope_z[static_cast<std::size_t>(i)] += dz;
    slope_z[static_cast<std::size_t>(j)] -= dz;
  }

  long next = 0;
  for (int slot = 0; slot < blocks.blocks(); ++slot) {
    const int node = blocks.row(slot);
    const int i = place_[static_cast<std::size_t>(node)], j = place_[static_cast<std::size_t>(blocks.column(slot))];
    if (i < 0 || j < 0) continue;
    const SurfaceSample &at_i = mold[static_cast<std::size_t>(i)], &at_j = mold[static_cast<std::size_t>(j)];
    Eigen::Matrix3d block = tangent(at_i).transpose() * (weight * blocks.block(slot) + lengths.block(slot)) * tangent(at_j);
    if (i == j) block.topLeftCorner<2, 2>() += slope_z[static_cast<std::size_t>(node)] * length_ * at_i.hessian;
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < (i == j ? a + 1 : 3); ++b) values[next++] = block(a, b);
  }
}

}  // namespace debulk
