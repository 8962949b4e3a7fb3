#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "debulk/cloud/cloud_view.hpp"
#include "debulk/core/stop.hpp"

namespace debulk {

// x_to = matrix * x_from for every point, computed in double. A missing point becomes three NaN. matrix: a rigid
// motion [R t; 0 0 0 1], with R orthonormal to 1e-4 (poses are often typed with a few decimals) and determinant +1.
// Anything else throws InputError, because a scale or a mirror would silently falsify areas and heights. Throws
// Stopped.
std::vector<float> transform(const CloudView& cloud, const Eigen::Matrix4d& matrix, int threads = 0, const Stop& stop = Stop());

// The same from one place to another, which may be the same, because a cloud of 20 million points takes 240 MB. Points
// whose `keep` (one per point) is 0 become missing.
void move_kept(const float* from, float* to, const std::uint8_t* keep, std::size_t count, const Eigen::Matrix4d& matrix, int threads = 0,
               const Stop& stop = Stop());

}  // namespace debulk
