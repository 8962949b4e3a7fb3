#include "debulk/rawscan/riders.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>

#include <Eigen/Cholesky>

#include "debulk/pocket/foot_heights.hpp"

namespace debulk {
namespace {

// A point over the foot, its height above the reference, and its height above the filtered heights.
struct Standing {
  Eigen::Vector2d xy;
  double height, out;
};

constexpr std::size_t kBetweenLooks = 4096;  // points from one test of the stop to the next

void look_at(const Stop& stop) {
  if (stop.now()) throw Stopped("the search for bumps on pockets was stopped");
}

std::vector<Standing> over_foot(const CloudView& points, const FootHeights& heights, const Surface& reference, double highest,
                                const Stop& stop) {
  std::vector<Standing> out;
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (k % kBetweenLooks == 0) look_at(stop);
    const float* p = points.point(k);
    const Eigen::Vector2d xy(p[0], p[1]);
    if (!points.seen(k) || !heights.on_foot(xy)) continue;
    const double height = p[2] - reference.height(xy), by = height - heights.at(xy);
    if (std::abs(by) < highest) out.push_back({xy, height, by});  // false for NaN, where the heights are not known
  }
  return out;
}

// Returns the standard deviation, estimated from the median absolute value, which a bump hardly shifts.
double noise_of(const std::vector<Standing>& points) {
  std::vector<double> sizes;
  for (const Standing& p : points) sizes.push_back(std::abs(p.out));
  const auto middle = sizes.begin() + static_cast<long>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return 1.4826 * *middle;
}

// Numbers of points close to a top and near it, and how many of them stand out or lie as deep below.
struct Around {
  int close = 0, close_out = 0;
  int near = 0, out = 0, sunk = 0;
};

Around around(const std::vector<Standing>& points, const Eigen::Vector2d& top, double close_mm, double least, const RiderOptions& o) {
  Around a;
  for (const Standing& p : points) {
    const double away = (p.xy - top).norm();
    if (away < close_mm) ++a.close, a.close_out += p.out > least;
    if (away >= 2 * o.wide_mm) continue;
    ++a.near, a.out += p.out > least, a.sunk += p.out < -least;
  }
  return a;
}

// The paraboloid through the points in a ring round a top: the ply without the bump. The filtered heights do not serve
// for this, since they still contain part of the bump.
class Without {
 public:
  Without(const std::vector<Standing>& points, const Eigen::Vector2d& top, double inner, double outer) : top_(top), scale_(outer) {
    Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Identity() * 1e-9;
    Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
    for (const Standing& p : points) {
      const double away = (p.xy - top).norm();
      if (away < inner || away > outer) continue;
      const Eigen::Matrix<double, 6, 1> row = terms(p.xy);
      normal += row * row.transpose(), right += p.height * row, ++count_;
    }
    factors_ = normal.ldlt().solve(right);
  }
  bool known() const { return count_ >= 24; }  // four times the number of factors
  double at(const Eigen::Vector2d& xy) const { return factors_.dot(terms(xy)); }

 private:
  Eigen::Matrix<double, 6, 1> terms(const Eigen::Vector2d& xy) const {
    const double u = (xy - top_).x() / scale_, v = (xy - top_).y() / scale_;
    return (Eigen::Matrix<double, 6, 1>() << 1, u, v, u * u, u * v, v * v).finished();
  }

  Eigen::Vector2d top_;
  double scale_;
  int count_ = 0;
  Eigen::Matrix<double, 6, 1> factors_;
};

}  // namespace

std::vector<Rider> riders(const CloudView& points, double pitch_mm, const FootMap& feet, const Foot& foot, const Surface& reference,
                          const RiderOptions& options, const Stop& stop) {
  const std::vector<Standing> over = over_foot(points, FootHeights(feet, foot), reference, options.highest_mm, stop);
  if (over.empty()) return {};
  const double least = std::max(options.stands_out_mm, options.noise * noise_of(over));
  std::vector<Standing> left;
  std::copy_if(over.begin(), over.end(), std::back_inserter(left), [&](const Standing& p) { return p.out > least; });
  std::stable_sort(left.begin(), left.end(), [](const Standing& a, const Standing& b) { return a.out > b.out; });
  std::vector<Rider> found;
  while (static_cast<int>(left.size()) >= options.fewest) {
    look_at(stop);
    const Eigen::Vector2d top = left.front().xy;
    left.erase(std::remove_if(left.begin(), left.end(), [&](const Standing& p) { return (p.xy - top).norm() < 2 * options.wide_mm; }),
               left.end());
    const Around a = around(over, top, options.top_mm * std::max(1.0, pitch_mm), least, options);
    if (a.out < options.fewest || a.close_out < options.out_share * a.close || a.sunk > options.sunk_share * a.near) continue;
    const Without ply(over, top, options.ring_mm, 2 * options.ring_mm);
    std::vector<double> stands;
    for (const Standing& p : over)
      if ((p.xy - top).norm() < options.ring_mm) stands.push_back(ply.known() ? p.height - ply.at(p.xy) : p.out);
    if (stands.size() < 2) continue;
    std::nth_element(stands.begin(), stands.begin() + 1, stands.end(), std::greater<>());
    const double height = stands[1];  // the highest may be a flying point
    // The width is the diameter of a disc, from the area of the points above half the height.
    const auto half = std::count_if(stands.begin(), stands.end(), [&](double one) { return one > 0.5 * height; });
    const double wide = 2 * std::sqrt(4 / std::acos(-1.0) * static_cast<double>(half)) * pitch_mm;
    if (wide >= options.wide_mm) found.push_back({top, height, wide});
  }
  return found;
}

}  // namespace debulk
