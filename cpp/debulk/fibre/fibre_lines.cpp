#include "debulk/fibre/fibre_lines.hpp"

#include <algorithm>
#include <cmath>

#include "debulk/core/error.hpp"
#include "debulk/pocket/outline_search.hpp"

namespace debulk {

void FibreOptions::check() const {
  require(thickness > 0, "thickness_mm", "a positive length in mm", thickness);
  require(mold_tol > 0, "mold_tol_mm", "a positive length in mm", mold_tol);
  require(apart > 0, "apart_mm", "a positive length in mm", apart);
  require(step > 0, "step_mm", "a positive length in mm", step);
  require(fine_mm >= 0, "fine_mm", "a length in mm, not negative", fine_mm);
  require(blur_cells2 >= 0, "blur_cells2", "a variance, not negative", blur_cells2);
  require(draw >= 0, "draw_mm", "a length in mm, not negative", draw);
  require(hold >= 0, "hold_mm", "a length in mm, not negative", hold);
}

namespace {

// Coordinates along a line at which the outline crosses it, sorted.
std::vector<double> crossings(const OutlineSearch& ply, const Eigen::Vector2d& from, const Eigen::Vector2d& way) {
  const Eigen::Vector2d across(-way.y(), way.x());
  std::vector<double> out;
  for (const auto& [one, other] : ply.sides()) {
    const Eigen::Vector2d a = one - from, b = other - from;
    const double aside = a.dot(across), beyond = b.dot(across);
    if ((aside < 0) == (beyond < 0)) continue;
    const double share = aside / (aside - beyond);
    out.push_back((1 - share) * a.dot(way) + share * b.dot(way));
  }
  std::sort(out.begin(), out.end());
  return out;
}

Polygon corners(const Box& box) {
  return {box.low, {box.high.x(), box.low.y()}, box.high, {box.low.x(), box.high.y()}};
}

// The axis of the fibre at a place, as a unit vector whose sign means nothing; empty where it is not known.
class Axes {
 public:
  Axes(const AngleField& angles, int family) : doubled_(angles.like(Eigen::Vector2d(0, 0))) {
    for (std::size_t k = 0; k < angles.values.size(); ++k) {
      const double twice = 2 * angles.values[k][family];
      doubled_.values[k] = {std::cos(twice), std::sin(twice)};
    }
  }

  // The direction at a place that continues `way`.
  std::optional<Eigen::Vector2d> along(const Eigen::Vector2d& xy, const Eigen::Vector2d& way) const {
    const Eigen::Vector2d at = doubled_.locate(xy).cwiseMax(0.0).cwiseMin(Eigen::Vector2d(doubled_.nx - 1, doubled_.ny - 1));
    const int i = std::min(static_cast<int>(at.x()), std::max(0, doubled_.nx - 2));
    const int j = std::min(static_cast<int>(at.y()), std::max(0, doubled_.ny - 2));
    const double u = at.x() - i, v = at.y() - j;
    Eigen::Vector2d twice = Eigen::Vector2d::Zero();  // axes are averaged by their doubled angles
    double weight = 0;
    for (const int dj : {0, 1})
      for (const int di : {0, 1}) {
        const double share = (di ? u : 1 - u) * (dj ? v : 1 - v);
        if (share <= 0 || !doubled_.contains(i + di, j + dj)) continue;
        const Eigen::Vector2d& corner = doubled_.at(i + di, j + dj);
        if (std::isnan(corner.x())) continue;
        twice += share * corner, weight += share;
      }
    const double length = std::sqrt(twice.squaredNorm());
    if (weight < 0.5 || length < 1e-9) return std::nullopt;
    // The half angle without its tangent: of the two roots, the one that does not cancel.
    const double cosine = twice.x() / length, sine = twice.y() / length, larger = std::sqrt(0.5 * (1 + std::abs(cosine)));
    const Eigen::Vector2d out = cosine >= 0 ? Eigen::Vector2d(larger, 0.5 * sine / larger) : Eigen::Vector2d(0.5 * sine / larger, larger);
    return out.dot(way) < 0 ? Eigen::Vector2d(-out) : out;
  }

