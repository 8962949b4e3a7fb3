#include "debulk/pocket/hump_tops.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "debulk/core/median.hpp"

namespace debulk {
namespace {

constexpr double kSeen = 0.9;  // of hump and ring
constexpr int kEvery = 2;      // cells of the ring along each axis: a top is only a place to measure
constexpr int kBeside = 5;     // neighbours of a line on each side

// A value of a ring, as columns and rows from its centre, and its weight in the prediction of the centre.
struct RingValue {
  int a, b;
  float weight;
};

// The weights by which a quadratic surface through a ring predicts its centre. By symmetry the terms 1 and u² + v² alone
// decide, and their normal equations have a closed form.
std::vector<RingValue> ring_weights(double radius, int reach) {
  std::vector<RingValue> ring;
  const auto squared = [&](const RingValue& v) { return (v.a * v.a + v.b * v.b) / (radius * radius); };
  double s = 0, ss = 0;
  for (int b = -reach; b <= reach; b += kEvery)
    for (int a = -reach; a <= reach; a += kEvery) {
      const double q = squared({a, b, 0});
      if (q > 1 && q <= kRingEnd * kRingEnd) ring.push_back({a, b, 0}), s += q, ss += q * q;
    }
  const auto n = static_cast<double>(ring.size());
  for (RingValue& v : ring) v.weight = static_cast<float>((ss - s * squared(v)) / (n * ss - s * s));
  return ring;
}

// How far each cell stands above what the ring round it predicts. Unknown heights are 0, as is what lies outside.
Grid<float> above_rings(const Grid<float>& heights, double radius, int reach) {
  const std::vector<RingValue> ring = ring_weights(radius, reach);
  Grid<float> out = heights;
  for (int j = 0; j < heights.ny; ++j) {
    float* to = &out.at(0, j);
    for (const RingValue& v : ring) {
      if (j + v.b < 0 || j + v.b >= heights.ny) continue;
      const float* from = &heights.at(0, j + v.b);
      const int begin = std::max(0, -v.a), end = std::min(heights.nx, heights.nx - v.a);
      for (int i = begin; i < end; ++i) to[i] -= v.weight * from[i + v.a];
    }
  }
  return out;
}

// Which share of the disc of hump and ring is known round a cell.
class SeenRound {
 public:
  SeenRound(const Grid<float>& heights, double radius) : nx_(heights.nx), ny_(heights.ny), before_(heights.size() + heights.ny, 0) {
    for (int j = 0; j < ny_; ++j)
      for (int i = 0; i < nx_; ++i) at(i + 1, j) = at(i, j) + std::isfinite(heights.at(i, j));
    for (int b = 0; b <= kRingEnd * radius; ++b) half_.push_back(static_cast<int>(std::sqrt(std::pow(kRingEnd * radius, 2) - b * b)));
  }
  double operator()(int i, int j) {
    int known = 0, whole = 0;
    const int reach = static_cast<int>(half_.size()) - 1;
    for (int b = -reach; b <= reach; ++b) {
      const int a = half_[static_cast<std::size_t>(std::abs(b))];
      whole += 2 * a + 1;
      if (j + b >= 0 && j + b < ny_) known += at(std::min(nx_, i + a + 1), j + b) - at(std::max(0, i - a), j + b);
    }
    return static_cast<double>(known) / whole;
  }

 private:
  int nx_, ny_;
  std::vector<int> before_;  // known cells of the row before each one
  std::vector<int> half_;    // columns of the disc on each side, by rows from its middle

  int& at(int i, int j) { return before_[static_cast<std::size_t>(j) * (nx_ + 1) + i]; }
};

// The distances along a line, in steps, from which a parabola predicts its middle, and their weights.
struct LineSteps {
  std::vector<int> steps;
  std::vector<float> weights;

  LineSteps(double radius) {
    const int first = static_cast<int>(std::ceil(radius)), last = std::max(first, static_cast<int>(std::nearbyint(kRingEnd * radius)));
    for (const int k : {first, (first + last) / 2, last})
      if (steps.empty() || k != steps.back()) steps.push_back(k);
    double s = 0, ss = 0;
    for (const int k : steps) s += double(k) * k, ss += std::pow(k, 4);
    const auto n = static_cast<double>(steps.size());
    const double determinant = n * ss - s * s;  // one distance alone gives a mean
    for (const int k : steps) weights.push_back(static_cast<float>(steps.size() == 1 ? 0.5 : 0.5 * (ss - s * k * k) / determinant));
  }
};

// How far each place stands above the calmest of the lines through it, and which of kWays that is.
//
// A line predicts a place by a parabola through what lies one radius and more off on both sides. It is calm if its
// neighbours predict their places: on a surface that is straight in one direction, as a spar is, such lines are calm.
struct AboveLines {
  Grid<float> above;
  std::vector<std::uint8_t> ways;

  AboveLines(const Grid<float>& heights, double radius)
      : above(heights.like<float>()), ways(heights.size(), 0), calmest_(heights.like(std::numeric_limits<float>::infinity())) {
    for (std::size_t k = 0; k < kWays.size(); ++k) try_way(heights, radius, k);
  }

 private:
  Grid<float> calmest_;

