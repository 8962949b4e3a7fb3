#pragma once

#include <utility>

#include "debulk/sheet/term.hpp"

namespace debulk {

// Potential of vertical dead loads, paper eqs. (5) and (6): minus their work through the nodes' downward movement from
// the start. The load of a node is a t rho g for gravity and P a for vacuum, where a is the area that the node
// represents (lumping.hpp). Downward movement counts as positive work; otherwise the vacuum would lift the ply
// (docs/model.md, section 3).
class Load : public Term {
 public:
  Load(std::vector<double> forces_n, const Points& start) : forces_(std::move(forces_n)), start_(start) {}

  double value(const Points& x) const override {
    double work = 0;
    for (std::size_t i = 0; i < x.size(); ++i) work += forces_[i] * (x[i].z() - start_[i].z());
    return work;
  }
  double add_gradient(const Points& x, Points& gradient) const override {
    for (std::size_t i = 0; i < x.size(); ++i) gradient[i].z() += forces_[i];
    return value(x);
  }
  void add_hessian(const Points&, const Places&, BlockMatrix&) const override {}

 private:
  std::vector<double> forces_;  // N, one per node
  Points start_;
};

}  // namespace debulk