 private:
  Grid<Eigen::Vector2d> doubled_;
};

struct Area {
  const OutlineSearch& ply;
  const Box& box;
  bool contains(const Eigen::Vector2d& xy) const {
    const bool in_box = (xy.array() >= box.low.array()).all() && (xy.array() <= box.high.array()).all();
    return in_box && (ply.empty() || ply.inside(xy));
  }
};

struct Followed {
  std::vector<Eigen::Vector2f> points;
  bool to_edge = false;  // the area ended, not the known angles
};

// Follows the field from a seed in one direction with midpoint steps until the area or the known angles end.
Followed follow(const Axes& axes, const Area& area, Eigen::Vector2d xy, Eigen::Vector2d way, double step, long most) {
  Followed out;
  while (static_cast<long>(out.points.size()) < most) {
    const auto here = axes.along(xy, way);
    if (!here) break;
    const auto midway = axes.along(xy + 0.5 * step * *here, *here);
    if (!midway) break;
    xy += step * *midway, way = *midway;
    if (!area.contains(xy)) {
      out.to_edge = !area.ply.empty();
      break;
    }
    out.points.push_back(xy.cast<float>());
  }
  return out;
}

}  // namespace

std::vector<FibreLine> straight_lines(const std::array<double, 2>& angles, const Polygon& ply, const Box& box,
                                      const FibreOptions& options) {
  options.check();
  for (const double angle : angles) require(std::isfinite(angle), "fibre_angles_deg", "finite angles", angle);
  const OutlineSearch outline(ply.empty() ? corners(box) : ply);
  const Box around = bounding_box(outline.polygon());
  const Eigen::Vector2d centre = 0.5 * (around.low + around.high);
  const double reach = 0.5 * (around.high - around.low).norm();
  std::vector<FibreLine> out;
  for (int family = 0; family < 2; ++family) {
    const Eigen::Vector2d way(std::cos(angles[family]), std::sin(angles[family])), across(-way.y(), way.x());
    const int lines = static_cast<int>(reach / options.apart) + 1;
    for (int n = -lines; n <= lines; ++n) {
      const Eigen::Vector2d from = centre + n * options.apart * across;
      const std::vector<double> cuts = crossings(outline, from, way);
      for (std::size_t k = 0; k + 1 < cuts.size(); k += 2) {
        // The points lie on one raster along the family, so that a window of the map has those of the whole.
        const double low = std::ceil(cuts[k] / options.step), high = std::floor(cuts[k + 1] / options.step);
        if (high - low < 1) continue;
        FibreLine line;
        line.family = family, line.way = way, line.step = options.step, line.to_edge = {!ply.empty(), !ply.empty()};
        line.first = from + low * options.step * way, line.count = static_cast<int>(high - low) + 1;
        out.push_back(std::move(line));
      }
    }
  }
  return out;
}

std::vector<FibreLine> field_lines(const AngleField& angles, const Polygon& ply, const Box& box, const FibreOptions& options,
                                   const Stop& stop) {
  options.check();
  require(angles.nx > 0 && angles.ny > 0, "fibre_angles_deg", "a grid with values", angles.size());
  const Box around = ply.empty() ? box : bounding_box(ply);
  const OutlineSearch outline(ply);
  const Area area{outline, around};
  const Eigen::Vector2d size = around.high - around.low;
  const int nx = static_cast<int>(size.x() / options.apart) + 1, ny = static_cast<int>(size.y() / options.apart) + 1;
  const long most = static_cast<long>(4 * size.norm() / options.step) + 1;  // a line that turns round and round is ended
  std::vector<FibreLine> out;
  for (int family = 0; family < 2; ++family) {
    const Axes axes(angles, family);
    Grid<std::uint8_t> crossed(nx, ny, around.low + Eigen::Vector2d::Constant(0.5 * options.apart), options.apart);
    const auto mark = [&](const Eigen::Vector2d& xy) {
      const Eigen::Vector2d at = crossed.locate(xy);
      const int i = static_cast<int>(std::lround(at.x())), j = static_cast<int>(std::lround(at.y()));
      if (crossed.contains(i, j)) crossed.at(i, j) = 1;
    };
    for (int j = 0; j < ny; ++j) {
      if (stop.now()) throw Stopped("the lines along the fibres were not all followed");
      for (int i = 0; i < nx; ++i) {
        const Eigen::Vector2d seed = crossed.position(i, j);
        if (crossed.at(i, j) || !area.contains(seed)) continue;
        const auto way = axes.along(seed, Eigen::Vector2d::UnitX());
        if (!way) continue;
        Followed back = follow(axes, area, seed, -*way, options.step, most);
        const Followed on = follow(axes, area, seed, *way, options.step, most);
        std::vector<Eigen::Vector2f>& points = back.points;
        std::reverse(points.begin(), points.end());
        points.push_back(seed.cast<float>());
        points.insert(points.end(), on.points.begin(), on.points.end());
        for (const Eigen::Vector2f& point : points) mark(point.cast<double>());
        mark(seed);
        if (points.size() < 2) continue;
        FibreLine line;
        line.family = family, line.way = *way, line.step = options.step, line.to_edge = {back.to_edge, on.to_edge};
        line.first = points.front().cast<double>(), line.count = static_cast<int>(points.size()), line.points = std::move(points);
        out.push_back(std::move(line));
      }
    }
  }
  return out;
}

}  // namespace debulk
