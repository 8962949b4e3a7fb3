#include "debulk/fibre/spans.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "debulk/core/simd.hpp"

namespace debulk {
namespace {

constexpr int kBlock = 16;             // steps
constexpr double kFlatShare = 0.6;     // of the mold tolerance: flat ply, whose noise counts, is nearer to the mold
constexpr double kLongestTail = 20.0;  // mm
constexpr int kReach = 2;              // steps to either side, over which a slope is read
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

#define DEBULK_KERNEL "debulk/fibre/excess_kernel.inl"
#include "debulk/core/simd_dispatch.inl"

}  // namespace

LineReader::LineReader(const FibreOptions& options, const GapTiles& tiles, const GapsAlong& along)
    : options_(options),
      tiles_(tiles),
      along_(along),
      fine_mm_(tiles.fine_cells() * tiles.heights().spacing),
      lost_(tiles.fine_blur_mm2() / (tiles.coarse_blur_mm2() - tiles.fine_blur_mm2())) {}

LineSpans LineReader::read(const FibreLine& line, const LineCourse& course) {
  line_ = &line, step_ = line.step, wide_ = std::max(1, static_cast<int>(std::lround(fine_mm_ / step_)));
  out_ = {};
  out_.gaps = course.unknown;
  for (const RaisedStretch& stretch : course.raised) read(stretch);
  // What is not known may go on from one kind of stretch into the other.
  std::vector<Stretch>& gaps = out_.gaps;
  std::sort(gaps.begin(), gaps.end(), [](const Stretch& a, const Stretch& b) { return a.first < b.first; });
  join(gaps);
  return std::move(out_);
}

void LineReader::read(const RaisedStretch& stretch) {
  begin_ = stretch.first;
  points_ = along_.points + stretch.at;
  const auto points = static_cast<std::size_t>(stretch.end - stretch.first);
  marks_.resize(points), by_fine_.resize(points), by_coarse_.resize(points);
  DEBULK_ON(options_.isa, mark(points_, count(), options_.mold_tol, kFlatShare * options_.mold_tol, marks_.data()));
  DEBULK_ON(options_.isa, excess_of_steps(points_, count() - 1, step_, by_fine_.data(), by_coarse_.data()));
  std::vector<FibreSpan>& spans = out_.spans;
  const std::size_t from = spans.size();
  find_spans();
  find_gaps();
  for (std::size_t n = from; n < spans.size(); ++n) {
    const int before = n > from ? (spans[n - 1].last + spans[n].first) / 2 - begin_ : 0;
    const int after = n + 1 < spans.size() ? (spans[n].last + spans[n + 1].first) / 2 - begin_ : count() - 1;
    measure(spans[n], before, after);
  }
  read_noise(from);
}

void LineReader::find_spans() {
  for (int k = 0; k < count(); ++k) {
    if (!is(k, kOff)) continue;
    const int first = k;
    int top = k, last = k;
    for (; k < count() && (is(k, kOff) || at_edge(k)); ++k) {
      if (is(k, kOff)) last = k;
      if (fine(k) > fine(top)) top = k;
    }
    FibreSpan span;
    span.first = begin_ + first, span.last = begin_ + last, span.top = begin_ + top, span.unread[1] = k - 1 - last;
    span.gap = fine(top), span.aside = options_.apart / 2;
    while (at_edge(first - 1 - span.unread[0])) ++span.unread[0];
    const bool whole = first > 0 && is(first - 1, kRaised) && k < count() && is(last + 1, kRaised);
    if (whole) span.aside = std::max(span.aside, to_edge(span.top));
    out_.spans.push_back(span);
  }
}

void LineReader::find_gaps() {
  for (int k = 0; k < count(); ++k)
    if (is(k, kUnknown) && !at_edge(k)) out_.gaps.push_back({begin_ + k, begin_ + k + 1});
}

// Whether a point is not read because it lies along the ply's edge.
bool LineReader::at_edge(int k) const {
  return k >= 0 && k < count() && is(k, kUnknown) && !tiles_.on_ply(line_->at(begin_ + k));
}

// The way across the line to the ply's edge, if no other line is read before it; 0 otherwise.
double LineReader::to_edge(int at) const {
  const Eigen::Vector2d here = line_->at(at), way = line_->at(std::min(at + 1, line_->count - 1)) - line_->at(std::max(at - 1, 0));
  const Eigen::Vector2d left = Eigen::Vector2d(-way.y(), way.x()).normalized();
  double out = 0;
  for (const double side : {-1.0, 1.0}) {
    if (tiles_.on_ply(here + side * options_.apart * left)) continue;
    double to = 0;
    while (to < options_.apart && tiles_.on_ply(here + side * to * left)) to += step_ / 4;
    out = std::max(out, to + tiles_.edge_mm());
  }
  return out;
}

// Length of the tail beyond an end: a parabola that comes down from the gap there with its slope touches the mold at
// 2 gap / slope.
int LineReader::tail(int at, int side, int limit) const {
  const int within = at - kReach * side, beyond = at + kReach * side;
  const bool read = std::min(within, beyond) >= 0 && std::max(within, beyond) < count();
  const double slope = read ? (fine(within) - fine(beyond)) / (2 * kReach * step_) : kNan;
  const double reach = slope > 0 ? std::min(kLongestTail, 2 * fine(at) / slope) : kLongestTail;
  int k = at;
  while (k != limit && std::abs(k + side - at) * step_ <= reach + step_ && is(k + side, kRaised)) k += side;
  return k;
}

void LineReader::measure(FibreSpan& span, int before, int after) {
  const int first = span.first - begin_, last = span.last - begin_;
  const int from = tail(first, -1, std::max(before, 0)), to = tail(last, 1, std::min(after, count() - 1));
  span.tails = {(first - from) * step_, (to - last) * step_};
  span.length = (to - from) * step_;
  for (int k = from; k < to; ++k) {
    if (std::isnan(by_fine_[static_cast<std::size_t>(k)])) continue;
    span.fine += by_fine_[static_cast<std::size_t>(k)], span.coarse += by_coarse_[static_cast<std::size_t>(k)];
    // As the line turns about its middle, the slope along it takes in the slope across.
    const PointGaps &here = points_[k], &next = points_[k + 1];
    if (std::isnan(here.aside)) continue;
    span.turn += static_cast<double>(next.mold - here.mold + next.fine - here.fine) * static_cast<double>(here.aside);
  }
  // The noise of the heights changes the length by its product with the curvature.
  const int begin = std::max(from, wide_), end = std::min(to + 1, count() - wide_);
  if (begin >= end) return;
  bend_.resize(marks_.size());
  DEBULK_ON(options_.isa, curvatures(points_ + begin, end - begin, wide_, wide_ * step_ * wide_ * step_, bend_.data()));
  for (int k = 0; k < end - begin; ++k)
    if (const double bend = bend_[static_cast<std::size_t>(k)]; !std::isnan(bend)) span.bend += bend * bend * step_;
}

void LineReader::read_noise(std::size_t from) {
  for (std::size_t n = from; n < out_.spans.size(); ++n) {  // flat ply is off all spans and their tails
    const FibreSpan& span = out_.spans[n];
    const int a = std::max(begin_, span.first - static_cast<int>(span.tails[0] / step_) - kBlock / 2) - begin_;
    const int b = std::min(begin_ + count() - 1, span.last + static_cast<int>(span.tails[1] / step_) + kBlock / 2) - begin_;
    std::fill(marks_.begin() + a, marks_.begin() + b + 1, std::uint8_t{0});
  }
  FlatNoise& noise = out_.noise;
  // Blocks begin at every sixteenth point of a line, wherever what was read of it begins.
  for (int k = (kBlock - begin_ % kBlock) % kBlock; k + kBlock < count(); k += kBlock) {
    if (!std::all_of(&marks_[static_cast<std::size_t>(k)], &marks_[static_cast<std::size_t>(k)] + kBlock + 1,
                     [](std::uint8_t mark) { return (mark & kFlat) != 0; }))
      continue;
    double by_fine = 0, by_coarse = 0;
    for (int n = k; n < k + kBlock; ++n)
      by_fine += by_fine_[static_cast<std::size_t>(n)], by_coarse += by_coarse_[static_cast<std::size_t>(n)];
    if (std::isnan(by_coarse)) continue;
    noise.length += kBlock * step_, noise.fine += by_fine, noise.coarse += by_coarse;
    const double before = by_fine + lost_ * (by_fine - by_coarse);  // as the low end takes it from both, see filter_loss.hpp
    noise.blocks += 1, noise.block_sum += before, noise.block_square += before * before;
    for (int n = k + wide_; n + wide_ <= k + kBlock; ++n) {
      const double second = fine(n - wide_) - 2 * fine(n) + fine(n + wide_);
      noise.triples += 1, noise.second_square += second * second;
    }
  }
}

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

}  // namespace debulk
