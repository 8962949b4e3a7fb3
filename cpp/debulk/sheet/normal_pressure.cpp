#include "debulk/sheet/normal_pressure.hpp"

#include <map>
#include <utility>

#include <Eigen/Geometry>

#include "debulk/core/error.hpp"
#include "debulk/sheet/axis_angle.hpp"

namespace debulk {

NormalPressure::NormalPressure(double pressure_mpa, const std::vector<Neighbours>& neighbours, const Points& start) : start_(start) {
  const int count = static_cast<int>(neighbours.size());
  double area_above = 0;
  for (int i = 0; i < count; ++i)
    for (const auto& [one, other] : {std::pair{east, north}, {north, west}, {west, south}, {south, east}}) {
      const int a = neighbours[static_cast<std::size_t>(i)][one], b = neighbours[static_cast<std::size_t>(i)][other];
      if (a < 0 || b < 0) continue;
      faces_.push_back({{i, a, b}, pressure_mpa / 2});
      const Eigen::Vector3d& at = start[static_cast<std::size_t>(i)];
      area_above += (start[static_cast<std::size_t>(a)] - at).cross(start[static_cast<std::size_t>(b)] - at).z();
    }
  require(!faces_.empty(), "pressure_direction", "\"vertical\" for a net without a corner of two fibres", "\"normal\"");
  // A second fibre to the right of the first makes all triangles clockwise.
  if (area_above < 0)
    for (Face& face : faces_) std::swap(face.corners[1], face.corners[2]);

  std::map<std::pair<int, int>, double> rim;  // pressure of each edge (i, j), i < j, that does not cancel
  for (const Face& face : faces_)
    for (std::size_t k = 0; k < 3; ++k) {
      const int i = face.corners[k], j = face.corners[(k + 1) % 3];
      rim[std::minmax(i, j)] += i < j ? face.pressure : -face.pressure;
    }
  for (const auto& [edge, pressure] : rim) {
    if (pressure == 0) continue;
    const auto [i, j] = edge;
    const int was_i = i + count, was_j = j + count;
    for (const std::array<int, 3>& corners :
         {std::array{was_i, was_j, j}, std::array{was_i, j, i}, std::array{was_i, was_j, i}, std::array{was_j, j, i}})
      faces_.push_back({corners, pressure / 2});
  }
  at_start_ = potential(start);
}

Eigen::Vector3d NormalPressure::corner(const Points& x, int number) const {
  const auto k = static_cast<std::size_t>(number);
  return (k < x.size() ? x[k] : start_[k - x.size()]) - start_.front();
}

double NormalPressure::potential(const Points& x) const {
  double sum = 0;
  for (const auto& [corners, pressure] : faces_)
    sum += pressure / 6 * corner(x, corners[0]).dot(corner(x, corners[1]).cross(corner(x, corners[2])));
  return sum;
}

double NormalPressure::value(const Points& x) const {
  return potential(x) - at_start_;
}

double NormalPressure::add_gradient(const Points& x, Points& gradient) const {
  for (const auto& [corners, pressure] : faces_)
    for (std::size_t k = 0; k < 3; ++k)
      if (static_cast<std::size_t>(corners[k]) < x.size())
        gradient[static_cast<std::size_t>(corners[k])] +=
            pressure / 6 * corner(x, corners[(k + 1) % 3]).cross(corner(x, corners[(k + 2) % 3]));
  return value(x);
}

template <class Body>
void NormalPressure::for_pairs(const Body& body) const {
  const int count = static_cast<int>(start_.size());
  for (const Face& face : faces_)
    for (std::size_t k = 0; k < 3; ++k) {
      const int i = face.corners[k], j = face.corners[(k + 1) % 3];
      if (i < count && j < count) body(i, j, face, face.corners[(k + 2) % 3]);
    }
}

// By p and q of det(p, q, r): the matrix of v -> v x r.
void NormalPressure::add_hessian(const Points& x, const Places& places, BlockMatrix& hessian) const {
  std::size_t next = 0;
  for_pairs([&](int i, int j, const Face& face, int third) {
    hessian.add(places[next++], i, j, -face.pressure / 6 * cross_matrix(corner(x, third)));
  });
}

std::vector<std::array<int, 3>> NormalPressure::groups() const {
  std::vector<std::array<int, 3>> out;
  for_pairs([&](int i, int j, const Face&, int) { out.push_back({i, j, j}); });
  return out;
}

Places NormalPressure::places(const BlockMatrix& pattern) const {
  Places out;
  for_pairs([&](int i, int j, const Face&, int) { out.push_back(pattern.slot(i, j)); });
  return out;
}

}  // namespace debulk
