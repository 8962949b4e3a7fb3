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
      const Eigen::Vector2d at = out_.largest.locate(line.at(k)) + Eigen::Vector2d(0.5, 0.5);
      if (!(at.x() >= 0 && at.y() >= 0)) continue;
      const int i = static_cast<int>(at.x()), j = static_cast<int>(at.y());
      if (!out_.largest.contains(i, j) || excess <= out_.largest.at(i, j)) continue;
      out_.largest.at(i, j) = excess, out_.family.at(i, j) = static_cast<std::uint8_t>(run.family);
    }
  }

 private:
  const std::vector<FibreLine>& lines_;
  ExcessField& out_;
};

}  // namespace

ExcessField measure_excess(const std::vector<FibreLine>& lines, const Grid<float>& heights, const Polygon& ply, const Surface& mold,
                           bool whole, const FibreOptions& options, const Stop& stop) {
  FibreMemory memory;
  return measure_excess(lines, heights, ply, mold, whole, options, memory, stop);
}

ExcessField measure_excess(const std::vector<FibreLine>& lines, const Grid<float>& heights, const Polygon& ply, const Surface& mold,
                           bool whole, const FibreOptions& options, FibreMemory& memory, const Stop& stop) {
  options.check();
  require(heights.nx >= 2 && heights.ny >= 2, "heights", "at least 2 by 2 points", heights.size());
  const GapTiles tiles(heights, ply, options, stop, whole ? &memory.tiles : nullptr);
  const ScaleBlurs blurs{tiles.fine_blur_mm2(), tiles.coarse_blur_mm2(), kNarrowest * std::max(1.0, heights.spacing * heights.spacing)};
  const GapsAlong along = GapsAlong::of(lines, tiles, mold, whole, options, memory.points, stop);
  ExcessField out;
  std::vector<LineSpans> read(lines.size());
  parallel_for(static_cast<long>(lines.size()), kChunk, options.threads, stop, [&](long begin, long end) {
    LineReader reader(options, tiles, along);
    for (auto n = static_cast<std::size_t>(begin); n < static_cast<std::size_t>(end); ++n)
      read[n] = reader.read(lines[n], along.courses[n]);
  });
  for (const LineSpans& line : read) out.noise.add(line.noise);
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
    const Stretch near = line.points.empty() ? points_within(line, cells) : Stretch{0, line.count};
    const std::size_t begin = out.size();
    std::int32_t before = 0;
    for (int k = std::max(near.first, runs[n].first); k <= std::min(near.end - 1, runs[n].last); ++k) {
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
