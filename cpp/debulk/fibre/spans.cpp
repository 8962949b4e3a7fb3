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

int wide_steps(const TwoScales& scales, double step) {
  return std::max(1, static_cast<int>(std::lround(scales.fine_cells() * scales.spacing() / step)));
}

}  // namespace

void LineReader::Points::resize(std::size_t count) {
  for (std::vector<double>* values : {&x, &y, &fine, &coarse, &mold}) values->resize(count);
  place.resize(count);
}

void LineReader::Points::look_up(const TwoScales& scales, int first, int count) {
  const auto n = static_cast<std::size_t>(first);
  scales.look_up(x.data() + n, y.data() + n, count, {place.data() + n, fine.data() + n, coarse.data() + n, mold.data() + n});
}

LineSpans LineReader::read(const FibreLine& line, int begin, int end, const TwoScales& scales) {
  line_ = &line, scales_ = &scales, begin_ = begin, out_ = {};
  marks_.resize(static_cast<std::size_t>(std::max(0, end - begin)));
  place_points();
  mark_points();
  find_spans();
  find_gaps();
  std::vector<FibreSpan>& spans = out_.spans;
  for (std::size_t n = 0; n < spans.size(); ++n) {
    const int before = n > 0 ? (spans[n - 1].last + spans[n].first) / 2 - begin : 0;
    const int after = n + 1 < spans.size() ? (spans[n].last + spans[n + 1].first) / 2 - begin : count() - 1;
    measure(spans[n], before, after);
  }
  read_noise();
  return std::move(out_);
}

void LineReader::place_points() {
  at_.resize(marks_.size());
  for (int k = 0; k < count(); ++k) {
    const Eigen::Vector2d xy = line_->at(begin_ + k);
    at_.x[static_cast<std::size_t>(k)] = xy.x(), at_.y[static_cast<std::size_t>(k)] = xy.y();
  }
  // Heights beside the ply's edge may be partly the mold's; the ply goes on there as it came.
  const int edge = static_cast<int>(std::ceil(options_.edge_cells * scales_->spacing() / line_->step));
  const int low = std::clamp((line_->to_edge[0] ? edge : 0) - begin_, 0, count());
  const int high = std::clamp(line_->count - (line_->to_edge[1] ? edge : 0) - begin_, low, count());
  for (const auto& [from, to] : {std::pair{0, low}, std::pair{high, count()}}) {
    std::fill(at_.place.begin() + from, at_.place.begin() + to, Place::flat);
    for (std::vector<double>* values : {&at_.fine, &at_.coarse, &at_.mold}) std::fill(values->begin() + from, values->begin() + to, kNan);
  }
  at_.look_up(*scales_, low, high - low);
}

void LineReader::mark_points() {
  const double flat = kFlatShare * options_.mold_tol;
  for (std::size_t k = 0; k < marks_.size(); ++k) {
    const double fine = at_.fine[k];
    const Place place = at_.place[k];
    const bool known = fine == fine;
    const bool unknown = !known && (place == Place::unknown || place == Place::raised || (whole_ && place == Place::outside));
    marks_[k] = static_cast<std::uint8_t>((known ? kRaised : 0) | (unknown ? kUnknown : 0) | (fine > options_.mold_tol ? kOff : 0) |
                                          (std::abs(fine) < flat ? kFlat : 0));
  }
  by_fine_.resize(marks_.size()), by_coarse_.resize(marks_.size());
  for (int k = 0; k < count(); ++k) {
    if (!is(k, kRaised)) continue;
    const auto first = static_cast<std::size_t>(k);
    while (k + 1 < count() && is(k + 1, kRaised)) ++k;
    DEBULK_ON(options_.isa, excess_of_steps(&at_.fine[first], &at_.coarse[first], &at_.mold[first], k - static_cast<int>(first),
                                            line_->step, &by_fine_[first], &by_coarse_[first]));
  }
}

void LineReader::find_spans() {
  for (int k = 0; k < count(); ++k) {
    if (!is(k, kOff)) continue;
    const int first = k;
    int top = k;
    for (; k < count() && is(k, kOff); ++k)
      if (at_.fine[static_cast<std::size_t>(k)] > at_.fine[static_cast<std::size_t>(top)]) top = k;
    FibreSpan span;
    span.first = begin_ + first, span.last = begin_ + k - 1, span.top = begin_ + top;
    span.gap = at_.fine[static_cast<std::size_t>(top)];
    out_.spans.push_back(span);
  }
}

void LineReader::find_gaps() {
  for (int k = 0; k < count(); ++k) {
    if (!is(k, kUnknown)) continue;
    const int first = k;
    while (k < count() && is(k, kUnknown)) ++k;
    out_.gaps.push_back({begin_ + first, begin_ + k - 1});
  }
}

