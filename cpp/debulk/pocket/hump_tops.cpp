#include "debulk/pocket/hump_tops.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "debulk/core/median.hpp"

namespace debulk {
namespace {

constexpr double kSeen = 0.9;  // of hump and ring
constexpr int kBeside = 5;     // neighbours of a line on each side

// The weight of a value of the ring that is so many radii away, squared, in the prediction of its centre by a quadratic
// surface. By symmetry the terms 1 and u² + v² alone decide, and their normal equations have a closed form.
struct RingWeights {
  double of_one = 0, of_square = 0;
  double operator()(double squared) const { return of_one + of_square * squared; }
};

RingWeights ring_weights(double radius, int reach) {
  double n = 0, s = 0, ss = 0;
  for (int b = -reach; b <= reach; ++b)
    for (int a = -reach; a <= reach; ++a) {
      const double far = std::hypot(a, b) / radius, q = far * far;
      if (far > 1 && far <= kRingEnd) ++n, s += q, ss += q * q;
    }
  const double determinant = n * ss - s * s;
  return {ss / determinant, -s / determinant};
}

// How far each cell stands above what the ring round it predicts. Unknown heights are 0, as is what lies outside.
Grid<float> above_rings(const Grid<float>& heights, double radius, int reach) {
  const RingWeights weights = ring_weights(radius, reach);
  Grid<float> out = heights;
  std::vector<float> framed(static_cast<std::size_t>(heights.nx + 2 * reach));
  for (int j = 0; j < heights.ny; ++j)
    for (int b = -reach; b <= reach; ++b) {
      if (j + b < 0 || j + b >= heights.ny) continue;
      std::copy_n(&heights.at(0, j + b), heights.nx, framed.begin() + reach);
      for (int a = -reach; a <= reach; ++a) {
        const double far = std::hypot(a, b) / radius;
        if (!(far > 1 && far <= kRingEnd)) continue;
        const auto weight = static_cast<float>(weights(far * far));
        const float* from = framed.data() + reach + a;
        float* to = &out.at(0, j);
        for (int i = 0; i < heights.nx; ++i) to[i] -= weight * from[i];
      }
    }
  return out;
}

// Which cells are known, and enough of hump and ring round them.
std::vector<char> seen_round(const Grid<float>& heights, double radius, int reach) {
  const int nx = heights.nx, ny = heights.ny, wide = nx + 1;
  std::vector<int> before(static_cast<std::size_t>(wide) * ny, 0);  // known cells of the row before this one
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      const std::size_t at = static_cast<std::size_t>(j) * wide + i;
      before[at + 1] = before[at] + std::isfinite(heights.at(i, j));
    }
  std::vector<int> half(static_cast<std::size_t>(reach) + 1);
  int whole = 0;
  for (int b = 0; b <= reach; ++b) {
    int& a = half[static_cast<std::size_t>(b)] = -1;
    while (std::hypot(a + 1, b) <= kRingEnd * radius) ++a;
    whole += (b == 0 ? 1 : 2) * (2 * a + 1);
  }
  std::vector<char> out(heights.size(), 0);
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      if (!std::isfinite(heights.at(i, j))) continue;
      int count = 0;
      for (int b = std::max(-reach, -j); b <= std::min(reach, ny - 1 - j); ++b) {
        const int a = half[static_cast<std::size_t>(std::abs(b))];
        const int* row = &before[static_cast<std::size_t>(j + b) * wide];
        count += row[std::min(nx, i + a + 1)] - row[std::max(0, i - a)];
      }
      out[heights.index(i, j)] = count >= kSeen * whole;
    }
  return out;
}

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

// The largest value within `reach` cells along x and along y.
Grid<float> highest_near(const Grid<float>& values, int reach) {
  Grid<float> rows = values, out = values;
  for (int j = 0; j < values.ny; ++j)
    for (int i = 0; i < values.nx; ++i)
      rows.at(i, j) = *std::max_element(&values.at(std::max(0, i - reach), j), &values.at(std::min(values.nx - 1, i + reach), j) + 1);
  for (int j = 0; j < values.ny; ++j)
    for (int b = std::max(0, j - reach); b <= std::min(values.ny - 1, j + reach); ++b)
      for (int i = 0; i < values.nx; ++i) out.at(i, j) = std::max(out.at(i, j), rows.at(i, b));
  return out;
}

}  // namespace

std::vector<HumpTop> hump_tops(const Grid<double>& map, double radius, const std::vector<char>& wanted, std::size_t most) {
  const int reach = static_cast<int>(std::ceil(kRingEnd * radius));
  if (std::min(map.nx, map.ny) < 2 * reach + 1) return {};
  std::vector<double> known;
  for (const double z : map.values)
    if (std::isfinite(z)) known.push_back(z);
  const double level = upper_median(known);
  Grid<float> heights = map.like<float>(), filled = heights;
  for (std::size_t k = 0; k < map.size(); ++k) {
    heights.values[k] = static_cast<float>(map.values[k] - level);
    filled.values[k] = std::isfinite(map.values[k]) ? heights.values[k] : 0.0F;
  }
  const std::vector<char> seen = seen_round(heights, radius, reach);
  const AboveLines lines(heights, radius);
  std::vector<HumpTop> out;
  const auto take = [&](const Grid<float>& above, const std::vector<std::uint8_t>* ways) {
    const Grid<float> highest = highest_near(above, std::max(1, static_cast<int>(radius / 2)));
    std::vector<std::size_t> found;
    for (std::size_t k = 0; k < above.size(); ++k)
      if (seen[k] && wanted[k] && above.values[k] > static_cast<float>(kLeastHump) && above.values[k] >= highest.values[k])
        found.push_back(k);
    std::stable_sort(found.begin(), found.end(), [&](std::size_t a, std::size_t b) { return above.values[a] > above.values[b]; });
    found.resize(std::min(found.size(), most));
    for (const std::size_t k : found) {
      const int i = static_cast<int>(k) % map.nx, j = static_cast<int>(k) / map.nx;
      out.push_back({i, j, ways ? std::optional<std::size_t>((*ways)[k]) : std::nullopt});
    }
  };
  take(above_rings(filled, radius, reach), nullptr);
  take(lines.above, &lines.ways);
  return out;
}

}  // namespace debulk
