#include "debulk/sheet/angle_term.hpp"

#include <algorithm>
#include <cmath>

namespace debulk {
namespace {

constexpr int kPlaces = 6;  // a corner adds to six blocks: (a, a), (b, b), (a, b), (a, node), (b, node), (node, node)

Eigen::Matrix3d symmetric(const CornerBatch::Lane* lanes, int k) {
  Eigen::Matrix3d m;
  m << lanes[0][k], lanes[1][k], lanes[2][k], lanes[1][k], lanes[3][k], lanes[4][k], lanes[2][k], lanes[4][k], lanes[5][k];
  return m;
}

}  // namespace

int AngleTerm::load(const Points& x, std::size_t first, Order order, CornerBatch& batch) const {
  const int count = static_cast<int>(std::min<std::size_t>(CornerBatch::capacity, corners_.size() - first));
  for (int k = 0; k < count; ++k) {
    const Corner& corner = corners_[first + static_cast<std::size_t>(k)];
    const Eigen::Vector3d &at = x[static_cast<std::size_t>(corner.node)], &a = x[static_cast<std::size_t>(corner.a)],
                          &b = x[static_cast<std::size_t>(corner.b)];
    for (int i = 0; i < 3; ++i) {
      batch.u[i][k] = a[i] - at[i];
      batch.v[i][k] = sign_ * (b[i] - at[i]);
    }
  }
  function_(batch, count, stiffness_, order);
  return count;
}

double AngleTerm::value(const Points& x) const {
  CornerBatch batch;
  double sum = 0;
  for (std::size_t first = 0; first < corners_.size(); first += CornerBatch::capacity) {
    const int count = load(x, first, Order::value, batch);
    for (int k = 0; k < count; ++k) sum += batch.value[k];
  }
  return sum;
}

double AngleTerm::add_gradient(const Points& x, Points& gradient) const {
  CornerBatch batch;
  double sum = 0;
  for (std::size_t first = 0; first < corners_.size(); first += CornerBatch::capacity) {
    const int count = load(x, first, Order::gradient, batch);
    for (int k = 0; k < count; ++k) {
      const Corner& corner = corners_[first + static_cast<std::size_t>(k)];
      const Eigen::Vector3d at_a(batch.by_u[0][k], batch.by_u[1][k], batch.by_u[2][k]);
      const Eigen::Vector3d at_b = sign_ * Eigen::Vector3d(batch.by_v[0][k], batch.by_v[1][k], batch.by_v[2][k]);
      gradient[static_cast<std::size_t>(corner.a)] += at_a;
      gradient[static_cast<std::size_t>(corner.b)] += at_b;
      gradient[static_cast<std::size_t>(corner.node)] -= at_a + at_b;
      sum += batch.value[k];
    }
  }
  return sum;
}

double AngleTerm::largest_force(const Points& x) const {
  CornerBatch batch;
  double largest = 0;
  for (std::size_t first = 0; first < corners_.size(); first += CornerBatch::capacity) {
    const int count = load(x, first, Order::gradient, batch);
    for (int k = 0; k < count; ++k)
      for (const CornerBatch::Lane* force : {batch.by_u, batch.by_v})
        largest = std::max(largest, std::hypot(force[0][k], force[1][k], force[2][k]));
  }
  return largest;
}

void AngleTerm::add_hessian(const Points& x, const Places& places, BlockMatrix& hessian) const {
  CornerBatch batch;
  for (std::size_t first = 0; first < corners_.size(); first += CornerBatch::capacity) {
    const int count = load(x, first, Order::hessian, batch);
    for (int k = 0; k < count; ++k) {
      const auto& [node, a, b] = corners_[first + static_cast<std::size_t>(k)];
      const int* place = &places[kPlaces * (first + static_cast<std::size_t>(k))];
      const Eigen::Matrix3d aa = symmetric(batch.by_uu, k), bb = symmetric(batch.by_vv, k);
      Eigen::Matrix3d ab;
      for (int i = 0; i < 9; ++i) ab(i / 3, i % 3) = sign_ * batch.by_uv[i][k];
      hessian.add(place[0], a, a, aa);
      hessian.add(place[1], b, b, bb);
      hessian.add(place[2], a, b, ab);
      hessian.add(place[3], a, node, -aa - ab);
      hessian.add(place[4], b, node, -bb - ab.transpose());
      hessian.add(place[5], node, node, aa + ab + ab.transpose() + bb);
    }
  }
}

std::vector<std::array<int, 3>> AngleTerm::groups() const {
  std::vector<std::array<int, 3>> out;
  for (const Corner& corner : corners_) out.push_back({corner.node, corner.a, corner.b});
  return out;
}

Places AngleTerm::places(const BlockMatrix& pattern) const {
  Places out;
  for (const auto& [node, a, b] : corners_)
    for (const auto& [i, j] : {std::pair{a, a}, {b, b}, {a, b}, {a, node}, {b, node}, {node, node}}) out.push_back(pattern.slot(i, j));
  return out;
}

}  // namespace debulk
