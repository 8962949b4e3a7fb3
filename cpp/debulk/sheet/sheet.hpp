#pragma once

#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "debulk/net/net.hpp"
#include "debulk/sheet/ply_material.hpp"
#include "debulk/sheet/term.hpp"
#include "debulk/surface/surface.hpp"

namespace debulk {

// The mass-spring ply on the mold: potential energy of a pocket's net (docs/model.md, section 3),
//   Pi = bending + shear + friction - gravity - vacuum (+ torsion + in_plane_bending + tack),
// as a sum of the terms that this net and ply need; terms that are zero for all positions of the nodes are left out.
class Sheet {
 public:
  // net: the initial configuration; its `inside` is not used. area_mm2: area of the ply inside the perimeter, for a
  // lumping that distributes it evenly. Throws InputError for a net, ply or area that is not valid.
  Sheet(Net net, double area_mm2, const PlyMaterial& ply, std::shared_ptr<const Surface> mold);

  // Returns the same sheet at another place: every node and the mold are moved by the same vector.
  Sheet moved(const Eigen::Vector3d& by) const;

  double energy(const Points& x) const;  // mJ
  // The paper's five terms, mJ, loads as work and 0 if left out; then the optional ones that are not left out.
  std::vector<std::pair<std::string, double>> terms(const Points& x) const;
  Points gradient(const Points& x) const;                        // mJ/mm, all nodes
  double add_gradient(const Points& x, Points& gradient) const;  // adds the gradient; returns the energy
  BlockMatrix hessian(const Points& x) const;                    // mJ/mm2, all nodes
  std::vector<double> lengths(const Points& x) const;            // of segments(), mm
  std::vector<double> gaps(const Points& x) const;               // z - F(x, y), mm

  // movable_hessian() has the pattern of the Hessian's blocks between movable nodes, including those of the segments,
  // with zero values; add_movable_hessian() adds the energy's Hessian to such a matrix.
  const BlockMatrix& movable_hessian() const { return movable_hessian_; }
  void add_movable_hessian(const Points& x, BlockMatrix& hessian) const;

  const Net& net() const { return net_; }
  const Points& start() const { return net_.nodes; }
  const std::vector<std::array<int, 2>>& segments() const { return segments_; }
  const std::vector<int>& movable() const { return movable_; }  // node numbers, ascending
  const Surface& mold() const { return *mold_; }
  const PlyMaterial& ply() const { return ply_; }
  double nodal_force_n() const { return nodal_force_; }          // force of the vacuum on the node with the largest area
  const std::vector<double>& loads_n() const { return loads_; }  // vacuum and weight of each node
  double grip_n() const { return grip_; }                        // friction of all free nodes when they slip
  double size_mm() const;                                        // diagonal of the box round the initial net
  // The vacuum's largest force on a node, or the largest weight of a node if that is more (without vacuum).
  double strict_force_n() const { return strict_force_; }
  // The unit of force for residuals, tensions and stiffness: strict_force_n(), or 1 % of the largest force of a single
  // spring (a corner's bending or shear) in the initial net if that is more, as for a stiff ply that the vacuum hardly
  // deforms.
  double force_unit_n() const { return force_unit_; }
  const std::vector<std::string>& left_out() const { return left_out_; }

 private:
  struct NamedTerm {
    std::string name;
    std::shared_ptr<const Term> term;
    Places places;  // in movable_hessian_
  };
  // Makes the term from `parts` and adds it, or leaves it out if its strength is 0.
  template <class T, class... Parts>
  void add_term(const std::string& name, double strength, Parts&&... parts);
  std::vector<int> sticking_nodes() const;  // movable nodes that lie on the mold at the start
  std::vector<std::array<int, 3>> groups() const;
  void check_net() const;
  void check_points(const Points& x) const;

  Net net_;
  double area_;
  PlyMaterial ply_;
  std::shared_ptr<const Surface> mold_;
  double nodal_force_, grip_, strict_force_, force_unit_;
  std::vector<double> loads_;
  std::vector<std::array<int, 2>> segments_;
  std::vector<int> movable_;
  std::vector<NamedTerm> terms_;
  std::vector<std::string> left_out_;
  BlockMatrix movable_hessian_;
};

}  // namespace debulk
