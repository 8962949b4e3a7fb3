#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "debulk/core/nominal_ply.hpp"
#include "debulk/solve/certificate.hpp"
#include "debulk/solve/options.hpp"
#include "debulk/solve/status.hpp"

namespace debulk {

// The 2-D section model (paper, "Post-Processing the Results"; docs/model.md, section 6): the cross-section of an
// inextensible ply under the vacuum between two pins on the mold. The ply is longer than the mold; the model finds the
// fold that it makes.
struct SectionOptions {
  int segments = 200;                             // of the polyline; even
  int steps = 5;                                  // load steps: the pressure grows by equal shares
  std::string pressure = "following";             // always normal to the ply; or "vertical", a dead load along -z
  std::string bending = "consistent";             // c theta^2 / (2 s) per node; or "paper", see section_stiffness()
  bool self_contact = true;                       // true: the flanks do not pass through each other
  double contact_distance = kNominalThicknessMm;  // mm, between the flanks' mid-lines where they touch: the ply's thickness
  SolveOptions solve{1e-8, 1000, 1e11, Stop()};   // so stiff that its strains are negligible compared with excess / span

  void check() const;
};

struct SectionPly {
  double stiffness = kNominalYoungMpa * kNominalThicknessMm * kNominalThicknessMm * kNominalThicknessMm / 12;  // c = E t^3 / 12, N mm
  double pressure = kNominalPressureMpa;                                                                       // MPa

  void check() const;
};

// Returns the bending stiffness that acts, N mm. "paper": eq. (2) of the paper gives a node the energy c theta^2 / 2,
// which is meant for a node of a net of spacing D. Here a line with n short segments s replaces two segments of such a
// net, D = n s / 2. If the energy is applied unchanged to these segments, it is, per unit of width, the consistent
// energy of a ply of stiffness c s / D = 2 c / n. That is far too soft, and becomes softer as the line becomes finer.
double section_stiffness(const SectionPly& ply, const SectionOptions& options);

struct SectionStep {      // height, foot_width and end_force are NaN if the step was not certified
  double pressure = 0;    // MPa
  double height = 0;      // largest gap between ply and mold, across the chord between the pins, mm
  double foot_width = 0;  // between the points where the ply leaves the mold, along the chord, mm
  double end_force = 0;   // force that presses on the pins along the chord, N/mm
  int iterations = 0;
};

struct SectionFold {
  std::vector<Eigen::Vector2d> points;  // (x, z) of the nodes, mm
  std::vector<SectionStep> steps;       // the steps that were tried
  SolveStatus status = SolveStatus::numerical_failure;
  Certificate certificate;    // of the last step; kkt_error in units of the load on a segment
  int folds = 0;              // number of folds at the last step; only 1 is a valid result
  double guide_force = 0;     // N/mm, the force that keeps the crown in the middle of the span; 0 on a symmetric mold
  double natural_length = 0;  // l = (c / P)^(1/3), mm

  bool certified() const { return status == SolveStatus::converged && certificate.certified() && folds == 1; }
  std::string explanation() const;
};

// Returns the single upright fold in the middle of the span. Its crown stays on the normal to the chord there, and each
// side supplies half of the excess. `excess`: length of the ply beyond that of the mold, mm. `profile`: points (x, z)
// of the mold, mm, with x increasing and measured from the middle of the span; the mold is a smooth curve through them,
// or flat if there are none. Throws InputError if the arguments are not valid or cannot be solved.
SectionFold fold_section(double excess, double span, const SectionPly& ply, const std::vector<Eigen::Vector2d>& profile,
                         const SectionOptions& options);

}  // namespace debulk
