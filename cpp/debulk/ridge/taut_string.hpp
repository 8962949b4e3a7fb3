#pragma once

#include <vector>

namespace debulk {

// The mold below a fibre: heights at equal steps along it.
struct MoldSection {
  double step = 1.0;            // mm
  std::vector<double> heights;  // mm
};

// A fibre that is too short for its mold, as a string without stiffness: drawn with a tension T a width and pressed down, along -z, by the
// vacuum P it lies on the mold or stands off it in arcs of the radius T / P (docs/model.md, section 5).
struct TautString {
  double radius = 0.0;  // mm, T / P
  double lacks = 0.0;   // mm, by how much it is shorter than the mold below it
  double gap = 0.0;     // mm, of its highest point above the mold; like what it lacks it grows with the radius
};
TautString taut_string(const MoldSection& mold, double radius);

// The string that lacks so much. Of the radius `most` if that one lacks less: it pulls harder than it is held, and slips until
// it pulls no more than that. All zero where nothing is lacking, or nothing holds.
TautString taut_string_lacking(const MoldSection& mold, double lacks, double most);

}  // namespace debulk
