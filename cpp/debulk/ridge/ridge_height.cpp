#include "debulk/ridge/ridge_height.hpp"

#include <cmath>

#include "debulk/core/error.hpp"

namespace debulk {

namespace {
constexpr double kPi = 3.14159265358979323846;
}

double ridge_height_of_excess(double excess_length, double thickness) {
  return excess_length / 2 + (2 - kPi / 2) * thickness;
}

double ridge_height(double ply_length, double mold_length, double thickness) {
  require(std::isfinite(thickness) && thickness > 0, "thickness_mm", "a positive thickness in mm", thickness);
  require(std::isfinite(ply_length) && ply_length > 0, "ply_length_mm", "a positive length in mm", ply_length);
  require(std::isfinite(mold_length) && mold_length >= 2 * thickness, "mold_length_mm",
          "at least two thicknesses in mm, the width of a ridge", mold_length);
  return ridge_height_of_excess(ply_length - mold_length, thickness);
}

}  // namespace debulk
