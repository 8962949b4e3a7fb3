#include "debulk/sheet/gap_problem.hpp"

#include <limits>

namespace debulk {
namespace {

// Returns T^T v. T is the derivative of a node's position by its gap coordinates, over Delta: the identity with the
// mold's slope in row z.
Eigen::Vector3d pulled_back(const SurfaceSample& mold, const Eigen::Vector3d& v) {
  return {v.x() + mold.gradient.x() * v.z(), v.y() + mold.gradient.y() * v.z(), v.z()};
}

// Returns T_i^T B T_j.
Eigen::Matrix3d pulled_back(const SurfaceSample& at_i, const Eigen::Matrix3d& b, const SurfaceSample& at_j) {
  Eigen::Matrix3d out = b;
  for (int a = 0; a < 3; ++a) {
    out(a, 0) += b(a, 2) * at_j.gradient.x();
    out(a, 1) += b(a, 2) * at_j.gradient.y();
  }
  out.row(0) += at_i.gradient.x() * out.row(2);
  out.row(1) += at_i.gradient.y() * out.row(2);
  return out;
}

}  // namespace

GapProblem::GapProblem(const Sheet& sheet)
    : sheet_(sheet),
      length_(sheet.net().spacing),
      energy_(sheet.force_unit_n() * sheet.net().spacing),
      reach_(2 * sheet.size_mm() / sheet.net().spacing),
      place_(sheet.start().size(), -1),
      blocks_(sheet.movable_hessian()) {
  for (std::size_t k = 0; k < sheet.movable().size(); ++k) place_[static_cast<std::size_t>(sheet.movable()[k])] = static_cast<int>(k);
  for (const auto& [i, j] : sheet.segments()) {
    const int place_i = place_[static_cast<std::size_t>(i)], place_j = place_[static_cast<std::size_t>(j)];
    if (place_i >= 0 || place_j >= 0)
      constrained_.push_back({i, j, place_i, place_j, blocks_.slot(i, i), blocks_.slot(i, j), blocks_.slot(j, j)});
  }
  state_.x = sheet.start();
  state_.curvature = blocks_;
}

GapProblem::State& GapProblem::at(const Eigen::VectorXd& y) const {
  if (state_.y.size() == y.size() && state_.y == y) return state_;
  state_.y = y;
  state_.differentiated = state_.curved = false;
  state_.mold.resize(sheet_.movable().size());
  for (std::size_t k = 0; k < sheet_.movable().size(); ++k) {
    Eigen::Vector3d p = length_ * y.segment<3>(3 * static_cast<long>(k));
    state_.mold[k] = sheet_.mold().sample(p.head<2>());
    p.z() += state_.mold[k].height;
    state_.x[static_cast<std::size_t>(sheet_.movable()[k])] = p;
  }
  return state_;
}

GapProblem::State& GapProblem::differentiated_at(const Eigen::VectorXd& y) const {
  State& state = at(y);
  if (!state.differentiated) {
    state.gradient.assign(state.x.size(), Eigen::Vector3d::Zero());
    state.energy = sheet_.add_gradient(state.x, state.gradient);
    state.differentiated = true;
  }
  return state;
}

Points GapProblem::to_points(const Eigen::VectorXd& y) const {
  return at(y).x;
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

// Value and gradient are computed together, because a line search asks for few values without then asking for the
// gradient.
double GapProblem::value(const Eigen::VectorXd& y) const {
  return differentiated_at(y).energy / energy_;
}

void GapProblem::gradient(const Eigen::VectorXd& y, Eigen::Ref<Eigen::VectorXd> out) const {
  const State& state = differentiated_at(y);
  for (std::size_t k = 0; k < state.mold.size(); ++k)
    out.segment<3>(3 * static_cast<long>(k)) =
        (length_ / energy_) * pulled_back(state.mold[k], state.gradient[static_cast<std::size_t>(sheet_.movable()[k])]);
}

void GapProblem::constraints(const Eigen::VectorXd& y, Eigen::Ref<Eigen::VectorXd> out) const {
  const Points& x = at(y).x;
  for (std::size_t k = 0; k < constrained_.size(); ++k) {
    const Segment& s = constrained_[k];
    const Eigen::Vector3d d = x[static_cast<std::size_t>(s.i)] - x[static_cast<std::size_t>(s.j)];
    out[static_cast<long>(k)] = (d.squaredNorm() / (length_ * length_) - 1) / 2;
  }
}

std::vector<Problem::Entry> GapProblem::jacobian_pattern() const {
  std::vector<Entry> pattern;
  for (std::size_t k = 0; k < constrained_.size(); ++k)
    for (const int place : {constrained_[k].place_i, constrained_[k].place_j})
      if (place >= 0)
        for (int a = 0; a < 3; ++a) pattern.push_back({static_cast<int>(k), 3 * place + a});
  return pattern;
}

void GapProblem::jacobian(const Eigen::VectorXd& y, Eigen::Ref<Eigen::VectorXd> values) const {
  const State& state = at(y);
  long next = 0;
  for (const Segment& s : constrained_) {
    const Eigen::Vector3d d = (state.x[static_cast<std::size_t>(s.i)] - state.x[static_cast<std::size_t>(s.j)]) / length_;
    for (const auto& [place, sign] : {std::pair{s.place_i, 1.0}, std::pair{s.place_j, -1.0}})
      if (place >= 0) {
        values.segment<3>(next) = sign * pulled_back(state.mold[static_cast<std::size_t>(place)], d);
        next += 3;
      }
  }
}

std::vector<Problem::Entry> GapProblem::hessian_pattern() const {
  std::vector<Entry> pattern;
  for (int slot = 0; slot < blocks_.blocks(); ++slot) {
    const int i = place_[static_cast<std::size_t>(blocks_.row(slot))], j = place_[static_cast<std::size_t>(blocks_.column(slot))];
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < (i == j ? a + 1 : 3); ++b) pattern.push_back({3 * i + a, 3 * j + b});
  }
  return pattern;
}

// By the chain rule, the Hessian is T^T H T plus, in a node's x and y, the slope along z times F''. The constraints
// enter with `lambda`, the energy with its weight over the unit of energy; the blocks are summed in mJ/mm^2.
void GapProblem::hessian(const Eigen::VectorXd& y, double weight_of_f, const Eigen::VectorXd& lambda,
                         Eigen::Ref<Eigen::VectorXd> values) const {
  State& state = differentiated_at(y);
  if (weight_of_f != 0 && !state.curved) {  // kept, because it is asked for again at the same point with other tensions
    state.curvature.set_zero();
    sheet_.add_movable_hessian(state.x, state.curvature);
    state.curved = true;
  }
  if (weight_of_f != 0)
    blocks_.set(state.curvature);
  else
    blocks_.set_zero();
  const double weight = (weight_of_f != 0 ? weight_of_f : 1.0) * length_ * length_ / energy_;
  std::vector<double> slope_z(state.mold.size());
  for (std::size_t k = 0; k < slope_z.size(); ++k)
    slope_z[k] = weight_of_f * length_ / energy_ * state.gradient[static_cast<std::size_t>(sheet_.movable()[k])].z();
  for (std::size_t k = 0; k < constrained_.size(); ++k) {
    const Segment& s = constrained_[k];
    const double l = lambda[static_cast<long>(k)];
    const Eigen::Matrix3d block = l / weight * Eigen::Matrix3d::Identity();
    blocks_.add(s.slot_ii, s.i, s.i, block);
    blocks_.add(s.slot_jj, s.j, s.j, block);
    blocks_.add(s.slot_ij, s.i, s.j, -block);
    const double dz = l * (state.x[static_cast<std::size_t>(s.i)].z() - state.x[static_cast<std::size_t>(s.j)].z()) / length_;
    if (s.place_i >= 0) slope_z[static_cast<std::size_t>(s.place_i)] += dz;
    if (s.place_j >= 0) slope_z[static_cast<std::size_t>(s.place_j)] -= dz;
  }

  long next = 0;
  for (int slot = 0; slot < blocks_.blocks(); ++slot) {
    const auto i = static_cast<std::size_t>(place_[static_cast<std::size_t>(blocks_.row(slot))]);
    const auto j = static_cast<std::size_t>(place_[static_cast<std::size_t>(blocks_.column(slot))]);
    Eigen::Matrix3d block = weight * pulled_back(state.mold[i], blocks_.block(slot), state.mold[j]);
    if (i == j) block.topLeftCorner<2, 2>() += slope_z[i] * length_ * state.mold[i].hessian;
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < (i == j ? a + 1 : 3); ++b) values[next++] = block(a, b);
  }
}

}  // namespace debulk
