#include "debulk/sheet/certify.hpp"

#include <Eigen/SparseCore>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "debulk/solve/multipliers.hpp"
#include "debulk/solve/skyline.hpp"

namespace debulk {
namespace {

using Sparse = Eigen::SparseMatrix<double>;
using Triplets = std::vector<Eigen::Triplet<double>>;

constexpr double kTouching_mm = Certificate::penetration_limit_mm;

struct Contact {
  int node;
  Eigen::Vector3d normal;  // of z - F, upward, not normalised
};

// The first-order conditions at a configuration: movable coordinates, gradients of their constraints, and multipliers.
// All forces are divided by the force unit.
class Stationarity {
 public:
  Stationarity(const Sheet& sheet, const Points& x) : sheet_(sheet), x_(x), place_(x.size(), -1) {
    for (std::size_t k = 0; k < sheet.movable().size(); ++k) place_[static_cast<std::size_t>(sheet.movable()[k])] = static_cast<int>(k);
    for (std::size_t k = 0; k < sheet.segments().size(); ++k) {
      const auto& segment = sheet.segments()[k];
      if (place_[static_cast<std::size_t>(segment[0])] < 0 && place_[static_cast<std::size_t>(segment[1])] < 0) continue;
      segments_.push_back(segment);
      numbers_.push_back(k);
    }
    for (const int node : sheet.movable()) {
      const SurfaceSample mold = sheet.mold().sample(x[static_cast<std::size_t>(node)].head<2>());
      if (x[static_cast<std::size_t>(node)].z() - mold.height <= kTouching_mm)
        contacts_.push_back({node, {-mold.gradient.x(), -mold.gradient.y(), 1.0}});
    }
    const Points g = sheet.gradient(x);
    gradient_.resize(size());
    for (std::size_t k = 0; k < sheet.movable().size(); ++k)
      gradient_.segment<3>(3 * static_cast<long>(k)) = g[static_cast<std::size_t>(sheet.movable()[k])] / sheet.force_unit_n();
  }

  long size() const { return 3 * static_cast<long>(sheet_.movable().size()); }
  int lengths() const { return static_cast<int>(segments_.size()); }
  int contacts() const { return static_cast<int>(contacts_.size()); }

  // Returns a matrix whose columns are the gradients of the lengths, then those of the gaps of the touching nodes.
  Sparse columns(bool with_lengths) const {
    Triplets entries;
    const int first = with_lengths ? lengths() : 0;
    for (int k = 0; k < first; ++k) {
      const auto [i, j] = segments_[static_cast<std::size_t>(k)];
      const Eigen::Vector3d along = direction(k);
      add(entries, i, k, along);
      add(entries, j, k, -along);
    }
    for (int k = 0; k < contacts(); ++k)
      add(entries, contacts_[static_cast<std::size_t>(k)].node, first + k, contacts_[static_cast<std::size_t>(k)].normal);
    Sparse out(size(), first + contacts());
    out.setFromTriplets(entries.begin(), entries.end());
    return out;
  }

  // Fits the multipliers. With a compliance, those of the lengths are not fitted but are -stiffness * strain.
  Multipliers fit(bool compliant, double stiffness, const Stop& stop) const {
    std::vector<int> pushing(static_cast<std::size_t>(contacts()));
    const int first = compliant ? 0 : lengths();
    for (int k = 0; k < contacts(); ++k) pushing[static_cast<std::size_t>(k)] = first + k;
    if (!compliant) return fit_multipliers(columns(true), gradient_, pushing, stop);

    Eigen::VectorXd tensions(lengths());
    for (int k = 0; k < lengths(); ++k) {  // derivative of k/2 ((L/Delta)^2 - 1)^2 / 4 by L, over the force unit
      const auto [i, j] = segments_[static_cast<std::size_t>(k)];
      const double ratio = (x_[static_cast<std::size_t>(i)] - x_[static_cast<std::size_t>(j)]).norm() / sheet_.net().spacing;
      tensions[k] = -stiffness * (ratio * ratio - 1) / 2 * ratio;
    }
    const Sparse all = columns(true);
    const Multipliers gaps = fit_multipliers(columns(false), gradient_ - all.leftCols(lengths()) * tensions, pushing, stop);
    Multipliers fit;
    fit.x.resize(lengths() + contacts());
    fit.x << tensions, gaps.x;
    fit.residual = gaps.residual;
    return fit;
  }

