#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "debulk/sheet/corner_batch.hpp"
#include "debulk/sheet/term.hpp"

namespace debulk {

// The stiffness over two times the sum over springs of theta^2, where theta is an angle at `Count` different nodes. A
// subclass gives the angle (`Law`) and the nodes of its springs.
template <int Count>
class SpringTerm : public Term {
 public:
  using Nodes = std::array<int, Count>;
  using Corners = std::array<Eigen::Vector3d, Count>;
  struct Angle {  // theta with derivatives by the nodes' coordinates, up to the order asked for
    double theta;
    Eigen::Matrix<double, 3 * Count, 1> gradient;
    Eigen::Matrix<double, 3 * Count, 3 * Count> hessian;
  };
  using Law = Angle (*)(const Corners&, Order);

  SpringTerm(Law law, double stiffness, std::vector<Nodes> springs) : law_(law), stiffness_(stiffness), springs_(std::move(springs)) {}

  double value(const Points& x) const override {
    double sum = 0;
    for (const Nodes& nodes : springs_) sum += energy(law_(corners(x, nodes), Order::value));
    return sum;
  }
  double add_gradient(const Points& x, Points& gradient) const override {
    double sum = 0;
    for (const Nodes& nodes : springs_) {
      const Angle at = law_(corners(x, nodes), Order::gradient);
      for (int k = 0; k < Count; ++k)
        gradient[static_cast<std::size_t>(nodes[static_cast<std::size_t>(k)])] +=
            stiffness_ * at.theta * at.gradient.template segment<3>(3 * k);
      sum += energy(at);
    }
    return sum;
  }
  double largest_force(const Points& x) const override {
    double largest = 0;
    for (const Nodes& nodes : springs_) {
      const Angle at = law_(corners(x, nodes), Order::gradient);
      for (int k = 0; k < Count; ++k)
        largest = std::max(largest, stiffness_ * std::abs(at.theta) * at.gradient.template segment<3>(3 * k).norm());
    }
    return largest;
  }
  void add_hessian(const Points& x, const Places& places, BlockMatrix& hessian) const override {
    std::size_t next = 0;
    for (const Nodes& nodes : springs_) {
      const Angle at = law_(corners(x, nodes), Order::hessian);
      for (int a = 0; a < Count; ++a)
        for (int b = 0; b <= a; ++b) {
          const Eigen::Matrix3d block =
              stiffness_ * (at.gradient.template segment<3>(3 * a) * at.gradient.template segment<3>(3 * b).transpose() +
                            at.theta * at.hessian.template block<3, 3>(3 * a, 3 * b));
          hessian.add(places[next++], nodes[static_cast<std::size_t>(a)], nodes[static_cast<std::size_t>(b)], block);
        }
    }
  }
  std::vector<std::array<int, 3>> groups() const override {
    std::vector<std::array<int, 3>> out;
    for_pairs([&](int i, int j) { out.push_back({i, j, j}); });
    return out;
  }
  Places places(const BlockMatrix& pattern) const override {
    Places out;
    for_pairs([&](int i, int j) { out.push_back(pattern.slot(i, j)); });
    return out;
  }

 private:
  static Corners corners(const Points& x, const Nodes& nodes) {
    Corners out;
    for (std::size_t k = 0; k < nodes.size(); ++k) out[k] = x[static_cast<std::size_t>(nodes[k])];
    return out;
  }
  double energy(const Angle& at) const { return stiffness_ / 2 * at.theta * at.theta; }
  template <class Body>
  void for_pairs(const Body& body) const {
    for (const Nodes& nodes : springs_)
      for (std::size_t a = 0; a < nodes.size(); ++a)
        for (std::size_t b = 0; b <= a; ++b) body(nodes[a], nodes[b]);
  }

  Law law_;
  double stiffness_;
  std::vector<Nodes> springs_;
};

}  // namespace debulk