  void try_way(const Grid<float>& heights, double radius, std::size_t number) {
    const Way way = kWays[number];
    const double length = std::hypot(way.right, way.down);
    const Grid<float> over = above_line(heights, way, LineSteps(radius / length));
    for (int j = 0; j < heights.ny; ++j)
      for (int i = 0; i < heights.nx; ++i) {
        const float here = over.at(i, j);
        if (!(here > static_cast<float>(kLeastHump))) continue;
        const float most = std::min(static_cast<float>(kRingOff) * here, calmest_.at(i, j));
        const float off = beside(over, i, j, way, radius / length, most);
        if (!(off <= kRingOff * here) || !(off < calmest_.at(i, j))) continue;
        calmest_.at(i, j) = off, above.at(i, j) = here;
        ways[heights.index(i, j)] = static_cast<std::uint8_t>(number);
      }
  }

  static Grid<float> above_line(const Grid<float>& heights, Way way, const LineSteps& line) {
    Grid<float> out = heights;
    for (std::size_t n = 0; n < line.steps.size(); ++n)
      for (const int k : {-line.steps[n], line.steps[n]}) {
        const int a = k * way.right, b = k * way.down;
        for (int j = 0; j < heights.ny; ++j) {
          float* to = &out.at(0, j);
          const bool inside = j + b >= 0 && j + b < heights.ny;
          const int begin = inside ? std::clamp(-a, 0, heights.nx) : heights.nx, end = std::clamp(heights.nx - a, begin, heights.nx);
          std::fill(to, to + begin, std::numeric_limits<float>::quiet_NaN());
          for (int i = begin; i < end; ++i) to[i] -= line.weights[n] * heights.at(i + a, j + b);
          std::fill(to + end, to + heights.nx, std::numeric_limits<float>::quiet_NaN());
        }
      }
    return out;
  }

  // Root mean square of what the neighbours of a line stand above theirs; infinite if one is unknown, or above `most`.
  static float beside(const Grid<float>& over, int i, int j, Way way, double radius, float most) {
    float sum = 0;
    const float limit = 2 * kBeside * most * most;
    for (int n = 0; n < kBeside; ++n)
      for (const int sign : {-1, 1}) {
        const double k = sign * radius * (1 + (kRingEnd - 1) * n / (kBeside - 1));
        const int row = static_cast<int>(std::nearbyint(j + k * way.right)), column = static_cast<int>(std::nearbyint(i - k * way.down));
        if (!over.contains(column, row)) return std::numeric_limits<float>::infinity();
        sum += over.at(column, row) * over.at(column, row);
        if (!(sum <= limit)) return std::numeric_limits<float>::infinity();  // NaN, too
      }
    return std::sqrt(sum / (2 * kBeside));
  }
};

// Whether no value within so many cells along x and along y is larger.
bool is_highest(const Grid<float>& values, int i, int j, int near) {
  for (int b = std::max(0, j - near); b <= std::min(values.ny - 1, j + near); ++b)
    for (int a = std::max(0, i - near); a <= std::min(values.nx - 1, i + near); ++a)
      if (values.at(a, b) > values.at(i, j)) return false;
  return true;
}

}  // namespace

std::vector<HumpTop> hump_tops(const Grid<float>& map, double radius, const PlyMask& ply, std::size_t most) {
  const int reach = static_cast<int>(std::ceil(kRingEnd * radius));
  if (std::min(map.nx, map.ny) < 2 * reach + 1) return {};
  std::vector<float> known;
  for (const float z : map.values)
    if (std::isfinite(z)) known.push_back(z);
  const float level = upper_median(known);
  Grid<float> heights = map.like<float>(), filled = heights;
  for (std::size_t k = 0; k < map.size(); ++k) {
    heights.values[k] = map.values[k] - level;
    filled.values[k] = std::isfinite(map.values[k]) ? heights.values[k] : 0.0F;
  }
  SeenRound seen(heights, radius);
  const int near = std::max(1, static_cast<int>(radius / 2));
  std::vector<HumpTop> out;
  const auto take = [&](const Grid<float>& above, const std::vector<std::uint8_t>* ways) {
    std::vector<std::size_t> found;
    for (int j = 0; j < map.ny; ++j)
      for (int i = 0; i < map.nx; ++i) {
        const std::size_t k = map.index(i, j);
        if (above.values[k] > static_cast<float>(kLeastHump) && ply.on_ply(i, j) && std::isfinite(heights.values[k]) &&
            is_highest(above, i, j, near) && seen(i, j) >= kSeen)
          found.push_back(k);
      }
    std::stable_sort(found.begin(), found.end(), [&](std::size_t a, std::size_t b) { return above.values[a] > above.values[b]; });
    found.resize(std::min(found.size(), most));
    for (const std::size_t k : found) {
      const int i = static_cast<int>(k) % map.nx, j = static_cast<int>(k) / map.nx;
      out.push_back({i, j, ways ? std::optional<std::size_t>((*ways)[k]) : std::nullopt});
    }
  };
  take(above_rings(filled, radius, reach), nullptr);
  const AboveLines lines(heights, radius);
  take(lines.above, &lines.ways);
  return out;
}

}  // namespace debulk
