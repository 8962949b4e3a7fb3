#include "debulk/pocket/outline.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

// Corners of a cell, counter-clockwise. Side k runs from corner k to corner k + 1.
constexpr int kDi[4] = {0, 1, 1, 0};
constexpr int kDj[4] = {0, 0, 1, 1};

// A piece of border through one cell, from one grid line to another, with the component on its left.
struct Segment {
  long from, to;          // numbers of the grid lines
  Eigen::Vector2d point;  // where the border crosses `from`
};

struct Vertex {
  Eigen::Vector2d point;  // grid units
  double height;
};

// Traces one component after another.
class Tracer {
 public:
  Tracer(const Grid<std::int32_t>& labels, const Grid<float>& heights, double level, const PlyMask& ply, bool with_volume)
      : labels_(labels), heights_(heights), level_(level), ply_(ply), with_volume_(with_volume) {}

  Outline trace(const Run* begin, const Run* end, std::int32_t id) {
    out_ = Outline();
    id_ = id;
    segments_.clear();
    if (begin == end) return out_;
    const Run* above = begin;  // the runs of row j, then those of row j + 1
    const Run* below = begin;
    const Run* behind = begin;
    for (int j = begin->row - 1; j <= (end - 1)->row; ++j) {
      above = below, below = behind;
      while (behind != end && behind->row == j + 1) ++behind;
      cells(j, above, below, behind);
    }
    out_.volume *= labels_.spacing * labels_.spacing;
    stitch();
    return std::move(out_);
  }

 private:
  // Does the cells between the rows j and j + 1, which have the runs [above, below) and [below, behind).
  void cells(int j, const Run* above, const Run* below, const Run* behind) {
    const Run* const last_above = below;
    int i = std::numeric_limits<int>::max(), last = -2;
    if (above != below) i = std::min(i, above->begin - 1), last = std::max(last, (below - 1)->end - 1);
    if (below != behind) i = std::min(i, below->begin - 1), last = std::max(last, (behind - 1)->end - 1);
    for (; i <= last; ++i) {
      while (above != last_above && above->end <= i) ++above;
      while (below != behind && below->end <= i) ++below;
      const bool over = above != last_above, under = below != behind;
      if (over && under && above->begin <= i && below->begin <= i) {  // whole cells, as far as both runs go
        const int to = std::min(above->end, below->end) - 1;
        if (with_volume_) add_volume(i, to, j);
        i = std::max(i, to);
      } else {  // empty cells up to the next run
        const int next = std::min(over ? above->begin : last + 1, under ? below->begin : last + 1) - 1;
        if (i < next) i = next;
      }
      if (i <= last) cut(i, j);
    }
  }

  void add_volume(int first, int end, int j) {
    const float *row = &heights_.at(0, j), *next = &heights_.at(0, j + 1);
    double volume = out_.volume;
    for (int i = first; i < end; ++i) {
      const double sum = 0.0 + row[i] + row[i + 1] + next[i + 1] + next[i];
      volume += sum / 4;
    }
    out_.volume = volume;
  }

  bool ours(int i, int j) const { return labels_.contains(i, j) && labels_.at(i, j) == id_; }

