#pragma once

#include "debulk/sheet/term.hpp"

namespace debulk {

// Potential of a vertical dead load, the same force on every node: minus its work through the nodes' downward movement from
// the start, paper eqs. (5) and (6), gravity with A t rho g / N and vacuum with P A / N. The work counts movement positive
// downward, or the vacuum would lift the ply (docs/model.md, section 3).
class Load : public Term {
 public:
  Load(double force_n, const Points& start) : force_(force_n), start_(start) {}

  double value(const Points& x) const override {
    double up = 0;
    for (std::size_t i = 0; i < x.size(); ++i) up += x[i].z() - start_[i].z();
    return force_ * up;
  }
  double add_gradient(const Points& x, Points& gradient) const override {
    for (Eigen::Vector3d& g : gradient) g.z() += force_;
    return value(x);
  }
  void add_hessian(const Points&, const Places&, BlockMatrix&) const override {}

 private:
  double force_;  // N a node
  Points start_;
};

}  // namespace debulk
