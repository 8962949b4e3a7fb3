#pragma once

#include <array>
#include <vector>

#include "debulk/net/net.hpp"
#include "debulk/sheet/term.hpp"

namespace debulk {

// Potential of a pressure along the normal of the ply, in place of the vertical load (docs/model.md, section 3.1): the
// pressure times the volume between the net as it lies and as it was laid, counted positive above. Every corner of the
// net, a node with one neighbour along each fibre, adds a triangle of half weight; the four of a cell enclose as much as
// its bilinear patch. Strips from the rim to where it was laid close the volume, so that nothing depends on the origin.
// While the rim stays there, all forces together are the pressure times the vector area of the net as laid.
class NormalPressure : public Term {
 public:
  // Throws InputError for a net without a corner, such as a single fibre, which has no normal.
  NormalPressure(double pressure_mpa, const std::vector<Neighbours>& neighbours, const Points& start);

  double value(const Points& x) const override;
  double add_gradient(const Points& x, Points& gradient) const override;
  void add_hessian(const Points& x, const Places& places, BlockMatrix& hessian) const override;
  std::vector<std::array<int, 3>> groups() const override;
  Places places(const BlockMatrix& pattern) const override;

 private:
  // A triangle, counter-clockwise from above. A number of the count of nodes or more is a point of the net as laid.
  struct Face {
    std::array<int, 3> corners;
    double pressure;  // MPa, times the weight of the triangle
  };
  Eigen::Vector3d corner(const Points& x, int number) const;  // from the first node as laid, mm
  double potential(const Points& x) const;
  // Calls body(i, j, the face, the third corner) for each face and each pair of its corners that are nodes.
  template <class Body>
  void for_pairs(const Body& body) const;

  Points start_;
  std::vector<Face> faces_;
  double at_start_ = 0.0;  // the potential of the net as laid, mJ
};

}  // namespace debulk