  // Going round the cell, every exit from the component is joined to the next entry, so diagonal corners are
  // connected.
  void cut(int i, int j) {
    std::array<bool, 4> in;
    for (std::size_t k = 0; k < 4; ++k) in[k] = ours(i + kDi[k], j + kDj[k]);
    std::array<Vertex, 8> part;  // the part of the cell that belongs to the component
    std::array<long, 8> line{};  // grid line of a crossing; -1 at a corner
    std::size_t n = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const std::size_t next = (k + 1) % 4;
      const int ai = i + kDi[k], aj = j + kDj[k], bi = i + kDi[next], bj = j + kDj[next];
      const bool a_in = in[k], b_in = in[next];
      if (a_in) {
        line[n] = -1;
        part[n++] = {{ai, aj}, heights_.at(ai, aj)};
      }
      if (a_in == b_in) continue;
      line[n] = line_number(std::min(ai, bi), std::min(aj, bj), ai == bi);
      part[n++] = a_in ? crossing(ai, aj, bi - ai, bj - aj) : crossing(bi, bj, ai - bi, aj - bj);
    }
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t next = (k + 1) % n;
      if (line[k] >= 0 && line[next] >= 0)
        segments_.push_back({line[k], line[next], labels_.position(part[k].point.x(), part[k].point.y())});
    }
    for (std::size_t k = 1; with_volume_ && k + 1 < n; ++k) {  // a fan of triangles, with the height linear on each
      const Eigen::Vector2d a = part[k].point - part[0].point, b = part[k + 1].point - part[0].point;
      out_.volume += (a.x() * b.y() - a.y() * b.x()) / 6 * (part[0].height + part[k].height + part[k + 1].height);
    }
  }

  // Where the border crosses the grid line from the component's point (i, j) to its neighbour outside.
  Vertex crossing(int i, int j, int di, int dj) {
    const int bi = i + di, bj = j + dj;
    const double a = heights_.at(i, j);
    double t = 0.5, height = a;
    if (!labels_.contains(bi, bj)) {
      out_.at_grid_border = true;
    } else if (!ply_.on_ply(bi, bj)) {
      out_.at_ply_edge = true;
      t = ply_.crossing(i, j, di, dj);
      if (ours(i - di, j - dj)) height += t * (a - heights_.at(i - di, j - dj));
    } else if (const double b = heights_.at(bi, bj); std::isnan(b)) {
      out_.at_unknown = true;
    } else if (b >= level_) {
      out_.at_neighbour = true;
      height = (a + b) / 2;
    } else if (a >= level_) {
      t = (a - level_) / (a - b);
      height = level_;
    }
    t = std::clamp(t, 1e-6, 1 - 1e-6);  // so that no two corners are at the same place
    return {{i + t * di, j + t * dj}, height};
  }

  long line_number(int i, int j, bool upright) const { return 2 * ((j + 1L) * (labels_.nx + 2L) + i + 1) + (upright ? 1 : 0); }

  // Chains the segments into loops and keeps the outer one, which has the largest area.
  void stitch() {
    const auto by_line = [](const Segment& a, const Segment& b) { return a.from < b.from; };
    std::sort(segments_.begin(), segments_.end(), by_line);
    std::vector<std::uint8_t> used(segments_.size(), 0);
    double largest = 0;
    for (std::size_t first = 0; first < segments_.size(); ++first) {
      Polygon loop;
      for (std::size_t k = first; !used[k];) {
        used[k] = 1;
        loop.push_back(segments_[k].point);
        k = static_cast<std::size_t>(std::lower_bound(segments_.begin(), segments_.end(), Segment{segments_[k].to, 0, {}}, by_line) -
                                     segments_.begin());
      }
      const double area = polygon_area(loop);
      if (area <= largest) continue;
      largest = area;
      out_.polygon = std::move(loop);
    }
  }

  const Grid<std::int32_t>& labels_;
  const Grid<float>& heights_;
  double level_;
  const PlyMask& ply_;
  bool with_volume_;
  Outline out_;
  std::int32_t id_ = 0;
  std::vector<Segment> segments_;
};

}  // namespace

std::vector<Outline> trace_outlines(const Components& components, const Grid<std::int32_t>& labels, const Grid<float>& heights,
                                    double level, const PlyMask& ply, int threads, const Stop& stop, bool with_volume) {
  std::vector<Outline> out(static_cast<std::size_t>(components.count()));
  parallel_for(components.count(), 1, threads, stop, [&](long first, long) {
    const auto k = static_cast<std::size_t>(first);
    out[k] = Tracer(labels, heights, level, ply, with_volume)
                 .trace(components.begin(k), components.end(k), static_cast<std::int32_t>(first) + 1);
  });
  return out;
}

}  // namespace debulk
