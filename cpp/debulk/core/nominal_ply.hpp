#pragma once

namespace debulk {

// The ply and the loads of the paper's tables. Rooms that do not know each other need the same figures, and their options
// take their defaults from here.
constexpr double kNominalThicknessMm = 0.3;  // of the uncured ply
constexpr double kNominalYoungMpa = 360.0;   // for bending only
constexpr double kNominalPressureMpa = 0.1;  // vacuum
constexpr double kNominalMoldTolMm = 0.2;    // nearer to the mold than this, the ply's lower side lies on it

}  // namespace debulk
