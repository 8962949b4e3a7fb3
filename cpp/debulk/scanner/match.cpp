#include "debulk/scanner/match.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace debulk {
namespace {

constexpr double none = std::numeric_limits<double>::quiet_NaN();
constexpr int apart = 8;            // pixels: equal phases further apart than this lie on two surfaces
constexpr double most_shift = 1.5;  // pixels; greatest distance between a pixel and the place that its partner finds

std::size_t at(int i) {
  return static_cast<std::size_t>(i);
}

// Slope of the phase, in rad per pixel, round the segment from j to j + 1. To reduce noise it is taken over three
// segments where they are one surface.
double slope_at(const std::vector<float>& phase, int width, int j, float edge) {
  const double here = phase[at(j + 1)] - phase[at(j)];
  if (j < 1 || j + 2 >= width) return std::abs(here);
  const double before = phase[at(j)] - phase[at(j - 1)], after = phase[at(j + 2)] - phase[at(j + 1)];
  if (!(std::abs(before) <= edge && std::abs(after) <= edge)) return std::abs(here);
  return std::abs(before + here + after) / 3;
}

}  // namespace

MatchCounts& MatchCounts::operator+=(const MatchCounts& other) {
  seen += other.seen, matched += other.matched, unmatched += other.unmatched;
  ambiguous += other.ambiguous, behind += other.behind;
  return *this;
}

void PhaseIndex::build(const std::vector<float>& phase, int width, float step, float edge) {
  phase_ = phase.data(), edge_ = edge, count_ = 0;
  float low = std::numeric_limits<float>::infinity(), high = -low;
  for (int i = 0; i < width; ++i) {
    const float p = phase[at(i)];
    if (p < low) low = p;
    if (p > high) high = p;
  }
  if (!(low < high) || !(step > 0)) return;
  // About one segment per bin. The number of bins is limited, so that a row of stray phases does not take all memory.
  count_ = static_cast<int>(std::min<double>(4.0 * width, std::ceil((high - low) / step))) + 1;
  low_ = low, per_rad_ = static_cast<float>(count_ - 1) / (high - low);
  places_.assign(at(count_), {std::numeric_limits<int>::max(), -1});
  for (int j = 0; j + 1 < width; ++j) {
    const float a = phase[at(j)], b = phase[at(j + 1)];
    if (!(std::abs(b - a) <= edge)) continue;
    const int from = static_cast<int>((std::min(a, b) - low_) * per_rad_), to = static_cast<int>((std::max(a, b) - low_) * per_rad_);
    for (int k = from; k <= to; ++k) {
      Place& place = places_[at(k)];
      place.first = std::min(place.first, j), place.last = j;
    }
  }
}

double PhaseIndex::find(float phase) const {
  const float bin = (phase - low_) * per_rad_;
  if (!(count_ > 0 && bin >= 0 && bin < static_cast<float>(count_))) return none;
  const Place& place = places_[at(static_cast<int>(bin))];
  double first = none, last = none;
  const auto look = [&](int j) {
    const float a = phase_[j] - phase, b = phase_[j + 1] - phase;
    if (!(std::abs(b - a) <= edge_) || a * b > 0 || a == b) return;
    last = j + static_cast<double>(a) / (static_cast<double>(a) - b);
    if (first != first) first = last;
  };
  for (int j = place.first; j <= place.last; ++j) look(j);
  // Noise makes a phase recur within a few pixels. If the places are further apart, one of them is not on this
  // surface.
  return last - first > apart ? -1.0 : 0.5 * (first + last);
}

MatchCounts RowMatcher::match(const RectifiedRow& left, int left_width, float left_step, float left_edge, const RectifiedRow& right,
                              int right_width, float right_step, float right_edge, float* disparity, float* sigma) {
  left_.build(left.phase, left_width, left_step, left_edge);
  right_.build(right.phase, right_width, right_step, right_edge);
  MatchCounts counts;
  auto bridged = left.bridged.begin();
  for (int i = 0; i < left_width; ++i) {
    disparity[i] = sigma[i] = std::numeric_limits<float>::quiet_NaN();
    const float phase = left.phase[at(i)];
    if (bridged != left.bridged.end() && *bridged == i) {
      ++bridged;
      continue;
    }
    if (phase != phase) continue;
    ++counts.seen;
    const double x = right_.find(phase);
    if (x != x) {
      ++counts.unmatched;
      continue;
    }
    // The left row, searched for the phase of the partner, must give this pixel again.
    const int nearest = static_cast<int>(x + 0.5);
    const double back = x < 0 ? -1.0 : left_.find(right.phase[at(nearest)]);
    if (!(back >= 0)) {
      ++(x < 0 || back < 0 ? counts.ambiguous : counts.unmatched);
      continue;
    }
    // A place exactly on a pixel belongs to the segment before it if no segment begins there. The mean of two places
    // belongs to no segment if they lie on both sides of a gap.
    int j = static_cast<int>(x);
    const auto surface = [&](int k) { return k + 1 < right_width && std::abs(right.phase[at(k + 1)] - right.phase[at(k)]) <= right_edge; };
    if (j > 0 && x == j && !surface(j)) --j;
    const double slope = surface(j) ? slope_at(right.phase, right_width, j, right_edge) : 0;
    if (!(slope > 0)) {
      ++counts.ambiguous;
      continue;
    }
    const double own = i + 1 < left_width ? std::abs(left.phase[at(i + 1)] - phase) : none;
    const double stretch = own > 0.25 * slope && own < 4 * slope ? slope / own : 1;
    if (std::abs(back - i - (nearest - x) * stretch) > most_shift) {
      ++counts.ambiguous;
      continue;
    }
    ++counts.matched;
    disparity[i] = static_cast<float>(i - x);
    // The phase was interpolated twice along the row, by the rectification and here, which gives the weights of three
    // pixels.
    const double t = x - j, f = right.fraction[at(j)], g = left.fraction[at(i)];
    const double w0 = (1 - t) * (1 - f), w2 = t * f, w1 = 1 - w0 - w2;
    const double l = left.noise[at(i)], r = right.noise[at(j)];
    const double variance = l * l * ((1 - g) * (1 - g) + g * g) + r * r * (w0 * w0 + w1 * w1 + w2 * w2);
    sigma[i] = static_cast<float>(std::sqrt(variance) / slope);
  }
  return counts;
}

}  // namespace debulk
