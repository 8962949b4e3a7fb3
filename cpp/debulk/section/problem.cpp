#include "debulk/section/problem.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace debulk {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kCrown = 0.1;  // natural lengths; nearer to the crown than this flanks cannot meet, as no ply bends so sharply
// Load of a segment at full pressure, in the unit of force. With it the interior point's first barrier, 0.1, lifts a
// touching node by a hundredth of the unit of length. If it lifted nodes farther, the fold could be lost; if less,
// contacts would be slow to change.
constexpr double kForces = 10.0;

// Calls what(slot, entry of the block, variable) for the lower triangle, in a fixed order. In block (i, i + k) the
// variables of the columns come after those of the rows, so that the transpose of the block is below the diagonal.
template <class What>
void for_each_entry(const SectionProblem& problem, const What& what) {
  for (int i = 0; i < problem.nodes(); ++i)
    for (int k = 0; k < 3 && i + k < problem.nodes(); ++k)
      for (int a = 0; a < 2; ++a)
        for (int b = k == 0 ? a : 0; b < 2; ++b) {
          const int column = problem.place(i, a), row = problem.place(i + k, b);
          if (column >= 0 && row >= 0) what(i, k, a, b, row, column);
        }
}

}  // namespace

SectionProblem::SectionProblem(SectionProfile mold, Eigen::VectorXd segment_lengths, Eigen::Matrix2Xd start_line, SectionEnergy energy,
                               std::optional<double> flank_distance)
    : energy_(std::move(energy)),
      mold_(std::move(mold)),
      lengths_(std::move(segment_lengths)),
      start_(std::move(start_line)),
      flank_distance_(flank_distance),
      scale_(kForces / lengths_.mean()) {}

int SectionProblem::place(int node, int a) const {
  if (node <= 0 || node >= nodes() - 1 || (node == crown() && a == 0)) return -1;
  return 2 * (node - 1) + a - (node >= crown() ? 1 : 0);
}

// A coordinate has an error in its last bit, an angle has this error over s, and the forces of its moment this error
// over s^3.
double SectionProblem::rounding() const {
  return 0.2 * std::numeric_limits<double>::epsilon() * scale_ * std::pow(energy_.natural_length() / lengths_.minCoeff(), 3);
}

// The bound of u is a flank's distance from x = 0 when the flanks touch. Towards the crown it is that of a semicircular
// cap, the tightest that a thick ply makes.
Eigen::VectorXd SectionProblem::lower() const {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(variables());
  const double half = flank_distance_.value_or(0.0) / 2;
  for (int i = 1; i < nodes() - 1; ++i) {
    const int u = place(i, 0);
    if (u < 0) continue;
    const double from_crown = std::abs(i - crown()) * lengths_[i < crown() ? 0 : segments() - 1];
    if (!flank_distance_ || from_crown < kCrown * energy_.natural_length())
      out[u] = -std::numeric_limits<double>::infinity();
    else if (half > 0)
      out[u] = half * std::sin(std::min(from_crown / half, kPi / 2));
  }
  return out;
}

Eigen::Matrix2Xd SectionProblem::to_line(const Eigen::VectorXd& y) const {
  Eigen::Matrix2Xd line = start_;
  for (int i = 1; i < nodes() - 1; ++i) {
    const int u = place(i, 0);
    const double x = u >= 0 ? side(i) * y[u] : 0.0;
    line.col(i) << x, mold_.at(x).height + y[place(i, 1)];
  }
  return line;
}

Eigen::VectorXd SectionProblem::from_line(const Eigen::Matrix2Xd& line) const {
  Eigen::VectorXd y(variables());
  for (int i = 1; i < nodes() - 1; ++i) {
    if (const int u = place(i, 0); u >= 0) y[u] = side(i) * line(0, i);
    y[place(i, 1)] = line(1, i) - mold_.at(line(0, i)).height;
  }
  return y;
}

Eigen::Matrix2d SectionProblem::frame(int node, const Eigen::Matrix2Xd& line) const {
  return (Eigen::Matrix2d() << side(node), 0, side(node) * mold_.at(line(0, node)).slope, 1).finished();
}

