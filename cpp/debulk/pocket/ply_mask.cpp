#include "debulk/pocket/ply_mask.hpp"

#include <algorithm>
#include <cmath>

namespace debulk {
namespace {

// For each line v = 0, 1, .. count - 1, the sorted u at which the polygon's sides cross it. By the half-open rule (a
// side owns only its lower end) every list has an even length, even if a corner lies on a line.
std::vector<std::vector<double>> crossings(const Polygon& polygon, int u, int v, int count) {
  std::vector<std::vector<double>> lines(static_cast<std::size_t>(count));
  for_sides(polygon, [&](Eigen::Vector2d a, Eigen::Vector2d b) {
    if (a[v] > b[v]) std::swap(a, b);
    // The value is limited to the lines before it becomes an int, because a corner may lie farther off than an int can
    // hold.
    const int first = static_cast<int>(std::ceil(std::clamp(a[v], 0.0, static_cast<double>(count))));
    const int end = static_cast<int>(std::ceil(std::clamp(b[v], 0.0, static_cast<double>(count))));
    for (int line = first; line < end; ++line)
      lines[static_cast<std::size_t>(line)].push_back(a[u] + (line - a[v]) / (b[v] - a[v]) * (b[u] - a[u]));
  });
  for (auto& line : lines) std::sort(line.begin(), line.end());
  return lines;
}

// Sets `out` to what two sorted lists of intervals have in common.
void in_both(const std::vector<double>& a, const std::vector<double>& b, std::vector<double>& out) {
  out.clear();
  for (std::size_t m = 0, n = 0; m + 1 < a.size() && n + 1 < b.size();) {
    const double begin = std::max(a[m], b[n]), end = std::min(a[m + 1], b[n + 1]);
    if (begin < end) out.insert(out.end(), {begin, end});
    (a[m + 1] < b[n + 1] ? m : n) += 2;
  }
}

// The parts of the rows' intervals that lie `cells` inside them, and inside those of the rows so near.
std::vector<std::vector<double>> inside(const std::vector<std::vector<double>>& rows, int cells) {
  std::vector<std::vector<double>> out(rows.size());
  std::vector<double> common, next;
  const int count = static_cast<int>(rows.size());
  for (int j = 0; j < count; ++j) {
    common = rows[static_cast<std::size_t>(j)];
    for (int n = std::max(0, j - cells); n <= std::min(count - 1, j + cells); ++n) {
      if (n == j) continue;
      in_both(common, rows[static_cast<std::size_t>(n)], next);
      common.swap(next);
    }
    for (std::size_t k = 0; k + 1 < common.size(); k += 2)
      if (common[k] + cells < common[k + 1] - cells)
        out[static_cast<std::size_t>(j)].insert(out[static_cast<std::size_t>(j)].end(), {common[k] + cells, common[k + 1] - cells});
  }
  return out;
}

}  // namespace

PlyMask::PlyMask(const Polygon& outline, int nx, int ny, const Eigen::Vector2d& origin, double spacing, int inner)
    : nx_(nx), on_ply_(static_cast<std::size_t>(nx) * ny, 0) {
  Polygon scaled;
  scaled.reserve(outline.size());
  for (const Eigen::Vector2d& p : outline) scaled.push_back((p - origin) / spacing);
  rows_ = crossings(scaled, 0, 1, ny);
  if (inner > 0) rows_ = inside(rows_, inner);
  columns_ = crossings(scaled, 1, 0, nx);
  for (int j = 0; j < ny; ++j) {
    const auto& row = rows_[static_cast<std::size_t>(j)];
    for (std::size_t k = 0; k + 1 < row.size(); k += 2) {
      const int begin = static_cast<int>(std::ceil(std::clamp(row[k], 0.0, static_cast<double>(nx))));
      const int end = static_cast<int>(std::ceil(std::clamp(row[k + 1], 0.0, static_cast<double>(nx))));
      for (int i = begin; i < end; ++i) on_ply_[static_cast<std::size_t>(j) * nx + i] = 1;
    }
  }
}

bool PlyMask::covers(int j, int first, int end) const {
  if (!known()) return true;
  const auto& row = rows_[static_cast<std::size_t>(j)];
  for (std::size_t k = 0; k + 1 < row.size(); k += 2)
    if (row[k] <= first && row[k + 1] > end - 1) return true;
  return false;
}

double PlyMask::crossing(int i, int j, int di, int dj) const {
  const auto& line = di != 0 ? rows_[static_cast<std::size_t>(j)] : columns_[static_cast<std::size_t>(i)];
  const double from = di != 0 ? i : j, to = di != 0 ? i + di : j + dj;
  double nearest = 2;
  for (const double u : line)
    if (u >= std::min(from, to) && u <= std::max(from, to)) nearest = std::min(nearest, std::abs(u - from));
  // Rows decide which points are on the ply. If a column has no crossing between the two points because of rounding,
  // its crossing lies at one of them, and the middle is taken.
  return nearest <= 1 ? nearest : 0.5;
}

}  // namespace debulk
