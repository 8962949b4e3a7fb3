#include "debulk/solve/elastic.hpp"

#include <limits>

namespace debulk {

Eigen::VectorXd Elastic::extend(const Eigen::VectorXd& inner) const {
  Eigen::VectorXd y(n_ + m_);
  y.head(n_) = inner;
  inner_.constraints(inner, y.tail(m_));
  return y;
}

Eigen::VectorXd Elastic::lower() const {
  Eigen::VectorXd out = Eigen::VectorXd::Constant(n_ + m_, -std::numeric_limits<double>::infinity());
  out.head(n_) = inner_.lower();
  return out;
}

double Elastic::value(const Eigen::VectorXd& y) const {
  return inner_.value(y.head(n_)) + k_ / 2 * y.tail(m_).squaredNorm();
}

void Elastic::gradient(const Eigen::VectorXd& y, Eigen::Ref<Eigen::VectorXd> out) const {
  inner_.gradient(y.head(n_), out.head(n_));
  out.tail(m_) = k_ * y.tail(m_);
}

void Elastic::constraints(const Eigen::VectorXd& y, Eigen::Ref<Eigen::VectorXd> out) const {
  inner_.constraints(y.head(n_), out);
  out -= y.tail(m_);
}

std::vector<Problem::Entry> Elastic::jacobian_pattern() const {
  std::vector<Entry> pattern = inner_.jacobian_pattern();
  for (int k = 0; k < m_; ++k) pattern.push_back({k, n_ + k});
  return pattern;
}

void Elastic::jacobian(const Eigen::VectorXd& y, Eigen::Ref<Eigen::VectorXd> values) const {
  inner_.jacobian(y.head(n_), values.head(values.size() - m_));
  values.tail(m_).setConstant(-1);
}

std::vector<Problem::Entry> Elastic::hessian_pattern() const {
  std::vector<Entry> pattern = inner_.hessian_pattern();
  for (int k = 0; k < m_; ++k) pattern.push_back({n_ + k, n_ + k});
  return pattern;
}

void Elastic::hessian(const Eigen::VectorXd& y, double weight_of_f, const Eigen::VectorXd& lambda,
                      Eigen::Ref<Eigen::VectorXd> values) const {
  inner_.hessian(y.head(n_), weight_of_f, lambda, values.head(values.size() - m_));
  values.tail(m_).setConstant(weight_of_f * k_);
}

}  // namespace debulk
