#include "debulk/scanner/match.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>

namespace debulk {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float apart = 8;          // pixels: equal phases further apart than this lie on two surfaces
constexpr float most_shift = 1.5f;  // pixels; greatest distance between a pixel and the place that its partner finds

#define DEBULK_KERNEL "debulk/scanner/match_kernel.inl"
#include "debulk/core/simd_dispatch.inl"

}  // namespace

MatchCounts& MatchCounts::operator+=(const MatchCounts& other) {
  seen += other.seen, matched += other.matched, unmatched += other.unmatched;
  ambiguous += other.ambiguous, behind += other.behind;
  return *this;
}

MatchCounts RowMatcher::match(const RectifiedRow& left, int left_width, float left_step, float left_edge, const RectifiedRow& right,
                              int right_width, float right_step, float right_edge, float* disparity, float* sigma, Isa isa) {
  const auto take = [&](PhaseIndex& index, const RectifiedRow& row, int width, float step, float edge) {
    index.row = &row, index.width = width, index.step = step, index.per_step = 1 / step, index.edge = edge;
    DEBULK_ON(isa, take(index));
  };
  take(left_, left, left_width, left_step, left_edge), take(right_, right, right_width, right_step, right_edge);
  return DEBULK_ON(isa, match(left_, right_, disparity, sigma));
}

}  // namespace debulk
