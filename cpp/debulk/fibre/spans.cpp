#include "debulk/fibre/spans.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace debulk {
namespace {

constexpr int kAtOnce = 32;            // points of a line that are looked for before they are read
constexpr int kBlock = 16;             // steps
constexpr double kFlat = 0.6;          // of the mold tolerance: flat ply, whose noise counts, is nearer to the mold
constexpr double kLongestTail = 20.0;  // mm
constexpr int kReach = 2;              // steps to either side, over which a slope is read
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

struct Point : ScaleSample {
  TwoScales::Place place = TwoScales::Place::outside;

  bool raised() const { return place == TwoScales::Place::raised && !std::isnan(fine); }
  bool unknown() const { return place == TwoScales::Place::unknown || (place == TwoScales::Place::raised && std::isnan(fine)); }
};

double length(double step, double rise) {
  return std::sqrt(step * step + rise * rise);
}

class Reader {
 public:
  Reader(const FibreLine& line, int begin, int end, const TwoScales& scales, const FibreOptions& options, bool whole)
      : line_(line), scales_(scales), options_(options), begin_(begin), points_(static_cast<std::size_t>(std::max(0, end - begin))) {
    // Heights beside the ply's edge may be partly the mold's; the ply goes on there as it came.
    const int edge = static_cast<int>(std::ceil(options.edge_cells * scales.spacing() / line.step));
    const int low = line.to_edge[0] ? edge : 0, high = line.count - (line.to_edge[1] ? edge : 0);
    std::array<TwoScales::Spot, kAtOnce> spots;
    for (int from = begin; from < end; from += kAtOnce) {
      const int count = std::min(kAtOnce, end - from);
      for (int k = 0; k < count; ++k) {
        TwoScales::Spot& spot = spots[static_cast<std::size_t>(k)];
        spot.place = TwoScales::Place::flat;
        if (from + k >= low && from + k < high) scales.find(line.at(from + k), spot);
      }
      for (int k = 0; k < count; ++k) {
        const TwoScales::Spot& spot = spots[static_cast<std::size_t>(k)];
        Point& p = point(from + k);
        if (spot.place == TwoScales::Place::raised) static_cast<ScaleSample&>(p) = TwoScales::sample(spot);
        p.place = spot.place == TwoScales::Place::outside ? (whole ? TwoScales::Place::unknown : TwoScales::Place::flat) : spot.place;
      }
    }
  }

  LineSpans read() {
    find_spans();
    find_gaps();
    for (std::size_t n = 0; n < out_.spans.size(); ++n) {
      const int before = n > 0 ? (out_.spans[n - 1].last + out_.spans[n].first) / 2 : begin_;
      const int after = n + 1 < out_.spans.size() ? (out_.spans[n].last + out_.spans[n + 1].first) / 2 : end() - 1;
      measure(out_.spans[n], before, after);
    }
    read_noise();
    return std::move(out_);
  }

 private:
  int end() const { return begin_ + static_cast<int>(points_.size()); }
  Point& point(int k) { return points_[static_cast<std::size_t>(k - begin_)]; }
  bool off(int k) { return point(k).raised() && point(k).fine > options_.mold_tol; }

  void find_spans() {
    for (int k = begin_; k < end(); ++k) {
      if (!off(k)) continue;
      FibreSpan span;
      span.first = span.top = k;
      for (; k < end() && off(k); ++k)
        if (point(k).fine > point(span.top).fine) span.top = k;
      span.last = k - 1;
      span.gap = point(span.top).fine;
      out_.spans.push_back(span);
    }
  }

  void find_gaps() {
    for (int k = begin_; k < end(); ++k) {
      if (!point(k).unknown()) continue;
      const int first = k;
      while (k < end() && point(k).unknown()) ++k;
      out_.gaps.push_back({first, k - 1});
    }
  }

  // Length of the tail beyond an end: a parabola that comes down from the gap there with its slope touches the mold at
  // 2 gap / slope.
  int tail(int at, int side, int limit) {
    const int within = at - kReach * side, beyond = at + kReach * side;
    const bool read = std::min(within, beyond) >= begin_ && std::max(within, beyond) < end();
    const double slope = read ? (point(within).fine - point(beyond).fine) / (2 * kReach * line_.step) : kUnknown;
    const double reach = slope > 0 ? std::min(kLongestTail, 2 * point(at).fine / slope) : kLongestTail;
    int k = at;
    while (k != limit && std::abs(k + side - at) * line_.step <= reach + line_.step && point(k + side).raised()) k += side;
    return k;
  }

