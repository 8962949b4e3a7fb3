#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "debulk/surface/reference.hpp"

namespace debulk {

// A surface with a bump on it: added to it is the spline through a grid of heights that are 0 along the grid's border;
// outside the grid nothing is added.
class Raised : public Surface {
 public:
  Raised(const Surface& below, Grid<double> heights_above) : below_(below), above_(std::move(heights_above)) {}

  SurfaceSample sample(const Eigen::Vector2d& xy) const override {
    SurfaceSample s = below_.sample(xy);
    if (!above_.inside(xy)) return s;
    const SurfaceSample more = above_.sample(xy);
    s.height += more.height;
    s.gradient += more.gradient;
    s.hessian += more.hessian;
    return s;
  }
  double height(const Eigen::Vector2d& xy) const override { return below_.height(xy) + (above_.inside(xy) ? above_.height(xy) : 0.0); }
  std::vector<Eigen::Vector2d> gradients_on_row(const std::vector<double>& x, double y) const override {
    std::vector<Eigen::Vector2d> out = below_.gradients_on_row(x, y);
    const auto on = [&](double at) { return above_.inside({at, y}); };
    const auto first = std::find_if(x.begin(), x.end(), on);
    const std::vector<Eigen::Vector2d> more = above_.gradients_on_row({first, std::partition_point(first, x.end(), on)}, y);
    for (std::size_t k = 0; k < more.size(); ++k) out[static_cast<std::size_t>(first - x.begin()) + k] += more[k];
    return out;
  }

 private:
  const Surface& below_;
  Reference above_;
};

}  // namespace debulk
