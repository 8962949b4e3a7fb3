#pragma once

#include <memory>

#include "debulk/surface/surface.hpp"

namespace debulk {

// The same surface at another place: every point (x, y, z) of it goes to (x, y, z) + by. A Reference is moved without
// loss of digits, however far it lies from the origin.
std::shared_ptr<const Surface> moved(const std::shared_ptr<const Surface>& surface, const Eigen::Vector3d& by);

}  // namespace debulk