  void measure(FibreSpan& span, int before, int after) {
    const int from = tail(span.first, -1, std::max(before, begin_)), to = tail(span.last, 1, std::min(after, end() - 1));
    span.tails = {(span.first - from) * line_.step, (to - span.last) * line_.step};
    span.length = (to - from) * line_.step;
    for (int k = from; k < to; ++k) {
      const Point &a = point(k), &b = point(k + 1);
      const double rise = b.mold - a.mold, along_mold = length(line_.step, rise);
      const double fine = length(line_.step, rise + (b.fine - a.fine)) - along_mold;
      const double coarse = length(line_.step, rise + (b.coarse - a.coarse)) - along_mold;
      if (std::isnan(fine)) continue;
      span.fine += fine;
      span.coarse += std::isnan(coarse) ? fine : coarse;
      span.turn += turn(k, (rise + b.fine - a.fine) / line_.step);
    }
    // The noise of the heights changes the length by its product with the curvature.
    const int wide = std::max(1, static_cast<int>(std::lround(scales_.fine_cells() * scales_.spacing() / line_.step)));
    for (int k = from; k <= to; ++k) {
      if (k - wide < begin_ || k + wide >= end()) continue;
      const Point &a = point(k - wide), &b = point(k), &c = point(k + wide);
      const double bend = (a.coarse + a.mold - 2 * (b.coarse + b.mold) + c.coarse + c.mold) / (wide * line_.step * wide * line_.step);
      if (!std::isnan(bend)) span.bend += bend * bend * line_.step;
    }
  }

  // Change of the excess of one step as the line turns about its middle: the slope along it takes in the slope across.
  double turn(int k, double slope) {
    const Eigen::Vector2d here = line_.at(k), along = (line_.at(k + 1) - here).normalized();
    const Eigen::Vector2d across(-along.y(), along.x()), left = here + line_.step * across, right = here - line_.step * across;
    TwoScales::Spot on_left, on_right;
    scales_.find(left, on_left), scales_.find(right, on_right);
    if (on_left.place != TwoScales::Place::raised || on_right.place != TwoScales::Place::raised) return 0;
    const double aside = (TwoScales::sample(on_left).coarse - TwoScales::sample(on_right).coarse) / (2 * line_.step);
    return std::isnan(aside) ? 0 : slope * aside * line_.step;
  }

  // Flat ply is known, near the mold, and off all spans and their tails.
  bool flat(int k) { return point(k).raised() && std::abs(point(k).fine) < kFlat * options_.mold_tol; }

  void read_noise() {
    std::vector<std::uint8_t> free(points_.size(), 1);
    for (const FibreSpan& span : out_.spans) {
      const int a = std::max(begin_, span.first - static_cast<int>(span.tails[0] / line_.step) - kBlock / 2);
      const int b = std::min(end() - 1, span.last + static_cast<int>(span.tails[1] / line_.step) + kBlock / 2);
      std::fill(free.begin() + (a - begin_), free.begin() + (b - begin_) + 1, std::uint8_t{0});
    }
    FlatNoise& noise = out_.noise;
    const int wide = std::max(1, static_cast<int>(std::lround(scales_.fine_cells() * scales_.spacing() / line_.step)));
    for (int k = begin_; k + kBlock < end(); k += kBlock) {
      bool usable = true;
      for (int n = k; n <= k + kBlock; ++n) usable = usable && free[static_cast<std::size_t>(n - begin_)] && flat(n);
      if (!usable) continue;
      double fine = 0, coarse = 0;
      for (int n = k; n < k + kBlock; ++n) {
        const Point &a = point(n), &b = point(n + 1);
        const double rise = b.mold - a.mold, along_mold = length(line_.step, rise);
        fine += length(line_.step, rise + (b.fine - a.fine)) - along_mold;
        coarse += length(line_.step, rise + (b.coarse - a.coarse)) - along_mold;
      }
      if (std::isnan(coarse)) continue;
      noise.length += kBlock * line_.step, noise.fine += fine, noise.coarse += coarse;
      noise.blocks += 1, noise.block_sum += fine, noise.block_square += fine * fine;
      for (int n = k + wide; n + wide <= k + kBlock; ++n) {
        const double second = point(n - wide).fine - 2 * point(n).fine + point(n + wide).fine;
        noise.triples += 1, noise.second_square += second * second;
      }
    }
  }

  const FibreLine& line_;
  const TwoScales& scales_;
  const FibreOptions& options_;
  int begin_;
  std::vector<Point> points_;
  LineSpans out_;
};

}  // namespace

void FlatNoise::add(const FlatNoise& other) {
  length += other.length, fine += other.fine, coarse += other.coarse;
  blocks += other.blocks, block_sum += other.block_sum, block_square += other.block_square;
  triples += other.triples, second_square += other.second_square;
}

double FlatNoise::variance_per_mm(double step) const {
  if (blocks < 2) return 0.0;
  const double mean = block_sum / blocks;
  return std::max(0.0, block_square / blocks - mean * mean) / (kBlock * step);
}

LineSpans read_line(const FibreLine& line, int begin, int end, const TwoScales& scales, const FibreOptions& options, bool whole) {
  return Reader(line, begin, end, scales, options, whole).read();
}

}  // namespace debulk
