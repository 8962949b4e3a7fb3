#include "debulk/scanner/row_shift.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "debulk/core/error.hpp"
#include "debulk/core/median.hpp"
#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

constexpr int size = 2 * patch_half + 1, pixels = size * size, shifts = 2 * row_reach + 1;
constexpr double least_seen = 0.9;      // share of a patch's pixels that have a point
constexpr double least_texture = 0.02;  // root mean square of the logarithm
constexpr double least_beside = -0.9;   // correlation one row up and down, which are interpolated
constexpr float least_light = 1e-6f;    // grey values; keeps the logarithm finite
constexpr float nan = std::numeric_limits<float>::quiet_NaN();

using Patch = std::array<double, pixels>;
using Columns = std::array<float, pixels>;

// Interpolates between four values of an image; NaN where one of them lies outside. value(row * width + column)
template <class Value>
float interpolated(float x, float y, int width, int height, const Value& value) {
  if (!(x >= 0 && y >= 0 && x < static_cast<float>(width - 1) && y < static_cast<float>(height - 1))) return nan;
  const int i = static_cast<int>(x), j = static_cast<int>(y);
  const float u = x - static_cast<float>(i), v = y - static_cast<float>(j);
  const std::size_t at = static_cast<std::size_t>(j) * static_cast<std::size_t>(width) + static_cast<std::size_t>(i);
  const std::size_t below = at + static_cast<std::size_t>(width);
  const float upper = value(at) + u * (value(at + 1) - value(at)), lower = value(below) + u * (value(below + 1) - value(below));
  return upper + v * (lower - upper);
}

// The logarithm of the light at a place of the image as it was taken.
double logarithm(const SeenTexture& seen, float x, float y) {
  const auto light = [&](std::size_t at) {
    return seen.modulation[at] / seen.brightness[std::min<std::size_t>(seen.exposure[at], seen.brightness.size() - 1)];
  };
  const float found = interpolated(x, y, seen.width, seen.height, light);
  return found == found ? std::log(std::max(found, least_light)) : found;
}

// Takes out the mean and the slopes along rows and columns.
void level(Patch& patch) {
  double mean = 0, down = 0, across = 0, squares = 0;
  for (int i = 0; i < pixels; ++i) {
    const double value = patch[static_cast<std::size_t>(i)];
    mean += value, down += (i / size - patch_half) * value, across += (i % size - patch_half) * value;
  }
  for (int k = -patch_half; k <= patch_half; ++k) squares += size * k * k;
  mean /= pixels, down /= squares, across /= squares;
  for (int i = 0; i < pixels; ++i)
    patch[static_cast<std::size_t>(i)] -= mean + (i / size - patch_half) * down + (i % size - patch_half) * across;
}

double dot(const Patch& a, const Patch& b) {
  double sum = 0;
  for (std::size_t i = 0; i < pixels; ++i) sum += a[i] * b[i];
  return sum;
}

// The columns in the right image at which the patch's points lie; false if too few pixels have a point. For the others the
// median of the depths is taken.
bool matched_columns(const PatchPlace& place, int step, const RowMatches& matches, Columns& columns) {
  std::vector<float> known;
  for (int i = 0; i < pixels; ++i) {
    const int row = place.row + (i / size - patch_half) * step, column = place.column + (i % size - patch_half) * step;
    const std::size_t at = static_cast<std::size_t>(row) * static_cast<std::size_t>(matches.width) + static_cast<std::size_t>(column);
    const float depth = columns[static_cast<std::size_t>(i)] = matches.points[3 * at + 2];
    if (std::isfinite(depth)) known.push_back(depth);
  }
  if (static_cast<double>(known.size()) < least_seen * pixels) return false;
  const std::size_t half = known.size() / 2;
  float median = select(known, half);
  if (known.size() % 2 == 0) median = 0.5f * (median + *std::max_element(known.begin(), known.begin() + static_cast<std::ptrdiff_t>(half)));
  for (int i = 0; i < pixels; ++i) {
    float& column = columns[static_cast<std::size_t>(i)];
    const float disparity = matches.depth_px / (std::isfinite(column) ? column : median) - matches.shift;
    column = static_cast<float>(place.column + (i % size - patch_half) * step - static_cast<double>(disparity));
  }
  return true;
}

RowShift shift_of(const PatchPlace& place, int step, const RowMatches& matches, const SeenTexture& left, const SeenTexture& right) {
  Columns columns;
  if (!matched_columns(place, step, matches, columns)) return {};
  Patch own, other;
  for (int i = 0; i < pixels; ++i) {
    const int row = place.row + (i / size - patch_half) * step, column = place.column + (i % size - patch_half) * step;
    const std::size_t at = static_cast<std::size_t>(row) * static_cast<std::size_t>(matches.width) + static_cast<std::size_t>(column);
    own[static_cast<std::size_t>(i)] = logarithm(left, left.map_x[at], left.map_y[at]);
  }
  level(own);
  const double texture = dot(own, own);
  if (!(texture >= least_texture * least_texture * pixels)) return {};
  std::array<double, shifts> score{};
  for (int s = 0; s < shifts; ++s) {
    for (int i = 0; i < pixels; ++i) {
      const std::size_t at = static_cast<std::size_t>(i);
      const float row = static_cast<float>(place.row + (s - row_reach + i / size - patch_half) * step);
      const auto mapped = [&](const float* map) {
        return interpolated(columns[at], row, right.rectified_width, matches.height, [&](std::size_t k) { return map[k]; });
      };
      other[at] = logarithm(right, mapped(right.map_x), mapped(right.map_y));
    }
    level(other);
    const double found = dot(other, own) / std::sqrt(dot(other, other) * texture + 1e-300);
    score[static_cast<std::size_t>(s)] = found == found ? found : -1;
  }
  const std::size_t best = static_cast<std::size_t>(std::max_element(score.begin(), score.end()) - score.begin());
  if (best == 0 || best == shifts - 1 || score[best - 1] < least_beside || score[best + 1] < least_beside) return {true, 0, 0};
  const double before = score[best - 1], after = score[best + 1], bend = before - 2 * score[best] + after;
  return {true, score[best], step * (static_cast<double>(best) - row_reach + (bend < 0 ? 0.5 * (before - after) / bend : 0))};
}

}  // namespace

std::vector<RowShift> row_shifts(const std::vector<PatchPlace>& places, int step, const RowMatches& matches, const SeenTexture& left,
                                 const SeenTexture& right, int threads, const Stop& stop) {
  require(step >= 1, "step", "1 or more", step);
  require(left.rectified_width == matches.width, "left", "maps as wide as the points", left.rectified_width);
  for (const SeenTexture* seen : {&left, &right}) require(!seen->brightness.empty(), "brightness", "that of each exposure", 0);
  std::vector<RowShift> out(places.size());
  const int half = patch_half * step;
  parallel_for(static_cast<long>(places.size()), 1, threads, stop, [&](long begin, long end) {
    for (long k = begin; k < end; ++k) {
      const PatchPlace& place = places[static_cast<std::size_t>(k)];
      if (place.column >= half && place.row >= half && place.column + half < matches.width && place.row + half < matches.height)
        out[static_cast<std::size_t>(k)] = shift_of(place, step, matches, left, right);
    }
  });
  return out;
}

}  // namespace debulk
