#pragma once

#include "debulk/solve/problem.hpp"

namespace debulk {

// A problem with a compliance 1/k added to its equalities: minimise f(y) + k/2 |s|^2 subject to c(y) - s = 0, in the
// variables (y, s). Where the constraints' gradients depend on each other, the multipliers then stay bounded by k times
// the violation (a fibre pinned at both ends at the length of its chord has no regular solution otherwise;
// docs/model.md, section 4). Elsewhere the answer differs from the inextensible one by a violation of lambda / k, which
// the certificate reports.
class Elastic : public Problem {
 public:
  Elastic(const Problem& inner, double stiffness) : inner_(inner), k_(stiffness), n_(inner.variables()), m_(inner.equalities()) {}

  int variables() const override { return n_ + m_; }
  int equalities() const override { return m_; }
  Eigen::VectorXd start() const override { return extend(inner_.start()); }
  Eigen::VectorXd lower() const override;

  double value(const Eigen::VectorXd& y) const override;
  void gradient(const Eigen::VectorXd& y, Eigen::Ref<Eigen::VectorXd> out) const override;
  void constraints(const Eigen::VectorXd& y, Eigen::Ref<Eigen::VectorXd> out) const override;
  std::vector<Entry> jacobian_pattern() const override;
  void jacobian(const Eigen::VectorXd& y, Eigen::Ref<Eigen::VectorXd> values) const override;
  std::vector<Entry> hessian_pattern() const override;
  void hessian(const Eigen::VectorXd& y, double weight_of_f, const Eigen::VectorXd& lambda,
               Eigen::Ref<Eigen::VectorXd> values) const override;

  // Returns (y, c(y)), the elastic point that corresponds to a point of the inner problem.
  Eigen::VectorXd extend(const Eigen::VectorXd& inner) const;
  Eigen::VectorXd inner_part(const Eigen::VectorXd& y) const { return y.head(n_); }

 private:
  const Problem& inner_;
  double k_;
  int n_, m_;
};

}  // namespace debulk
