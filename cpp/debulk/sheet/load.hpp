#pragma once

#include "debulk/sheet/term.hpp"

namespace debulk {

// Work of a vertical dead load, the same force on every node, through its downward movement from the start: paper
// eqs. (5) and (6), gravity with A t rho g / N and vacuum with P A / N. Its sign needs movement counted positive
// downward, or the vacuum would lift the ply (model.md, section 3). Enters the potential with a minus.
class Load : public Term {
 public:
  Load(double force_n, const Points& start) : force_(force_n), start_(start) {}

  double value(const Points& x) const override {
    double down = 0;
    for (std::size_t i = 0; i < x.size(); ++i) down += start_[i].z() - x[i].z();
    return force_ * down;
  }
  double add_gradient(const Points& x, Points& gradient) const override {
    for (Eigen::Vector3d& g : gradient) g.z() -= force_;
    return value(x);
  }
  void add_hessian(const Points&, BlockMatrix&) const override {}

 private:
  double force_;  // N a node
  Points start_;
};

}  // namespace debulk