// Length of the tail beyond an end: a parabola that comes down from the gap there with its slope touches the mold at
// 2 gap / slope.
int LineReader::tail(int at, int side, int limit) const {
  const auto fine = [&](int k) { return at_.fine[static_cast<std::size_t>(k)]; };
  const int within = at - kReach * side, beyond = at + kReach * side;
  const bool read = std::min(within, beyond) >= 0 && std::max(within, beyond) < count();
  const double slope = read ? (fine(within) - fine(beyond)) / (2 * kReach * line_->step) : kNan;
  const double reach = slope > 0 ? std::min(kLongestTail, 2 * fine(at) / slope) : kLongestTail;
  int k = at;
  while (k != limit && std::abs(k + side - at) * line_->step <= reach + line_->step && is(k + side, kRaised)) k += side;
  return k;
}

void LineReader::measure(FibreSpan& span, int before, int after) {
  const double step = line_->step;
  const int first = span.first - begin_, last = span.last - begin_;
  const int from = tail(first, -1, std::max(before, 0)), to = tail(last, 1, std::min(after, count() - 1));
  span.tails = {(first - from) * step, (to - last) * step};
  span.length = (to - from) * step;
  for (auto k = static_cast<std::size_t>(from); k < static_cast<std::size_t>(to); ++k)
    span.fine += by_fine_[k], span.coarse += by_coarse_[k];
  if (to > from) add_turn(span, from, to - from);
  // The noise of the heights changes the length by its product with the curvature.
  const int wide = wide_steps(*scales_, step), begin = std::max(from, wide), end = std::min(to + 1, count() - wide);
  if (begin >= end) return;
  const auto b = static_cast<std::size_t>(begin);
  bend_.resize(marks_.size());
  DEBULK_ON(options_.isa, curvatures(&at_.coarse[b], &at_.mold[b], end - begin, wide, wide * step * wide * step, bend_.data()));
  for (int k = 0; k < end - begin; ++k)
    if (const double bend = bend_[static_cast<std::size_t>(k)]; !std::isnan(bend)) span.bend += bend * bend * step;
}

// Change of the excess of each step as the line turns about its middle: the slope along it takes in the slope across.
void LineReader::add_turn(FibreSpan& span, int from, int count) {
  const double step = line_->step;
  const auto first = static_cast<std::size_t>(from);
  left_.resize(static_cast<std::size_t>(count)), right_.resize(static_cast<std::size_t>(count));
  DEBULK_ON(options_.isa,
            beside(&at_.x[first], &at_.y[first], count, step, left_.x.data(), left_.y.data(), right_.x.data(), right_.y.data()));
  left_.look_up(*scales_, 0, count), right_.look_up(*scales_, 0, count);
  for (std::size_t n = 0; n < left_.x.size(); ++n) {
    const double aside = (left_.coarse[n] - right_.coarse[n]) / (2 * step);  // NaN if either is not known
    if (std::isnan(aside)) continue;
    const std::size_t k = first + n;
    const double slope = (at_.mold[k + 1] - at_.mold[k] + at_.fine[k + 1] - at_.fine[k]) / step;
    span.turn += slope * aside * step;
  }
}

void LineReader::read_noise() {
  for (const FibreSpan& span : out_.spans) {  // flat ply is off all spans and their tails
    const int a = std::max(begin_, span.first - static_cast<int>(span.tails[0] / line_->step) - kBlock / 2) - begin_;
    const int b = std::min(begin_ + count() - 1, span.last + static_cast<int>(span.tails[1] / line_->step) + kBlock / 2) - begin_;
    std::fill(marks_.begin() + a, marks_.begin() + b + 1, std::uint8_t{0});
  }
  FlatNoise& noise = out_.noise;
  const std::size_t wide = static_cast<std::size_t>(wide_steps(*scales_, line_->step));
  const double lost = scales_->fine_blur_mm2() / (scales_->coarse_blur_mm2() - scales_->fine_blur_mm2());
  for (std::size_t k = 0; k + kBlock < marks_.size(); k += kBlock) {
    if (!std::all_of(&marks_[k], &marks_[k] + kBlock + 1, [](std::uint8_t mark) { return (mark & kFlat) != 0; })) continue;
    double fine = 0, coarse = 0;
    for (std::size_t n = k; n < k + kBlock; ++n) fine += by_fine_[n], coarse += by_coarse_[n];
    if (std::isnan(coarse)) continue;
    noise.length += kBlock * line_->step, noise.fine += fine, noise.coarse += coarse;
    const double before = fine + lost * (fine - coarse);  // as the low end takes it from both, see filter_loss.hpp
    noise.blocks += 1, noise.block_sum += before, noise.block_square += before * before;
    for (std::size_t n = k + wide; n + wide <= k + kBlock; ++n) {
      const double second = at_.fine[n - wide] - 2 * at_.fine[n] + at_.fine[n + wide];
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
