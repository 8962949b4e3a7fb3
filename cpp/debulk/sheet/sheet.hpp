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
//   Pi = bending + shear + friction - gravity - vacuum,
// as a sum of the terms that this net and ply need; terms that are zero whatever the nodes do are left out.
class Sheet {
 public:
  // net: the initial configuration; its `inside` is not used. area_mm2: of the ply inside the perimeter, for a lumping that
  // shares it out evenly.
  Sheet(Net net, double area_mm2, const PlyMaterial& ply, std::shared_ptr<const Surface> mold);

  // The same sheet and mold elsewhere: every node (and the mold) moved by the same vector.
  Sheet moved(const Eigen::Vector3d& by) const;

  double energy(const Points& x) const;                                      // mJ
  std::vector<std::pair<std::string, double>> terms(const Points& x) const;  // all five, mJ; loads as work; those left out are 0
  Points gradient(const Points& x) const;                                    // mJ/mm, all nodes
  double add_gradient(const Points& x, Points& gradient) const;              // the same, added; returns the energy
  BlockMatrix hessian(const Points& x) const;                                // mJ/mm2, all nodes
  std::vector<double> lengths(const Points& x) const;                        // of segments(), mm
  std::vector<double> gaps(const Points& x) const;                           // z - F(x, y), mm

  // The Hessian's blocks between movable nodes, zero, with room for the segments'; and adding the energy's to it.
  const BlockMatrix& movable_hessian() const { return movable_hessian_; }
  void add_movable_hessian(const Points& x, BlockMatrix& hessian) const;

  const Net& net() const { return net_; }
  const Points& start() const { return net_.nodes; }
  const std::vector<std::array<int, 2>>& segments() const { return segments_; }
  const std::vector<int>& movable() const { return movable_; }  // node numbers, ascending
  const Surface& mold() const { return *mold_; }
  const PlyMaterial& ply() const { return ply_; }
  double nodal_force_n() const { return nodal_force_; }          // the vacuum's on the node with most area; what forces are compared with
  const std::vector<double>& loads_n() const { return loads_; }  // vacuum and weight of each node
  double grip_n() const { return grip_; }                        // friction of all free nodes that slip
  double size_mm() const;                                        // diagonal of the box round the initial net
  // The vacuum's largest force on a node, or the largest weight of one where that is more (no vacuum).
  double strict_force_n() const { return strict_force_; }
  // The same, or 1 % of the largest force of a single spring (a corner's bending or shear) in the initial net, where that is
  // more: a stiff ply that hardly feels the vacuum. Residuals, tensions and stiffness are in this unit.
  double force_unit_n() const { return force_unit_; }
  const std::vector<std::string>& left_out() const { return left_out_; }

 private:
  struct NamedTerm {
    std::string name;
    std::shared_ptr<const Term> term;
    Places places;  // in movable_hessian_
  };
  void add_term(const std::string& name, double strength, std::shared_ptr<const Term> term);
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
