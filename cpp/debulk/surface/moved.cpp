#include "debulk/surface/moved.hpp"

#include <utility>

#include "debulk/surface/reference.hpp"

namespace debulk {
namespace {

class Moved : public Surface {
 public:
  Moved(std::shared_ptr<const Surface> surface, const Eigen::Vector3d& by) : surface_(std::move(surface)), by_(by) {}
  SurfaceSample sample(const Eigen::Vector2d& xy) const override {
    SurfaceSample out = surface_->sample(xy - by_.head<2>());
    out.height += by_.z();
    return out;
  }

 private:
  std::shared_ptr<const Surface> surface_;
  Eigen::Vector3d by_;
};

// Places are counted from the moved first height, so that no digits are lost on the way there and back, however far
// away it is.
class MovedReference : public Surface {
 public:
  MovedReference(std::shared_ptr<const Reference> reference, const Eigen::Vector3d& by)
      : reference_(std::move(reference)), origin_(reference_->heights().origin + by.head<2>()), up_(by.z()) {}
  SurfaceSample sample(const Eigen::Vector2d& xy) const override {
    SurfaceSample out = reference_->sample_at((xy - origin_) / reference_->heights().spacing);
    out.height += up_;
    return out;
  }

 private:
  std::shared_ptr<const Reference> reference_;
  Eigen::Vector2d origin_;
  double up_;
};

}  // namespace

std::shared_ptr<const Surface> moved(const std::shared_ptr<const Surface>& surface, const Eigen::Vector3d& by) {
  if (auto reference = std::dynamic_pointer_cast<const Reference>(surface))
    return std::make_shared<MovedReference>(std::move(reference), by);
  return std::make_shared<Moved>(surface, by);
}

}  // namespace debulk
