#pragma once

#include <cstdint>
#include <vector>

#include "debulk/cloud/cloud_view.hpp"
#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// Places (x, y) of the pixels of an organised cloud round which less than a third of 5 by 5 pixels was seen. Gridding
// bridges single missing pixels; what is left of a spot that was not seen, or whose points scatter, is no measurement
// of the surface there. A third keeps scans of which half of the pixels are lost at random. Throws Stopped.
std::vector<Eigen::Vector2f> sparse_places(const CloudView& cloud, int threads = 0, const Stop& stop = Stop());

constexpr double sparse_reach = 1.5;  // grid points round a place that rest on it

// Clears the marks at the grid points that are no farther than `reach` mm from one of the places, along x and along y.
void clear_round(const std::vector<Eigen::Vector2f>& places, double reach, Grid<std::uint8_t>& marks);

}  // namespace debulk
