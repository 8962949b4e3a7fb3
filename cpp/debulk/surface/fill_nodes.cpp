#include "debulk/surface/fill_nodes.hpp"

#include <cmath>
#include <string>
#include <vector>

#include "debulk/core/error.hpp"
#include "debulk/surface/thin_plate.hpp"

namespace debulk {

Grid<double> fill_nodes(Grid<double> heights, const Stop& stop) {
  std::vector<std::size_t> unknown;
  for (std::size_t k = 0; k < heights.size(); ++k)
    if (std::isnan(heights.values[k])) unknown.push_back(k);
  if (unknown.empty()) return heights;
  const std::size_t known = heights.size() - unknown.size();
  require(known >= 3, "heights", "heights measured on enough of the grid to fit a surface", std::to_string(known) + " fitted nodes");
  const std::vector<double> filled = thin_plate(heights, unknown, 0, stop);
  require(!filled.empty(), "heights", "heights measured on enough of the grid to fit a surface", "too few, or all in a line");
  for (std::size_t n = 0; n < unknown.size(); ++n) heights.values[unknown[n]] = filled[n];
  return heights;
}

}  // namespace debulk
