#pragma once

#include <vector>

#include "debulk/ridge/fibre_section.hpp"

namespace debulk {

// A section that forms a ridge.
struct RidgeSection : FibreSection {
  double height = 0.0;  // mm above the mold, by ridge_height_of_excess()
  double length = 0.0;  // mm of ridge line that the section represents
};

// Sets each section's length: on either side half the distance to the next peak along the crossing fibre, or half a
// node spacing where the ridge ends. So a single peak represents one spacing, and n peaks in a row represent n. The
// next peak is searched at the crossing fibre's next node and at that node's neighbours along the section, because a
// crest may shift by one node per row. Returns the length of the longest connected ridge, mm; 0 if there are no
// sections.
double measure_ridge_lines(const DebulkedNet& net, std::vector<RidgeSection>& sections);

}  // namespace debulk
