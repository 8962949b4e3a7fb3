#pragma once

namespace debulk {

// The ply and the loads of the paper's tables. Several folders that do not include each other need the same figures;
// the defaults of their options are taken from here.
constexpr double kNominalThicknessMm = 0.3;  // thickness of the uncured ply
constexpr double kNominalYoungMpa = 360.0;   // modulus of the ply, for bending only
constexpr double kNominalPressureMpa = 0.1;  // pressure of the vacuum
constexpr double kNominalMoldTolMm = 0.2;    // the ply lies on the mold where its lower side is nearer than this

}  // namespace debulk
