#include "debulk/files/point_summary.hpp"

#include <algorithm>
#include <vector>

#include "debulk/core/parallel.hpp"

namespace debulk {

void PointSummary::merge(const PointSummary& other) {
  for (std::size_t k = 0; k < 3; ++k) {
    low[k] = std::min(low[k], other.low[k]);
    high[k] = std::max(high[k], other.high[k]);
  }
  at_origin += other.at_origin;
}

namespace {

PointSummary bounds(const float* xyz, long count) {
  constexpr int lanes = 24;  // eight points side by side, which fill whole registers of 4 floats
  float low[lanes], high[lanes];
  std::fill(low, low + lanes, PointSummary::infinity);
  std::fill(high, high + lanes, -PointSummary::infinity);
  const long values = 3 * count, whole = values - values % lanes;
  // A comparison with NaN is false and leaves the limit as it is.
  for (long i = 0; i < whole; i += lanes)
    for (int k = 0; k < lanes; ++k) {
      const float v = xyz[i + k];
      low[k] = v < low[k] ? v : low[k];
      high[k] = v > high[k] ? v : high[k];
    }
  for (long i = whole; i < values; ++i) {
    const float v = xyz[i];
    low[i - whole] = v < low[i - whole] ? v : low[i - whole];
    high[i - whole] = v > high[i - whole] ? v : high[i - whole];
  }
  PointSummary out;
  for (std::size_t k = 0; k < lanes; ++k) {
    out.low[k % 3] = std::min(out.low[k % 3], low[k]);
    out.high[k % 3] = std::max(out.high[k % 3], high[k]);
  }
  return out;
}

// Takes one point after the other, which is slower.
PointSummary without_origin(const float* xyz, long count) {
  PointSummary out;
  for (const float *p = xyz, *end = xyz + 3 * count; p != end; p += 3) {
    if (p[0] == 0 && p[1] == 0 && p[2] == 0) {
      ++out.at_origin;
      continue;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      out.low[k] = p[k] < out.low[k] ? p[k] : out.low[k];
      out.high[k] = p[k] > out.high[k] ? p[k] : out.high[k];
    }
  }
  return out;
}

}  // namespace

PointSummary summarise(const float* xyz, long count) {
  const PointSummary out = bounds(xyz, count);
  bool origin = true;  // whether the box holds it, as few parts of a scan do in a scanner's frame
  for (std::size_t k = 0; k < 3; ++k) origin = origin && out.low[k] <= 0 && out.high[k] >= 0;
  return origin ? without_origin(xyz, count) : out;
}

PointSummary scale_and_summarise(float* xyz, long count, double factor, int threads) {
  constexpr long chunk = 1 << 15;
  std::vector<PointSummary> parts(static_cast<std::size_t>((count + chunk - 1) / chunk));
  parallel_for(count, chunk, threads, [&](long begin, long end) {
    if (factor != 1)
      for (long i = 3 * begin; i < 3 * end; ++i) xyz[i] = static_cast<float>(xyz[i] * factor);
    parts[static_cast<std::size_t>(begin / chunk)] = summarise(xyz + 3 * begin, end - begin);
  });
  PointSummary all;
  for (const PointSummary& part : parts) all.merge(part);
  return all;
}

}  // namespace debulk
