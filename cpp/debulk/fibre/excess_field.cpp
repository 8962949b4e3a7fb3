#include "debulk/fibre/excess_field.hpp"

#include <algorithm>
#include <cmath>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

constexpr long kChunk = 16;  // lines
// Variance of the narrowest bump that is judged by lines, in squares of the spacing, or in mm2 if that is finer: five
// cells, or 5 mm, wide at its foot. Narrower ones are looked for in the raw scan.
constexpr double kNarrowest = 0.8;

// The points [begin, end) of a line that may lie in a box.
std::array<int, 2> points_within(const FibreLine& line, const Box& box) {
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

void put_in_order(LineSpans& line) {
  std::sort(line.spans.begin(), line.spans.end(), [](const FibreSpan& a, const FibreSpan& b) { return a.first < b.first; });
  std::sort(line.gaps.begin(), line.gaps.end(), [](const UnknownStretch& a, const UnknownStretch& b) { return a.first < b.first; });
}

// Marks the cells of a map that a run crosses, if no run with more excess does.
class Painter {
 public:
  Painter(const std::vector<FibreLine>& lines, const Box& box, const FibreOptions& options, ExcessField& out) : lines_(lines), out_(out) {
    const Eigen::Vector2d size = box.high - box.low;
    out.largest = Grid<float>(static_cast<int>(size.x() / options.apart) + 1, static_cast<int>(size.y() / options.apart) + 1, box.low,
                              options.apart, 0.0F);
    out.family = out.largest.like<std::uint8_t>(0);
  }

  void paint(const FibreRun& run) {
    const FibreLine& line = lines_[static_cast<std::size_t>(run.line)];
    const auto excess = static_cast<float>(run.excess.mid);
    for (int k = run.first; k <= run.last; ++k) {
      const Eigen::Vector2d at = out_.largest.locate(line.at(k));
      const int i = static_cast<int>(std::floor(at.x() + 0.5)), j = static_cast<int>(std::floor(at.y() + 0.5));
      if (!out_.largest.contains(i, j) || excess <= out_.largest.at(i, j)) continue;
      out_.largest.at(i, j) = excess, out_.family.at(i, j) = static_cast<std::uint8_t>(run.family);
    }
  }

 private:
  const std::vector<FibreLine>& lines_;
  ExcessField& out_;
};

Box box_of(const Grid<float>& grid) {
  return {grid.origin, grid.position(grid.nx - 1, grid.ny - 1)};
}

}  // namespace

ExcessField measure_excess(const std::vector<FibreLine>& lines, const HeightWindows& windows, const Polygon& ply, const Surface& mold,
                           bool whole, const FibreOptions& options, const Stop& stop) {
  std::vector<float> memory;
  return measure_excess(lines, windows, ply, mold, whole, options, memory, stop);
}

ExcessField measure_excess(const std::vector<FibreLine>& lines, const HeightWindows& windows, const Polygon& ply, const Surface& mold,
                           bool whole, const FibreOptions& options, std::vector<float>& memory, const Stop& stop) {
  options.check();
  std::vector<LineSpans> read(lines.size());
  ScaleBlurs blurs;
  ExcessField out;
  for (const Grid<float>* heights : windows)
    require(heights->nx >= 2 && heights->ny >= 2, "heights", "at least 2 by 2 points", heights->size());
  const std::vector<TwoScales> all_scales = TwoScales::of(windows, ply, mold, options, memory, stop);
  for (const TwoScales& scales : all_scales) {
    blurs.fine = std::max(blurs.fine, scales.fine_blur_mm2()), blurs.coarse = std::max(blurs.coarse, scales.coarse_blur_mm2());
    blurs.least = std::max(blurs.least, kNarrowest * std::max(1.0, scales.spacing() * scales.spacing()));
  }
  parallel_for(static_cast<long>(lines.size()), kChunk, options.threads, stop, [&](long begin, long end) {
    LineReader reader(options, whole);
    for (long n = begin; n < end; ++n)
      for (const TwoScales& scales : all_scales) {
        const FibreLine& line = lines[static_cast<std::size_t>(n)];
        const auto [first, last] = whole ? std::array<int, 2>{0, line.count} : points_within(line, box_of(scales.heights()));
        if (first >= last) continue;
        LineSpans found = reader.read(line, first, last, scales);
        LineSpans& all = read[static_cast<std::size_t>(n)];
        all.spans.insert(all.spans.end(), found.spans.begin(), found.spans.end());
        all.gaps.insert(all.gaps.end(), found.gaps.begin(), found.gaps.end());
        all.noise.add(found.noise);
      }
  });
  for (LineSpans& line : read) {
    put_in_order(line);
    out.noise.add(line.noise);
  }
  std::vector<std::vector<FibreRun>> runs(lines.size());
  parallel_for(static_cast<long>(lines.size()), kChunk, options.threads, stop, [&](long begin, long end) {
    for (long n = begin; n < end; ++n) {
      const auto at = static_cast<std::size_t>(n);
      join_spans(lines[at], static_cast<int>(n), read[at].spans, read[at].gaps, out.noise, blurs, options, runs[at]);
    }
  });
  Box around;
  bool any = false;
  for (const FibreLine& line : lines)
    for (const int k : {0, line.count - 1}) {
      const Eigen::Vector2d xy = line.at(k);
      around.low = any ? around.low.cwiseMin(xy) : xy, around.high = any ? around.high.cwiseMax(xy) : xy;
      any = true;
    }
  Painter painter(lines, around, options, out);
  for (std::size_t n = 0; n < lines.size(); ++n)
    for (const FibreRun& run : runs[n]) {
      painter.paint(run);
      out.runs.push_back(run);
    }
  return out;
}

std::vector<FootCrossing> foot_crossings(const std::vector<FibreLine>& lines, const std::vector<FibreRun>& runs,
                                         const Grid<std::int32_t>& labels) {
  std::vector<FootCrossing> out;
  const Eigen::Vector2d half = Eigen::Vector2d::Constant(0.5);
  const Box cells{labels.position(0, 0) - labels.spacing * half, labels.position(labels.nx - 1, labels.ny - 1) + labels.spacing * half};
  for (std::size_t n = 0; n < runs.size(); ++n) {
    const FibreLine& line = lines[static_cast<std::size_t>(runs[n].line)];
    const auto [from, to] = line.points.empty() ? points_within(line, cells) : std::array<int, 2>{0, line.count};
    const std::size_t begin = out.size();
    std::int32_t before = 0;
    for (int k = std::max(from, runs[n].first); k <= std::min(to - 1, runs[n].last); ++k) {
      const Eigen::Vector2d at = labels.locate(line.at(k)) + Eigen::Vector2d(0.5, 0.5);
      if (!(at.x() >= 0 && at.y() >= 0 && at.x() < labels.nx && at.y() < labels.ny)) continue;
      const std::int32_t label = labels.at(static_cast<int>(at.x()), static_cast<int>(at.y()));
      if (label == 0 || label == before) continue;
      before = label;
      const bool known =
          std::any_of(out.begin() + static_cast<std::ptrdiff_t>(begin), out.end(), [&](const FootCrossing& c) { return c.label == label; });
      if (!known) out.push_back({static_cast<std::int32_t>(n), label});
    }
  }
  return out;
}

}  // namespace debulk