  // Returns the tension of every segment, N: the rate at which the energy falls as the segment is made longer.
  std::vector<double> tensions_n(const Eigen::VectorXd& multipliers) const {
    std::vector<double> out(sheet_.segments().size(), 0.0);
    for (int k = 0; k < lengths(); ++k) out[numbers_[static_cast<std::size_t>(k)]] = -sheet_.force_unit_n() * multipliers[k];
    return out;
  }

  // Returns the Hessian of the Lagrangian over the movable coordinates, times Delta over the force unit.
  Sparse hessian(const Eigen::VectorXd& multipliers) const {
    BlockMatrix blocks = sheet_.movable_hessian();
    sheet_.add_movable_hessian(x_, blocks);
    const double force = sheet_.force_unit_n();
    for (int k = 0; k < lengths(); ++k) {
      const auto [i, j] = segments_[static_cast<std::size_t>(k)];
      const double length = (x_[static_cast<std::size_t>(i)] - x_[static_cast<std::size_t>(j)]).norm();
      const Eigen::Vector3d along = direction(k);
      const Eigen::Matrix3d block = -force * multipliers[k] / length * (Eigen::Matrix3d::Identity() - along * along.transpose());
      blocks.add(blocks.slot(i, i), i, i, block);
      blocks.add(blocks.slot(j, j), j, j, block);
      blocks.add(blocks.slot(i, j), i, j, -block);
    }
    for (int k = 0; k < contacts(); ++k) {
      const int node = contacts_[static_cast<std::size_t>(k)].node;
      Eigen::Matrix3d block = Eigen::Matrix3d::Zero();
      block.topLeftCorner<2, 2>() =
          force * multipliers[lengths() + k] * sheet_.mold().sample(x_[static_cast<std::size_t>(node)].head<2>()).hessian;
      blocks.add(blocks.slot(node, node), node, node, block);
    }
    const double unit = sheet_.net().spacing / force;
    Triplets entries;
    for (int slot = 0; slot < blocks.blocks(); ++slot) {
      const int i = place_[static_cast<std::size_t>(blocks.row(slot))], j = place_[static_cast<std::size_t>(blocks.column(slot))];
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) {
          entries.emplace_back(3 * i + a, 3 * j + b, unit * blocks.block(slot)(a, b));
          if (i != j) entries.emplace_back(3 * j + b, 3 * i + a, unit * blocks.block(slot)(a, b));
        }
    }
    Sparse out(size(), size());
    out.setFromTriplets(entries.begin(), entries.end());
    return out;
  }

 private:
  Eigen::Vector3d direction(int k) const {
    const auto [i, j] = segments_[static_cast<std::size_t>(k)];
    return (x_[static_cast<std::size_t>(i)] - x_[static_cast<std::size_t>(j)]).normalized();
  }
  void add(Triplets& entries, int node, int column, const Eigen::Vector3d& value) const {
    const int place = place_[static_cast<std::size_t>(node)];
    if (place < 0) return;
    for (int a = 0; a < 3; ++a) entries.emplace_back(3 * place + a, column, value[a]);
  }

  const Sheet& sheet_;
  const Points& x_;
  std::vector<int> place_;
  std::vector<std::array<int, 2>> segments_;  // the segments with a movable end
  std::vector<std::size_t> numbers_;          // their indices in Sheet::segments()
  std::vector<Contact> contacts_;
  Eigen::VectorXd gradient_;
};

struct Curvature {
  double smallest = 0.0;
  Eigen::VectorXd direction;  // unit length, within the active constraints; empty if no curvature is negative
};

// The matrix H + rho A A^T + shift and its factor. It has a narrow skyline, because the nodes are numbered along the
// net's fibres.
class Penalised {
 public:
  Penalised(const Sparse& hessian, const Sparse& active) : hessian_(hessian), active_(active) {
    std::vector<std::pair<int, int>> lower;
    lower.reserve(static_cast<std::size_t>(hessian.nonZeros()) + 21 * static_cast<std::size_t>(active.cols()));
    for_lower([&](int row, int column, double) { lower.emplace_back(row, column); });
    for_products([&](int row, int column, double) { lower.emplace_back(row, column); });
    factors_ = Skyline(static_cast<int>(hessian.rows()), lower);
  }

