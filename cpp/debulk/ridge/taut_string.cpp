#include "debulk/ridge/taut_string.hpp"

#include <algorithm>
#include <cmath>

namespace debulk {
namespace {

constexpr double kLeastRadius = 1.0;  // mm; over a smaller radius a ply 0.3 mm thick does not act as a string
constexpr int kHalvings = 12;         // bisections of the logarithm of the radius, which is then exact to 0.3 % or better

}  // namespace

// When s^2 / 2 R is subtracted from all heights, an arc of radius R becomes a straight line, and the string is the
// upper convex hull of the mold's points.
TautString taut_string(const MoldSection& mold, double radius) {
  TautString out;
  out.radius = radius;
  const int count = static_cast<int>(mold.heights.size());
  const auto z = [&mold](int k) { return mold.heights[static_cast<std::size_t>(k)]; };
  const auto arc = [&mold, radius](int k) { return mold.step * k * mold.step * k / (2 * radius); };
  std::vector<int> on;
  for (int k = 0; k < count; ++k) {
    const double at_k = z(k) - arc(k);
    while (on.size() > 1) {
      const int a = on[on.size() - 2], b = on.back();
      const double at_a = z(a) - arc(a), at_b = z(b) - arc(b);
      if ((at_b - at_a) * (k - a) > (at_k - at_a) * (b - a)) break;
      on.pop_back();
    }
    on.push_back(k);
  }
  for (std::size_t n = 1; n < on.size(); ++n) {
    const int a = on[n - 1], b = on[n];
    if (b == a + 1) continue;  // the string lies on the mold
    const double at_a = z(a) - arc(a), slope = (z(b) - arc(b) - at_a) / (b - a);
    double before = z(a);
    for (int k = a + 1; k <= b; ++k) {
      const double string = k == b ? z(b) : at_a + slope * (k - a) + arc(k);
      out.lacks += std::hypot(mold.step, z(k) - z(k - 1)) - std::hypot(mold.step, string - before);
      out.gap = std::max(out.gap, string - z(k));
      before = string;
    }
  }
  return out;
}

TautString taut_string_lacking(const MoldSection& mold, double lacks, double most) {
  if (lacks <= 0 || most <= 0) return {};
  TautString high = taut_string(mold, most);
  double low = std::log(std::min(kLeastRadius, most));
  for (int k = 0; k < kHalvings && high.lacks >= lacks; ++k) {
    const double middle = 0.5 * (low + std::log(high.radius));
    const TautString tried = taut_string(mold, std::exp(middle));
    if (tried.lacks < lacks)
      low = middle;
    else
      high = tried;
  }
  return high;
}

}  // namespace debulk
