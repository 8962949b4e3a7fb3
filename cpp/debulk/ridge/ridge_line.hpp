#pragma once

#include <vector>

#include "debulk/ridge/fibre_section.hpp"

namespace debulk {

// A section that stands up as a ridge.
struct RidgeSection : FibreSection {
  double height = 0.0;  // mm above the mold, by ridge_height_of_excess()
  double length = 0.0;  // mm of ridge line that the section stands for
};

// Sets each section's length: half the way to the next peak on either side along the crossing fibre, or half a node spacing where
// the ridge ends, so that a lone peak stands for one spacing and n in a row for n. The next peak is looked for at the crossing
// fibre's next node and at that node's neighbours along the section: a crest may shift by one node a row. Returns the length
// of the longest connected ridge, mm; 0 without sections.
double measure_ridge_lines(const DebulkedNet& net, std::vector<RidgeSection>& sections);

}  // namespace debulk
