#pragma once

#include <vector>

#include <Eigen/Core>

namespace debulk {

// Corners in the XY plane, in order, in mm; closed implicitly: the first corner is not repeated at the end.
// Or several rings one after another, each of which ends with its first corner again: the outline of a ply with cut-outs.
// From one ring to the next leads no side, and what lies in an even number of them is outside.
using Polygon = std::vector<Eigen::Vector2d>;

// The corners of one ring, from `begin` to before `end`; the corner that closes it is not among them.
struct Ring {
  std::size_t begin, end;
};

// The rings of an outline; a single polygon is one, whatever its corners touch.
std::vector<Ring> rings(const Polygon& polygon);

// Calls body(a, b) for every side in order, the closing one of each ring last. For many points one search of the sides
// is faster (outline_search.hpp).
template <class Body>
void for_sides(const Polygon& polygon, const Body& body) {
  for (const Ring& ring : rings(polygon))
    for (std::size_t k = ring.begin; k < ring.end; ++k) body(polygon[k], polygon[k + 1 == ring.end ? ring.begin : k + 1]);
}

// Signed area, mm2: positive if the corners run counter-clockwise; 0 for fewer than three corners.
double polygon_area(const Polygon& polygon);

// Centroid of the area; the mean of the corners if the area is 0.
Eigen::Vector2d polygon_centroid(const Polygon& polygon);

double polygon_perimeter(const Polygon& polygon);

// Even-odd rule. A point exactly on the outline may count as inside or outside.
bool inside(const Polygon& polygon, const Eigen::Vector2d& point);

// Distance to the nearest point of the outline, from inside and outside alike; infinite for an empty polygon.
double distance_to_outline(const Polygon& polygon, const Eigen::Vector2d& point);

// The point inside that is farthest from the outline, to about a thousandth of the outline's size. The polygon must
// have an area.
Eigen::Vector2d deepest_point(const Polygon& polygon);

struct Box {
  Eigen::Vector2d low = Eigen::Vector2d::Zero(), high = Eigen::Vector2d::Zero();
};
Box bounding_box(const Polygon& polygon);

// Rounds the corners to 2^-20 mm (about 1e-6), so that a window of a grid gives the same outline as the whole, to the
// last bit.
Polygon rounded(Polygon polygon);

// Throws InputError unless the polygon has at least three corners, all finite, and an area other than 0. A last corner
// that repeats the first is dropped. The polygon is returned counter-clockwise.
Polygon checked_polygon(Polygon polygon, const char* argument);

}  // namespace debulk
