#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "debulk/sheet/block_matrix.hpp"

namespace debulk {

using Points = std::vector<Eigen::Vector3d>;  // one per node, mm
using Places = std::vector<int>;              // slots of a BlockMatrix; -1 for a block that it does not hold

// One energy of the sheet, in mJ: value, gradient and Hessian of the same formula, in one place.
class Term {
 public:
  virtual ~Term() = default;
  virtual double value(const Points& x) const = 0;
  // Adds to the gradient (mJ/mm, all nodes) and returns the value.
  virtual double add_gradient(const Points& x, Points& gradient) const = 0;
  // Returns the largest force that a single spring of the term exerts, N. The springs' forces may cancel in the
  // gradient, but the tensions must still balance them.
  virtual double largest_force(const Points&) const { return 0; }
  // Adds to a Hessian, at the places that places() found in its pattern.
  virtual void add_hessian(const Points& x, const Places& places, BlockMatrix& hessian) const = 0;
  // Returns the sets of nodes that the term couples, which are the pattern of its Hessian.
  virtual std::vector<std::array<int, 3>> groups() const { return {}; }
  // Returns where the term's blocks lie in a Hessian of this pattern, in the order in which add_hessian() adds them.
  virtual Places places(const BlockMatrix&) const { return {}; }
};

}  // namespace debulk
