#include "debulk/fibre/gaps_along.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>

#include "debulk/core/parallel.hpp"
#include "debulk/core/simd.hpp"

namespace debulk {
namespace {

constexpr long kChunk = 16;  // lines
constexpr std::int32_t kOutside = -1;

struct TileGrid {
  double x, y, spacing, last_column, last_row;
  int columns;
};
struct TileValues {
  const float *fine, *coarse, *mold;
};
struct StraightLine {
  double x, y, way_x, way_y, step;
};

#define DEBULK_KERNEL "debulk/fibre/along_kernel.inl"
#include "debulk/core/simd_dispatch.inl"

TileGrid grid_of(const GapTiles& tiles) {
  const Grid<float>& h = tiles.heights();
  return {h.origin.x(), h.origin.y(), h.spacing, h.nx - 1.0, h.ny - 1.0, tiles.columns()};
}

// Points of lines, in memory that is used again.
class Places {
 public:
  explicit Places(Isa isa) : isa_(isa) {}

  std::vector<double> x, y, left_x, left_y;

  void set(const FibreLine& line, const Stretch& stretch) {
    const int count = stretch.end - stretch.first;
    for (std::vector<double>* values : {&x, &y}) values->resize(static_cast<std::size_t>(count));
    if (line.points.empty()) {
      const StraightLine straight{line.first.x(), line.first.y(), line.way.x(), line.way.y(), line.step};
      DEBULK_ON(isa_, place(straight, stretch.first, count, x.data(), y.data()));
    } else {
      for (int k = 0; k < count; ++k) {
        const Eigen::Vector2d xy = line.at(stretch.first + k);
        x[static_cast<std::size_t>(k)] = xy.x(), y[static_cast<std::size_t>(k)] = xy.y();
      }
    }
  }

  // The unit vectors to the left of each point's step to the next; the last point has that of the step before.
  void set_left(const FibreLine& line, const Stretch& stretch) {
    left_x.assign(x.size(), -line.way.y()), left_y.assign(x.size(), line.way.x());
    if (line.points.empty()) return;
    for (int k = stretch.first; k < stretch.end; ++k) {
      const int from = std::min(k, line.count - 2);
      const Eigen::Vector2d way = (line.at(from + 1) - line.at(from)).normalized();
      const auto n = static_cast<std::size_t>(k - stretch.first);
      left_x[n] = -way.y(), left_y[n] = way.x();
    }
  }

 private:
  Isa isa_;
};

class CourseFinder {
 public:
  CourseFinder(const GapTiles& tiles, bool whole, const FibreOptions& options)
      : tiles_(tiles), grid_(grid_of(tiles)), whole_(whole), options_(options), places_(options.isa) {}

  LineCourse find(const FibreLine& line) {
    LineCourse out;
    const Grid<float>& heights = tiles_.heights();
    // Heights beside the ply's edge may be partly the mold's; the ply goes on there as it came.
    const int edge = static_cast<int>(std::ceil(tiles_.edge_mm() / line.step));
    const int low = std::min(line.to_edge[0] ? edge : 0, line.count);
    const int high = std::max(low, line.count - (line.to_edge[1] ? edge : 0));
    Stretch seen = points_within(line, {heights.origin, heights.position(heights.nx - 1, heights.ny - 1)});
    seen = {std::clamp(seen.first, low, high), std::clamp(seen.end, low, high)};
    if (seen.first >= seen.end) seen = {low, low};
    if (whole_) add_unknown({low, seen.first}, out);
    const int count = seen.end - seen.first;
    places_.set(line, seen), tile_.resize(static_cast<std::size_t>(count));
    DEBULK_ON(options_.isa, find_tiles(grid_, places_.x.data(), places_.y.data(), count, tile_.data()));
    for (int k = 0; k < count;) {
      const int first = k;
      const std::int32_t tile = tile_[static_cast<std::size_t>(k)];
      while (k < count && tile_[static_cast<std::size_t>(k)] == tile) ++k;
      add(tile, {seen.first + first, seen.first + k}, seen.first, out);
    }
    if (whole_) add_unknown({seen.end, high}, out);
    return out;
  }

 private:
  void add(std::int32_t tile, const Stretch& stretch, int from, LineCourse& out) const {
    const std::int32_t number = tile == kOutside ? GapTiles::kFlat : tiles_.numbers()[static_cast<std::size_t>(tile)];
    if (number >= 0) {
      out.raised.push_back({stretch, 0, number});
    } else if (tile == kOutside) {
      if (whole_) add_unknown(stretch, out);
    } else if (number == GapTiles::kGaps) {
      const Grid<float>& h = tiles_.heights();
      for (int k = stretch.first; k < stretch.end; ++k) {
        const auto n = static_cast<std::size_t>(k - from);
        const int i = static_cast<int>((places_.x[n] - grid_.x) / grid_.spacing + 0.5);
        const int j = static_cast<int>((places_.y[n] - grid_.y) / grid_.spacing + 0.5);
        if (std::isnan(h.at(i, j))) add_unknown({k, k + 1}, out);
      }
    }
  }

