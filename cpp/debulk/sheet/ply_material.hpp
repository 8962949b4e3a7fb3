#pragma once

#include <cmath>

#include "debulk/core/error.hpp"
#include "debulk/core/nominal_ply.hpp"
#include "debulk/sheet/lumping.hpp"

namespace debulk {

// The ply's material and the loads on it (the paper's table; docs/model.md).
struct PlyMaterial {
  double thickness_mm = kNominalThicknessMm;
  double young_mpa = kNominalYoungMpa;  // used for bending only
  double shear_mpa = 40.0;              // in-plane
  double density_kg_m3 = 1048.0;
  double friction = 0.4;                      // of free boundary nodes
  double pressure_mpa = kNominalPressureMpa;  // vacuum, along -z
  double gravity_m_s2 = 9.81;
  Lumping lumping = Lumping::consistent;  // how loads and friction, which act on areas, are distributed to nodes

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
  }
};

}  // namespace debulk
