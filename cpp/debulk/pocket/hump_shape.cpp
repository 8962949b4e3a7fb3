#include "debulk/pocket/hump_shape.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

#include "debulk/pocket/hump_map.hpp"

namespace debulk {
namespace {

constexpr double kFoot = 0.05;                         // of its height: where a hump begins
constexpr double kWithin = 1.1;                        // radii: what stands farther from the top belongs to the surroundings
constexpr std::array<double, 4> kTurns{6, 6, 6, 1.5};  // degrees: steps from a way to where the surface is straightest
constexpr std::size_t kLeastRing = 30;                 // cells
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

constexpr double radians(double degrees) {
  return degrees * M_PI / 180;
}

struct RingCell {
  int column, row;  // from the top
  double u, v, z;   // radii, and mm
};

// What is below a hump, as the ring round it predicts it.
class Surroundings {
 public:
  bool known() const { return std::isfinite(off_); }
  double off() const { return off_; }  // root mean square of the ring off it
  double operator()(double u, double v, int row) const {
    return of_[0] * u + of_[1] * u * u + of_[2] * u * v + (profile_.empty() ? of_[3] + of_[4] * v + of_[5] * v * v : profile_at(row));
  }

  // Quadratic: the six terms of a paraboloid.
  static Surroundings quadratic(const std::vector<RingCell>& ring) {
    Surroundings out;
    out.fit<6>(
        ring, [](const RingCell& c) { return Eigen::Vector<double, 6>(c.u, c.u * c.u, c.u * c.v, 1, c.v, c.v * c.v); },
        [](const RingCell& c) { return c.z; });
    return out;
  }

  // The surface f(v) + (a + b u + c v) u with any profile f across u; unknown in rows that the ring does not show.
  static Surroundings straight(const std::vector<RingCell>& ring, int reach) {
    using Terms = Eigen::Vector<double, 4>;  // those of u, and the height
    const auto terms = [](const RingCell& c) { return Terms(c.u, c.u * c.u, c.u * c.v, c.z); };
    std::vector<Terms> means(static_cast<std::size_t>(2 * reach + 1), Terms::Zero());
    std::vector<int> counts(means.size(), 0);
    for (const RingCell& c : ring) means[std::size_t(c.row + reach)] += terms(c), ++counts[std::size_t(c.row + reach)];
    for (std::size_t k = 0; k < means.size(); ++k) means[k] /= counts[k];  // NaN for none
    const auto apart = [&](const RingCell& c) { return Terms(terms(c) - means[std::size_t(c.row + reach)]); };
    Surroundings out;
    out.reach_ = reach;
    out.profile_.assign(means.size(), 0.0);
    out.fit<3>(
        ring, [&](const RingCell& c) { return Eigen::Vector<double, 3>(apart(c).head<3>()); },
        [&](const RingCell& c) { return apart(c)(3); });
    for (std::size_t k = 0; k < means.size(); ++k)
      out.profile_[k] = means[k](3) - out.of_[0] * means[k](0) - out.of_[1] * means[k](1) - out.of_[2] * means[k](2);
    return out;
  }

 private:
  double off_ = std::numeric_limits<double>::infinity();
  std::array<double, 6> of_{};  // u, u², u v, and without a profile 1, v, v²
  std::vector<double> profile_;
  int reach_ = 0;

  double profile_at(int row) const { return profile_[std::size_t(row + reach_)]; }

  // Least squares, by the normal equations of few terms.
  template <int N, class Terms, class Value>
  void fit(const std::vector<RingCell>& ring, const Terms& terms, const Value& value) {
    Eigen::Matrix<double, N, N> normal = Eigen::Matrix<double, N, N>::Zero();
    Eigen::Vector<double, N> right = Eigen::Vector<double, N>::Zero();
    for (const RingCell& cell : ring) {
      const Eigen::Vector<double, N> t = terms(cell);
      normal += t * t.transpose(), right += t * value(cell);
    }
    const Eigen::LLT<Eigen::Matrix<double, N, N>> factors(normal);
    if (factors.info() != Eigen::Success) return;
    const Eigen::Vector<double, N> solved = factors.solve(right);
    std::copy_n(solved.data(), N, of_.begin());
    double sum = 0;
    for (const RingCell& cell : ring) sum += std::pow(value(cell) - terms(cell).dot(solved), 2);
    off_ = std::sqrt(sum / static_cast<double>(ring.size()));
  }
};

// The map round a top, turned by an angle, on the squares as far as the ring reaches.
class Turned {
 public:
  Turned(const Grid<float>& map, const HumpTop& top, double radius, double turn)
      : map_(map),
        top_(top),
        radius_(radius),
        reach_(static_cast<int>(std::ceil(kRingEnd * radius))),
        cos_(std::cos(turn)),
        sin_(std::sin(turn)) {}