  static void add_unknown(const Stretch& stretch, LineCourse& out) {
    if (stretch.first >= stretch.end) return;
    if (!out.unknown.empty() && out.unknown.back().end == stretch.first)
      out.unknown.back().end = stretch.end;
    else
      out.unknown.push_back(stretch);
  }

  const GapTiles& tiles_;
  const TileGrid grid_;
  const bool whole_;
  const FibreOptions& options_;
  Places places_;
  std::vector<std::int32_t> tile_;
};

// A raised stretch, and its line.
struct Visit {
  std::int32_t line;
  RaisedStretch stretch;
};

// All visits of lines to tiles, tile by tile; `begin` gets where those of each begin, and their end.
std::vector<Visit> by_tile(const std::vector<LineCourse>& courses, std::size_t tiles, std::vector<std::size_t>& begin) {
  begin.assign(tiles + 1, 0);
  for (const LineCourse& course : courses)
    for (const RaisedStretch& stretch : course.raised) ++begin[static_cast<std::size_t>(stretch.tile) + 1];
  for (std::size_t k = 0; k < tiles; ++k) begin[k + 1] += begin[k];
  std::vector<Visit> out(begin.back());
  std::vector<std::size_t> next(begin.begin(), begin.end() - 1);
  for (std::size_t n = 0; n < courses.size(); ++n)
    for (const RaisedStretch& stretch : courses[n].raised)
      out[next[static_cast<std::size_t>(stretch.tile)]++] = {static_cast<std::int32_t>(n), stretch};
  return out;
}

}  // namespace

GapsAlong GapsAlong::of(const std::vector<FibreLine>& lines, const GapTiles& tiles, const Surface& mold, bool whole,
                        const FibreOptions& options, std::vector<PointGaps>& memory, const Stop& stop) {
  GapsAlong out;
  out.courses.resize(lines.size());
  parallel_for(static_cast<long>(lines.size()), kChunk, options.threads, stop, [&](long begin, long end) {
    CourseFinder finder(tiles, whole, options);
    for (long n = begin; n < end; ++n) out.courses[static_cast<std::size_t>(n)] = finder.find(lines[static_cast<std::size_t>(n)]);
  });
  std::size_t points = 0;
  for (LineCourse& course : out.courses)
    for (RaisedStretch& stretch : course.raised) stretch.at = points, points += static_cast<std::size_t>(stretch.end - stretch.first);
  if (memory.size() < points) memory = std::vector<PointGaps>(points);
  out.points = memory.data();
  std::vector<std::size_t> begins;
  const std::vector<Visit> visits = by_tile(out.courses, tiles.raised().size(), begins);
  const TileGrid grid = grid_of(tiles);
  parallel_for(static_cast<long>(tiles.raised().size()), 8, options.threads, stop, [&](long begin, long end) {
    GapTiles::Maker maker(tiles, mold);
    Places places(options.isa);
    for (auto tile = static_cast<std::size_t>(begin); tile < static_cast<std::size_t>(end); ++tile) {
      if (begins[tile] == begins[tile + 1]) continue;
      maker.make(tile);
      const TileValues values{maker.fine.data(), maker.coarse.data(), maker.mold};
      const auto [column, row] = tiles.raised()[tile];
      for (std::size_t k = begins[tile]; k < begins[tile + 1]; ++k) {
        const Visit& visit = visits[k];
        const FibreLine& line = lines[static_cast<std::size_t>(visit.line)];
        places.set(line, visit.stretch), places.set_left(line, visit.stretch);
        DEBULK_ON(options.isa, read_tile(grid, column * kTile, row * kTile, values, places.x.data(), places.y.data(), places.left_x.data(),
                                         places.left_y.data(), visit.stretch.end - visit.stretch.first, memory.data() + visit.stretch.at));
      }
    }
  });
  for (LineCourse& course : out.courses) join(course.raised);
  return out;
}

Stretch points_within(const FibreLine& line, const Box& box) {
  if (!line.points.empty()) {
    int begin = line.count, end = 0;
    for (int k = 0; k < line.count; ++k) {
      const Eigen::Vector2d xy = line.at(k);
      if ((xy.array() < box.low.array()).any() || (xy.array() > box.high.array()).any()) continue;
      begin = std::min(begin, k), end = k + 1;
    }
    return {begin, end};
  }
  double low = 0, high = line.length();
  for (const int axis : {0, 1}) {
    if (std::abs(line.way[axis]) < 1e-12) {
      if (line.first[axis] < box.low[axis] || line.first[axis] > box.high[axis]) return {0, 0};
      continue;
    }
    const double a = (box.low[axis] - line.first[axis]) / line.way[axis], b = (box.high[axis] - line.first[axis]) / line.way[axis];
    low = std::max(low, std::min(a, b)), high = std::min(high, std::max(a, b));
  }
  if (low > high) return {0, 0};
  return {static_cast<int>(std::floor(low / line.step)), std::min(line.count, static_cast<int>(std::ceil(high / line.step)) + 1)};
}

}  // namespace debulk