void SectionProblem::gradient(const Eigen::VectorXd& y, Eigen::Ref<Eigen::VectorXd> out) const {
  const Eigen::Matrix2Xd line = to_line(y);
  Eigen::Matrix2Xd by_position;
  energy_.gradient(line, by_position);
  for (int i = 1; i < nodes() - 1; ++i) {
    const Eigen::Vector2d g = scale_ * frame(i, line).transpose() * by_position.col(i);
    for (int a = 0; a < 2; ++a)
      if (const int at = place(i, a); at >= 0) out[at] = g[a];
  }
}

void SectionProblem::constraints(const Eigen::VectorXd& y, Eigen::Ref<Eigen::VectorXd> out) const {
  const Eigen::Matrix2Xd line = to_line(y);
  for (int k = 0; k < segments(); ++k) out[k] = ((line.col(k + 1) - line.col(k)).squaredNorm() / (lengths_[k] * lengths_[k]) - 1) / 2;
  out[segments()] = line(1, crown() + 1) - line(1, crown() - 1);
}

std::vector<Problem::Entry> SectionProblem::jacobian_pattern() const {
  std::vector<Entry> pattern;
  for (int k = 0; k < segments(); ++k)
    for (const int node : {k, k + 1})
      for (int a = 0; a < 2; ++a)
        if (const int at = place(node, a); at >= 0) pattern.push_back({k, at});
  for (const int node : {crown() - 1, crown() + 1})
    for (int a = 0; a < 2; ++a) pattern.push_back({segments(), place(node, a)});
  return pattern;
}

void SectionProblem::jacobian(const Eigen::VectorXd& y, Eigen::Ref<Eigen::VectorXd> values) const {
  const Eigen::Matrix2Xd line = to_line(y);
  long next = 0;
  for (int k = 0; k < segments(); ++k) {
    const Eigen::Vector2d d = (line.col(k + 1) - line.col(k)) / (lengths_[k] * lengths_[k]);
    for (const int node : {k, k + 1}) {
      const Eigen::Vector2d by = (node == k ? -1.0 : 1.0) * (frame(node, line).transpose() * d);
      for (int a = 0; a < 2; ++a)
        if (place(node, a) >= 0) values[next++] = by[a];
    }
  }
  for (const int side : {-1, 1})
    for (int a = 0; a < 2; ++a) values[next++] = side * frame(crown() + side, line)(1, a);
}

std::vector<Problem::Entry> SectionProblem::hessian_pattern() const {
  std::vector<Entry> pattern;
  for_each_entry(*this, [&](int, int, int, int, int row, int column) { pattern.push_back({row, column}); });
  return pattern;
}

// By the chain rule, the Hessian consists of the blocks between the frames of their nodes plus, in a node's u, the
// slope along z times F''.
void SectionProblem::hessian(const Eigen::VectorXd& y, double weight_of_f, const Eigen::VectorXd& lambda,
                             Eigen::Ref<Eigen::VectorXd> values) const {
  const Eigen::Matrix2Xd line = to_line(y);
  SectionBlocks blocks(static_cast<std::size_t>(nodes()), {Eigen::Matrix2d::Zero(), Eigen::Matrix2d::Zero(), Eigen::Matrix2d::Zero()});
  energy_.add_hessian(line, weight_of_f * scale_, blocks);
  Eigen::Matrix2Xd slope;
  energy_.gradient(line, slope);
  slope *= weight_of_f * scale_;
  for (const int side : {-1, 1}) slope(1, crown() + side) += side * lambda[segments()];
  for (int k = 0; k < segments(); ++k) {
    const double stiffness = lambda[k] / (lengths_[k] * lengths_[k]);
    const Eigen::Vector2d pull = stiffness * (line.col(k + 1) - line.col(k));
    slope.col(k) -= pull;
    slope.col(k + 1) += pull;
    blocks[k][0].diagonal().array() += stiffness;
    blocks[k][1].diagonal().array() -= stiffness;
    blocks[k + 1][0].diagonal().array() += stiffness;
  }
  std::vector<Eigen::Matrix2d> frames;
  for (int i = 0; i < nodes(); ++i) frames.push_back(frame(i, line));
  for (int i = 0; i < nodes(); ++i) {
    for (int k = 0; k < 3 && i + k < nodes(); ++k) blocks[i][k] = (frames[i].transpose() * blocks[i][k] * frames[i + k]).eval();
    blocks[i][0](0, 0) += slope(1, i) * mold_.at(line(0, i)).curvature;
  }
  long next = 0;
  for_each_entry(*this, [&](int i, int k, int a, int b, int, int) { values[next++] = blocks[i][k](a, b); });
}

}  // namespace debulk