  int reach() const { return reach_; }
  double height(int column, int row) const {
    return between(map_, top_.i + cos_ * column - sin_ * row, top_.j + sin_ * column + cos_ * row);
  }
  double squared(int column, int row) const { return (column * column + row * row) / (radius_ * radius_); }  // radii

  Surroundings surroundings() const {
    std::vector<RingCell> ring;
    ring.reserve(static_cast<std::size_t>((2 * reach_ + 1) * (2 * reach_ + 1)));
    const double level = map_.at(top_.i, top_.j);  // keeps sums small
    for (int row = -reach_; row <= reach_; ++row)
      for (int column = -reach_; column <= reach_; ++column) {
        const double away = squared(column, row);
        if (!(away > 1 && away <= kRingEnd * kRingEnd)) continue;
        const double z = height(column, row);
        if (std::isfinite(z)) ring.push_back({column, row, column / radius_, row / radius_, z - level});
      }
    if (ring.size() < kLeastRing) return {};
    return top_.way ? Surroundings::straight(ring, reach_) : Surroundings::quadratic(ring);
  }

 private:
  const Grid<float>& map_;
  HumpTop top_;
  double radius_;
  int reach_;
  double cos_, sin_;
};

// The angle at which the surface round a top is straightest: a parabola through the squares of how far the ring is off.
double straightest(const Grid<float>& map, const HumpTop& top, double radius) {
  if (!top.way) return 0;
  const Way way = kWays[*top.way];
  double turn = std::atan2(way.down, way.right);
  for (const double step : kTurns) {
    const auto squared = [&](int k) { return std::pow(Turned(map, top, radius, turn + k * radians(step)).surroundings().off(), 2); };
    const double less = squared(-1), more = squared(1), bend = less + more - 2 * squared(0);
    if (bend > 0 && std::isfinite(bend)) turn += radians(step) * std::clamp(0.5 * (less - more) / bend, -1.0, 1.0);
  }
  return turn;
}

// By how much the longest of the fibres across a hump, at an angle in the turned map, is longer than what is below.
double excess_along(const Grid<float>& upper, const Grid<float>& lower, int reach, double angle, double cell) {
  const double c = std::cos(angle), s = std::sin(angle);
  const auto length = [&](double rise) { return std::sqrt(rise * rise + cell * cell); };
  double most = 0;
  for (int beside = -(reach / 2); beside <= reach / 2; ++beside) {
    double sum = 0, above = kNan, below = kNan;
    for (int k = 0; k <= 2 * reach + 1; ++k) {
      const double along = k - reach - 0.5, x = reach + along * c - beside * s, y = reach + along * s + beside * c;
      const double high = between(upper, x, y), low = between(lower, x, y);
      const double longer = length(high - above) - length(low - below);
      if (std::isfinite(longer)) sum += longer;
      above = high, below = low;
    }
    most = std::max(most, sum);
  }
  return most;
}

}  // namespace

std::optional<HumpShape> hump_shape(const Grid<float>& map, const HumpTop& top, double radius, const std::vector<double>& angles) {
  const double turn = straightest(map, top, radius), level = map.at(top.i, top.j);
  const Turned turned(map, top, radius, turn);
  const Surroundings below = turned.surroundings();
  if (!below.known()) return std::nullopt;
  const double height = turned.height(0, 0) - below(0, 0, 0) - level;
  if (!(height >= kLeastHump) || below.off() > kRingOff * height) return std::nullopt;
  const int reach = turned.reach();
  Grid<float> lower(2 * reach + 1, 2 * reach + 1, Eigen::Vector2d::Zero(), map.spacing), upper = lower;
  int half = 0;
  for (int row = -reach; row <= reach; ++row)
    for (int column = -reach; column <= reach; ++column) {
      const double ground = below(column / radius, row / radius, row), stands = turned.height(column, row) - ground - level;
      const double lifted = turned.squared(column, row) > kWithin * kWithin || stands <= kFoot * height ? 0.0 : stands;  // NaN stays
      lower.at(column + reach, row + reach) = static_cast<float>(ground);
      upper.at(column + reach, row + reach) = static_cast<float>(ground + lifted);
      half += lifted > height / 2;
    }
  double excess = 0;
  for (const double angle : angles) excess = std::max(excess, excess_along(upper, lower, reach, radians(angle) - turn, map.spacing));
  return HumpShape{height, half * map.spacing * map.spacing, excess};
}

}  // namespace debulk
