#pragma once

#include <limits>
#include <vector>

#include <Eigen/Core>

namespace debulk {

// The problem to minimise f(y) subject to c(y) = 0 and y >= lower. Each derived class scales all quantities to order
// one. Matrices have a fixed pattern. The Hessian is the lower triangle of that of weight_of_f f + lambda . c.
class Problem {
 public:
  struct Entry {
    int row, column;
  };

  virtual ~Problem() = default;
  virtual int variables() const = 0;
  virtual int equalities() const = 0;
  virtual Eigen::VectorXd start() const = 0;
  virtual Eigen::VectorXd lower() const = 0;  // -infinity where there is no bound
  // Distance from the start, in any variable, beyond which no minimum of f is looked for: a method stops there.
  virtual double reach() const { return std::numeric_limits<double>::infinity(); }

  virtual double value(const Eigen::VectorXd& y) const = 0;
  virtual void gradient(const Eigen::VectorXd& y, Eigen::Ref<Eigen::VectorXd> out) const = 0;
  virtual void constraints(const Eigen::VectorXd& y, Eigen::Ref<Eigen::VectorXd> out) const = 0;

  virtual std::vector<Entry> jacobian_pattern() const = 0;
  virtual void jacobian(const Eigen::VectorXd& y, Eigen::Ref<Eigen::VectorXd> values) const = 0;
  virtual std::vector<Entry> hessian_pattern() const = 0;
  virtual void hessian(const Eigen::VectorXd& y, double weight_of_f, const Eigen::VectorXd& lambda,
                       Eigen::Ref<Eigen::VectorXd> values) const = 0;
};

}  // namespace debulk
