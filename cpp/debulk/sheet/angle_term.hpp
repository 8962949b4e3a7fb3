#pragma once

#include <array>
#include <vector>

#include "debulk/sheet/corner_batch.hpp"
#include "debulk/sheet/term.hpp"

namespace debulk {

// A node with two of its neighbours, a and b.
struct Corner {
  int node, a, b;
};

// The stiffness times the sum over corners of a function of the angle between u = x_a - x_node and
// v = sign * (x_b - x_node). With sign = -1 this angle is the turning angle of the line a - node - b instead of the
// corner's angle.
class AngleTerm : public Term {
 public:
  using Function = void (*)(CornerBatch&, int, double, Order);

  AngleTerm(Function function, double sign, double stiffness, std::vector<Corner> corners)
      : function_(function), sign_(sign), stiffness_(stiffness), corners_(std::move(corners)) {}

  double value(const Points& x) const override;
  double add_gradient(const Points& x, Points& gradient) const override;
  double largest_force(const Points& x) const override;
  void add_hessian(const Points& x, const Places& places, BlockMatrix& hessian) const override;
  std::vector<std::array<int, 3>> groups() const override;
  Places places(const BlockMatrix& pattern) const override;

 private:
  // Fills a batch from corner `first` on and evaluates it; returns the number of corners in it.
  int load(const Points& x, std::size_t first, Order order, CornerBatch& batch) const;

  Function function_;
  double sign_, stiffness_;
  std::vector<Corner> corners_;
};

}  // namespace debulk
