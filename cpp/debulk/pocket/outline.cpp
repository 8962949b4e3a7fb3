#include "debulk/pocket/outline.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace debulk {
namespace {

// Corners of a cell, counter-clockwise; side k runs from corner k to corner k + 1.
constexpr int kDi[4] = {0, 1, 1, 0};
constexpr int kDj[4] = {0, 0, 1, 1};

// A piece of border through one cell, from one grid line to another, the region on its left.
struct Segment {
  long from, to;          // numbers of the grid lines
  Eigen::Vector2d point;  // where it crosses `from`
};

struct Vertex {
  Eigen::Vector2d point;  // grid units
  double height;
};

class Tracer {
 public:
  Tracer(const Grid<std::int32_t>& labels, int count, const Grid<float>& heights, double level, const PlyMask& ply)
      : labels_(labels), heights_(heights), level_(level), ply_(ply), out_(static_cast<std::size_t>(count)), segments_(out_.size()) {}

  std::vector<Outline> trace() {
    Extent above;
    for (int j = -1; j < labels_.ny; ++j) {  // only where a label is near
      const Extent below = extent(j + 1);
      for (int i = std::min(above.first, below.first) - 1; i <= std::max(above.last, below.last); ++i) visit(i, j);
      above = below;
    }
    for (std::size_t k = 0; k < out_.size(); ++k) {
      out_[k].volume *= labels_.spacing * labels_.spacing;
      stitch(segments_[k], out_[k].polygon);
    }
    return std::move(out_);
  }

 private:
  // Columns between which a row is labelled; none: first > last + 1.
  struct Extent {
    int first = std::numeric_limits<int>::max(), last = -1;
  };
  Extent extent(int j) const {
    if (j < 0 || j >= labels_.ny) return {};
    const std::int32_t* row = &labels_.values[labels_.index(0, j)];
    int first = 0, last = labels_.nx - 1;
    while (first <= last && row[first] <= 0) ++first;
    while (last >= first && row[last] <= 0) --last;
    return first <= last ? Extent{first, last} : Extent{};
  }

  std::int32_t label(int i, int j) const {
    if (!labels_.contains(i, j)) return 0;
    const std::int32_t l = labels_.at(i, j);
    return l > 0 ? l : 0;
  }

  void visit(int i, int j) {
    std::array<std::int32_t, 4> corners;
    for (std::size_t k = 0; k < 4; ++k) corners[k] = label(i + kDi[k], j + kDj[k]);
    const auto [low, high] = std::minmax_element(corners.begin(), corners.end());
    if (*high == 0) return;
    if (*low == *high) {
      double sum = 0;
      for (std::size_t k = 0; k < 4; ++k) sum += heights_.at(i + kDi[k], j + kDj[k]);
      region(*low).volume += sum / 4;
      return;
    }
    for (std::size_t k = 0; k < 4; ++k)
      if (corners[k] > 0 &&
          std::find(corners.begin(), corners.begin() + static_cast<long>(k), corners[k]) == corners.begin() + static_cast<long>(k))
        cut(i, j, corners, corners[k]);
  }

  // Going round the cell, every exit from the region joins the next entry: diagonal corners are connected.
  void cut(int i, int j, const std::array<std::int32_t, 4>& corners, std::int32_t id) {
    std::array<Vertex, 8> part;  // of the cell that belongs to the region
    std::array<long, 8> line{};  // grid line of a crossing, -1 at a corner
    std::size_t n = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const std::size_t next = (k + 1) % 4;
      const int ai = i + kDi[k], aj = j + kDj[k], bi = i + kDi[next], bj = j + kDj[next];
      const bool a_in = corners[k] == id, b_in = corners[next] == id;
      if (a_in) {
        line[n] = -1;
        part[n++] = {{ai, aj}, heights_.at(ai, aj)};
      }
      if (a_in == b_in) continue;
      line[n] = line_number(std::min(ai, bi), std::min(aj, bj), ai == bi);
      part[n++] = a_in ? crossing(ai, aj, bi - ai, bj - aj, id) : crossing(bi, bj, ai - bi, aj - bj, id);
    }
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t next = (k + 1) % n;
      if (line[k] >= 0 && line[next] >= 0)
        segments_[static_cast<std::size_t>(id - 1)].push_back(
            {line[k], line[next], labels_.position(part[k].point.x(), part[k].point.y())});
    }
    for (std::size_t k = 1; k + 1 < n; ++k) {  // a fan of triangles, the height linear on each
      const Eigen::Vector2d a = part[k].point - part[0].point, b = part[k + 1].point - part[0].point;
      region(id).volume += (a.x() * b.y() - a.y() * b.x()) / 6 * (part[0].height + part[k].height + part[k + 1].height);
    }
  }

  // Where the border crosses the grid line from the region's point (i, j) to its neighbour outside.
  Vertex crossing(int i, int j, int di, int dj, std::int32_t id) {
    const int bi = i + di, bj = j + dj;
    const double a = heights_.at(i, j);
    double t = 0.5, height = a;
    if (!labels_.contains(bi, bj)) {
      region(id).at_grid_border = true;
    } else if (!ply_.on_ply(bi, bj)) {
      region(id).at_ply_edge = true;
      t = ply_.crossing(i, j, di, dj);
      if (label(i - di, j - dj) == id) height += t * (a - heights_.at(i - di, j - dj));
    } else if (const double b = heights_.at(bi, bj); std::isnan(b)) {
      region(id).at_unknown = true;
    } else if (b >= level_) {
      region(id).at_neighbour = true;
      height = (a + b) / 2;
    } else if (a >= level_) {
      t = (a - level_) / (a - b);
      height = level_;
    }
    t = std::clamp(t, 1e-6, 1 - 1e-6);  // no two corners at the same place
    return {{i + t * di, j + t * dj}, height};
  }

  long line_number(int i, int j, bool upright) const { return 2 * ((j + 1L) * (labels_.nx + 2L) + i + 1) + (upright ? 1 : 0); }

  Outline& region(std::int32_t id) { return out_[static_cast<std::size_t>(id - 1)]; }

  // Chains the segments to loops and keeps the outer one, which has the largest area.
  static void stitch(std::vector<Segment>& segments, Polygon& outer) {
    const auto by_line = [](const Segment& a, const Segment& b) { return a.from < b.from; };
    std::sort(segments.begin(), segments.end(), by_line);
    std::vector<std::uint8_t> used(segments.size(), 0);
    double largest = 0;
    for (std::size_t first = 0; first < segments.size(); ++first) {
      Polygon loop;
      for (std::size_t k = first; !used[k];) {
        used[k] = 1;
        loop.push_back(segments[k].point);
        k = static_cast<std::size_t>(std::lower_bound(segments.begin(), segments.end(), Segment{segments[k].to, 0, {}}, by_line) -
                                     segments.begin());
      }
      const double area = polygon_area(loop);
      if (area <= largest) continue;
      largest = area;
      outer = std::move(loop);
    }
  }

  const Grid<std::int32_t>& labels_;
  const Grid<float>& heights_;
  double level_;
  const PlyMask& ply_;
  std::vector<Outline> out_;
  std::vector<std::vector<Segment>> segments_;
};

}  // namespace

std::vector<Outline> trace_outlines(const Grid<std::int32_t>& labels, int count, const Grid<float>& heights, double level,
                                    const PlyMask& ply) {
  return Tracer(labels, count, heights, level, ply).trace();
}

}  // namespace debulk
