#pragma once

#include <limits>
#include <vector>

#include <Eigen/Core>

namespace debulk {

// minimise f(y) subject to c(y) = 0 and y >= lower. All scaled to order one by whoever states the problem.
// Matrices have a fixed pattern; the Hessian is that of f + lambda . c, its lower triangle.
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
  // Farther from the start than this, in any variable, f has no minimum that is looked for: the method stops there.
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
