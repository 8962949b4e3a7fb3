#include "debulk/net/lay_pocket.hpp"

#include <utility>

#include "debulk/surface/reference.hpp"

namespace debulk {

PocketNet lay_pocket(const Segmentation& segmentation, const FootMap& feet, int id, const Surface& reference, const PatchOptions& options,
                     const FibreAngles& angles, const Polygon& ply_outline, const FibreNetOptions& net, const Stop& stop) {
  const auto check = [&] {
    if (stop.now()) throw Stopped("the laying of a net was stopped");
  };
  check();
  PatchOptions wanted = options;
  wanted.keep_reference = false;
  Patch patch = make_patch(segmentation, feet, id, reference, wanted);
  check();
  const Reference surface(std::move(patch.surface));
  check();
  const Pocket& pocket = segmentation.pockets[static_cast<std::size_t>(id - 1)];
  PocketShape shape;
  shape.centre = pocket.centroid;
  shape.angles = angles;
  shape.outline = patch.outline;
  shape.ply_outline = ply_outline;
  shape.rms_outline = pocket.outline;
  return fibre_net(surface, reference, shape, net, stop);
}

}  // namespace debulk