  // Returns false if the matrix is not positive definite.
  bool factor(double rho, double shift) {
    std::fill(factors_.values().begin(), factors_.values().end(), 0.0);
    const auto at = [this](int row, int column) -> double& { return factors_.values()[factors_.place(row, column)]; };
    for_lower([&](int row, int column, double value) { at(row, column) += value; });
    for_products([&](int row, int column, double value) { at(row, column) += rho * value; });
    for (int i = 0; i < factors_.size(); ++i) at(i, i) += shift;
    return factors_.factor();
  }
  void solve(Eigen::VectorXd& x) { factors_.solve(x); }

 private:
  template <class Body>
  void for_lower(const Body& body) const {
    for (int k = 0; k < hessian_.cols(); ++k)
      for (Sparse::InnerIterator it(hessian_, k); it; ++it)
        if (it.row() >= k) body(static_cast<int>(it.row()), k, it.value());
  }
  template <class Body>
  void for_products(const Body& body) const {
    for (int k = 0; k < active_.cols(); ++k)
      for (Sparse::InnerIterator a(active_, k); a; ++a)
        for (Sparse::InnerIterator b(active_, k); b && b.row() <= a.row(); ++b)
          body(static_cast<int>(a.row()), static_cast<int>(b.row()), a.value() * b.value());
  }

