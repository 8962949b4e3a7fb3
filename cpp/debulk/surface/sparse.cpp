#include "debulk/surface/sparse.hpp"

#include <algorithm>
#include <cmath>

#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

constexpr int reach = 2;     // pixels to each side
constexpr int least_of = 3;  // one of so many pixels has to be seen
constexpr long strip_rows = 64;

bool seen_at(const CloudView& cloud, int i, int j) {
  return cloud.seen(static_cast<std::size_t>(j) * static_cast<std::size_t>(cloud.width) + static_cast<std::size_t>(i));
}

// Adds a row's pixels that were seen to the number of each column, or takes them off; a row beyond the image has none.
void add_row(const CloudView& cloud, int row, int sign, std::vector<int>& number) {
  if (row < 0 || row >= cloud.height) return;
  for (int i = 0; i < cloud.width; ++i) number[static_cast<std::size_t>(i)] += seen_at(cloud, i, row) ? sign : 0;
}

}  // namespace

std::vector<Eigen::Vector2f> sparse_places(const CloudView& cloud, int threads, const Stop& stop) {
  std::vector<std::vector<Eigen::Vector2f>> of_strip(static_cast<std::size_t>((cloud.height + strip_rows - 1) / strip_rows));
  parallel_for(cloud.height, strip_rows, threads, stop, [&](long begin, long end) {
    std::vector<Eigen::Vector2f>& out = of_strip[static_cast<std::size_t>(begin / strip_rows)];
    std::vector<int> seen(static_cast<std::size_t>(cloud.width));  // of each column, in the rows round the one looked at
    for (int j = static_cast<int>(begin) - reach; j < begin + reach; ++j) add_row(cloud, j, 1, seen);
    for (int j = static_cast<int>(begin); j < end; ++j) {
      add_row(cloud, j + reach, 1, seen);
      add_row(cloud, j - reach - 1, j > begin ? -1 : 0, seen);
      const int rows = std::min(cloud.height - 1, j + reach) - std::max(0, j - reach) + 1;
      for (int i = 0; i < cloud.width; ++i) {
        const int left = std::max(0, i - reach), right = std::min(cloud.width - 1, i + reach);
        int count = 0;
        for (int k = left; k <= right; ++k) count += seen[static_cast<std::size_t>(k)];
        if (least_of * count >= rows * (right - left + 1)) continue;
        if (seen_at(cloud, i, j)) out.emplace_back(cloud.point(i, j)[0], cloud.point(i, j)[1]);
      }
    }
  });
  std::vector<Eigen::Vector2f> out;
  for (const auto& strip : of_strip) out.insert(out.end(), strip.begin(), strip.end());
  return out;
}

void clear_round(const std::vector<Eigen::Vector2f>& places, double reach_mm, Grid<std::uint8_t>& marks) {
  for (const Eigen::Vector2f& place : places) {
    const Eigen::Vector2d at = (place.cast<double>() - marks.origin) / marks.spacing;
    const double cells = reach_mm / marks.spacing;
    const auto first = [&](double v) { return static_cast<int>(std::clamp(std::ceil(v - cells), 0.0, 1e9)); };
    const auto last = [&](double v, int n) { return static_cast<int>(std::clamp(std::floor(v + cells), -1.0, n - 1.0)); };
    for (int j = first(at.y()); j <= last(at.y(), marks.ny); ++j)
      for (int i = first(at.x()); i <= last(at.x(), marks.nx); ++i) marks.at(i, j) = 0;
  }
}

}  // namespace debulk
