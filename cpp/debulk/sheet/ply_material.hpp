#pragma once

#include <cmath>

#include "debulk/core/error.hpp"
#include "debulk/core/nominal_ply.hpp"
#include "debulk/sheet/lumping.hpp"

namespace debulk {

// Whether the vacuum acts straight down, whatever the ply does, or along the ply's normal.
enum class PressureDirection { vertical, normal };

// The ply's material and the loads on it (the paper's table; docs/model.md).
struct PlyMaterial {
  double thickness_mm = kNominalThicknessMm;
  double young_mpa = kNominalYoungMpa;  // used for bending only
  double shear_mpa = 40.0;              // in-plane
  double density_kg_m3 = 1048.0;
  double friction = 0.4;                      // of free boundary nodes
  double pressure_mpa = kNominalPressureMpa;  // vacuum
  double gravity_m_s2 = 9.81;
  Lumping lumping = Lumping::consistent;  // how loads and friction, which act on areas, are distributed to nodes

  // Not in the paper, and absent unless asked for (docs/model.md, section 3.1).
  double torsion_n_mm = 0.0;           // of the tows, per mm of the ply's width
  double in_plane_bending_n_mm = 0.0;  // of the tows within the ply, per mm of its width
  double tack_n_mm3 = 0.0;             // stiffness of the resin between ply and mold, MPa per mm
  PressureDirection pressure_direction = PressureDirection::vertical;

  double bending_mj() const { return young_mpa * std::pow(thickness_mm, 3) / 12; }  // c = E t^3 / 12, N mm

  void check() const {
    const auto at_least_zero = [](double v) { return std::isfinite(v) && v >= 0; };
    require(std::isfinite(thickness_mm) && thickness_mm > 0, "thickness_mm", "a positive length in mm", thickness_mm);
    require(at_least_zero(young_mpa), "young_mpa", "a finite modulus of 0 MPa or more", young_mpa);
    require(at_least_zero(shear_mpa), "shear_mpa", "a finite modulus of 0 MPa or more", shear_mpa);
    require(at_least_zero(density_kg_m3), "density_kg_m3", "a finite density of 0 kg/m3 or more", density_kg_m3);
    require(at_least_zero(friction), "friction", "a finite coefficient of 0 or more", friction);
    require(at_least_zero(pressure_mpa), "pressure_mpa", "a finite pressure of 0 MPa or more", pressure_mpa);
    require(at_least_zero(gravity_m_s2), "gravity_m_s2", "a finite acceleration of 0 m/s2 or more", gravity_m_s2);
    require(at_least_zero(torsion_n_mm), "torsion_n_mm", "a finite stiffness of 0 N mm or more", torsion_n_mm);
    require(at_least_zero(in_plane_bending_n_mm), "in_plane_bending_n_mm", "a finite stiffness of 0 N mm or more", in_plane_bending_n_mm);
    require(at_least_zero(tack_n_mm3), "tack_n_mm3", "a finite stiffness of 0 N/mm3 or more", tack_n_mm3);
  }
};

}  // namespace debulk