  const Sparse &hessian_, &active_;
  Skyline factors_;
};

// Tests whether the Hessian is positive on the null space of `active`. It is if H + rho A A^T has a Cholesky
// factorisation. If not, inverse iteration finds the direction of negative curvature, which is then projected into the
// null space, where its curvature is measured.
Curvature smallest_curvature(const Sparse& hessian, const Sparse& active, const Stop& stop) {
  const double largest = std::max(1.0, hessian.coeffs().size() ? hessian.coeffs().abs().maxCoeff() : 0.0);
  Penalised penalised(hessian, active);
  Curvature out;
  for (const double rho : {1e3 * largest, 1e6 * largest}) {
    double shift = -Certificate::curvature_limit / 2;
    const auto factor = [&] {
      if (stop.now()) throw Stopped("while the curvature was sought");
      return penalised.factor(rho, shift);
    };
    if (factor()) return {};
    bool done = false;
    while (!done && shift < 1e3 * rho) {
      shift *= 8;
      done = factor();
    }
    if (!done) continue;
    Eigen::VectorXd v(hessian.rows()), next;  // the start has a share of every component and is always the same
    for (long i = 0; i < v.size(); ++i) v[i] = std::sin(1.0 + 2.399963 * static_cast<double>(i));
    for (int step = 0; step < 60; ++step) {
      next = v;
      penalised.solve(next);
      next.normalize();
      const double turned = (next - v).squaredNorm();
      v.swap(next);
      if (turned < 1e-12) break;
    }
    const Eigen::VectorXd inside = fit_multipliers(active, v, {}, stop).residual;
    const double size = inside.norm();
    if (size < 1e-3) continue;
    const double curvature = inside.dot(hessian * inside) / (size * size);
    if (curvature < out.smallest) out = {curvature, inside / size};
    if (out.smallest < Certificate::curvature_limit) return out;
  }
  // There is no factor, but no direction of negative curvature was found either: the curvature is not known, so that
  // the point is not certified.
  if (out.smallest == 0) out.smallest = std::numeric_limits<double>::quiet_NaN();
  return out;
}

// A node that touches the mold without pushing is held only against moving down. So the active set starts with the
// pushing nodes. If a direction of negative curvature would press a touching node into the mold with either sign, that
// node is added to the active set and the search is repeated.
Curvature curvature_within_contacts(const Stationarity& at, const Eigen::VectorXd& multipliers, const Stop& stop) {
  constexpr double kPushing = 1e-6;  // in force units
  const Sparse hessian = at.hessian(multipliers), columns = at.columns(true);
  std::vector<char> held(static_cast<std::size_t>(columns.cols()), 1);
  for (int k = 0; k < at.contacts(); ++k) held[static_cast<std::size_t>(at.lengths() + k)] = multipliers[at.lengths() + k] > kPushing;
  for (int round = 0;; ++round) {
    Triplets entries;
    int next = 0;
    for (int k = 0; k < columns.cols(); ++k) {
      if (!held[static_cast<std::size_t>(k)]) continue;
      for (Sparse::InnerIterator it(columns, k); it; ++it) entries.emplace_back(static_cast<int>(it.row()), next, it.value());
      ++next;
    }
    Sparse active(columns.rows(), next);
    active.setFromTriplets(entries.begin(), entries.end());
    Curvature found = smallest_curvature(hessian, active, stop);
    if (!(found.smallest < Certificate::curvature_limit)) return found;
    std::vector<int> sinking, rising;
    for (int k = at.lengths(); k < columns.cols(); ++k) {
      if (held[static_cast<std::size_t>(k)]) continue;
      const double up = columns.col(k).dot(found.direction);
      if (up < -1e-9) sinking.push_back(k);
      if (up > 1e-9) rising.push_back(k);
    }
    if (sinking.empty() || round > at.contacts()) return found;
    if (rising.empty()) {
      found.direction = -found.direction;
      return found;
    }
    for (const int k : sinking) held[static_cast<std::size_t>(k)] = 1;
  }
}

// Computes the residual, the curvature, and a direction of descent.
void judge_derivatives(const Sheet& sheet, const Points& x, double stiffness, const Stop& stop, Judged& judged) {
  Certificate& certificate = judged.certificate;
  if (stop.now()) throw Stopped("before the derivatives");
  const Stationarity at(sheet, x);
  const Multipliers fit = at.fit(certificate.compliant, stiffness, stop);
  judged.tensions_n = at.tensions_n(fit.x);
  certificate.kkt_error = fit.residual.lpNorm<Eigen::Infinity>();
  certificate.strict_kkt_error = certificate.kkt_error * (sheet.force_unit_n() / sheet.strict_force_n());
  if (!(certificate.kkt_error <= Certificate::kkt_limit)) return;  // curvature means nothing if the slope is not zero

  const Curvature curvature = curvature_within_contacts(at, fit.x, stop);
  certificate.curvature = curvature.smallest;
  if (curvature.smallest < Certificate::curvature_limit) {
    judged.descent.assign(x.size(), Eigen::Vector3d::Zero());
    const Eigen::VectorXd direction = curvature.direction / curvature.direction.lpNorm<Eigen::Infinity>();
    for (std::size_t k = 0; k < sheet.movable().size(); ++k)
      judged.descent[static_cast<std::size_t>(sheet.movable()[k])] = direction.segment<3>(3 * static_cast<long>(k));
  }
}

}  // namespace

Judged certify(const Sheet& sheet, const Points& x, double stiffness, const Stop& stop) {
  Judged judged;
  Certificate& certificate = judged.certificate;
  for (const double length : sheet.lengths(x))
    certificate.length_error = std::max(certificate.length_error, std::abs(length / sheet.net().spacing - 1));
  const std::vector<double> gaps = sheet.gaps(x);
  for (const int node : sheet.movable())
    certificate.penetration_mm = std::max(certificate.penetration_mm, -gaps[static_cast<std::size_t>(node)]);
  certificate.compliant = certificate.length_error > Certificate::length_limit;
  // A rise within the rounding error of a sum of many terms, or within the remainder of a barrier, does not count.
  const double start = sheet.energy(sheet.start()), now = sheet.energy(x);
  const double scale = std::abs(start) + static_cast<double>(x.size()) * sheet.force_unit_n() * sheet.net().spacing;
  certificate.energy_gain_mj = now - start > 1e-8 * scale ? now - start : 0.0;
  if (sheet.movable().empty()) return judged;

  try {
    judge_derivatives(sheet, x, stiffness, stop, judged);
  } catch (const Stopped&) {
    judged.complete = false;
    certificate.kkt_error = certificate.strict_kkt_error = std::numeric_limits<double>::quiet_NaN();
  }
  return judged;
}

}  // namespace debulk
