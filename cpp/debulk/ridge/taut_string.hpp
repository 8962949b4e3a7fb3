#pragma once

#include <vector>

namespace debulk {

// The mold below a fibre: heights at equal steps along it.
struct MoldSection {
  double step = 1.0;            // mm
  std::vector<double> heights;  // mm
};

// A fibre that is too short for its mold, modelled as a string without bending stiffness. It is drawn with a tension T
// per unit of width and pressed down, along -z, by the vacuum P. It lies on the mold or spans it in arcs of the radius
// T / P (docs/model.md, section 5).
struct TautString {
  double radius = 0.0;  // mm, T / P
  double lacks = 0.0;   // mm, by how much it is shorter than the mold below it
  double gap = 0.0;     // mm, of its highest point above the mold; like `lacks` it grows with the radius
};
TautString taut_string(const MoldSection& mold, double radius);

// Returns the string that is shorter than the mold by `lacks`, mm, or the one with the radius `most` if that is shorter
// by less: a string that pulls harder than it is held slips until it pulls no more than that. All members are zero if
// `lacks` or `most` is not positive.
TautString taut_string_lacking(const MoldSection& mold, double lacks, double most);

}  // namespace debulk
