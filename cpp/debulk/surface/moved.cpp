#include "debulk/surface/moved.hpp"

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

}  // namespace

std::shared_ptr<const Surface> moved(const std::shared_ptr<const Surface>& surface, const Eigen::Vector3d& by) {
  const auto reference = std::dynamic_pointer_cast<const Reference>(surface);
  if (!reference) return std::make_shared<Moved>(surface, by);
  Grid<double> heights = reference->heights();
  heights.origin += by.head<2>();
  for (double& h : heights.values) h += by.z();
  return std::make_shared<Reference>(heights);
}

}  // namespace debulk
