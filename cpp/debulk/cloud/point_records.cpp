#include "debulk/cloud/point_records.hpp"

#include <algorithm>
#include <cstring>
#include <memory>
#include <vector>

#include "debulk/cloud/file_fault.hpp"
#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

constexpr long chunk_bytes = 1 << 19;  // with what it becomes, well inside a core's second cache

template <class T, bool Swapped>
T load(const std::uint8_t* from) {
  if constexpr (sizeof(T) == 4) {
    std::uint32_t bits;
    std::memcpy(&bits, from, 4);
    if (Swapped) bits = __builtin_bswap32(bits);
    T value;
    std::memcpy(&value, &bits, 4);
    return value;
  } else {
    std::uint64_t bits;
    std::memcpy(&bits, from, 8);
    if (Swapped) bits = __builtin_bswap64(bits);
    T value;
    std::memcpy(&value, &bits, 8);
    return value;
  }
}

template <class T, bool Swapped>
void gather(const std::uint8_t* from, long stride, long count, double factor, float* to) {
  if (factor == 1)
    for (long i = 0; i < count; ++i) to[3 * i] = static_cast<float>(load<T, Swapped>(from + i * stride));
  else
    for (long i = 0; i < count; ++i) to[3 * i] = static_cast<float>(load<T, Swapped>(from + i * stride) * factor);
}

// All three at once where they have one type: one loop over the records instead of three.
template <class T, bool Swapped>
void gather_points(const std::uint8_t* from, const RecordLayout& layout, long count, double factor, float* to) {
  const long x = layout.offsets[0], y = layout.offsets[1], z = layout.offsets[2], stride = layout.bytes;
  for (long i = 0; i < count; ++i, from += stride, to += 3) {
    to[0] = static_cast<float>(load<T, Swapped>(from + x) * factor);
    to[1] = static_cast<float>(load<T, Swapped>(from + y) * factor);
    to[2] = static_cast<float>(load<T, Swapped>(from + z) * factor);
  }
}

void convert(const std::uint8_t* from, const RecordLayout& layout, long count, double factor, float* to) {
  const std::array<int, 3>& w = layout.widths;
  if (w[0] == w[1] && w[1] == w[2]) {
    const auto points = w[0] == 4 ? (layout.big_endian ? gather_points<float, true> : gather_points<float, false>)
                                  : (layout.big_endian ? gather_points<double, true> : gather_points<double, false>);
    return points(from, layout, count, factor, to);
  }
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = w[k] == 4 ? (layout.big_endian ? gather<float, true> : gather<float, false>)
                                : (layout.big_endian ? gather<double, true> : gather<double, false>);
    axis(from + layout.offsets[k], layout.bytes, count, factor, to + k);
  }
}

PointSummary merged(const std::vector<PointSummary>& parts) {
  PointSummary all;
  for (const PointSummary& part : parts) all.merge(part);
  return all;
}

}  // namespace

bool RecordLayout::packed() const {
  return bytes == 12 && !big_endian && offsets == std::array<long, 3>{0, 4, 8} && widths == std::array<int, 3>{4, 4, 4};
}

void RecordLayout::check() const {
  require(bytes > 0, "bytes", "a positive number of bytes a record", bytes);
  for (std::size_t k = 0; k < 3; ++k) {
    require(widths[k] == 4 || widths[k] == 8, "widths", "4 or 8 bytes", widths[k]);
    require(offsets[k] >= 0 && offsets[k] <= bytes - widths[k], "offsets", "a place inside the record", offsets[k]);
  }
}

PointSummary read_records(int file, long long offset, long count, const RecordLayout& layout, double factor, float* out, int threads) {
  layout.check();
  const long chunk = std::max(1L, chunk_bytes / std::max(12L, layout.bytes));
  std::vector<PointSummary> parts(static_cast<std::size_t>((count + chunk - 1) / chunk));
  parallel_for(count, chunk, threads, [&](long begin, long end) {
    const long n = end - begin;
    const long long start = offset + static_cast<long long>(begin) * layout.bytes;
    float* const points = out + 3 * begin;
    if (layout.packed()) {
      read_at(file, start, points, 12LL * n);
      if (factor != 1)
        for (long i = 0; i < 3 * n; ++i) points[i] = static_cast<float>(points[i] * factor);
    } else {
      const std::unique_ptr<std::uint8_t[]> buffer(new std::uint8_t[static_cast<std::size_t>(n * layout.bytes)]);
      read_at(file, start, buffer.get(), static_cast<long long>(n) * layout.bytes);
      convert(buffer.get(), layout, n, factor, points);
    }
    parts[static_cast<std::size_t>(begin / chunk)] = summarise(points, begin, n);
  });
  return merged(parts);
}

PointSummary gather_columns(const std::array<const std::uint8_t*, 3>& columns, const std::array<int, 3>& widths, long count, double factor,
                            float* out, int threads) {
  constexpr long chunk = 1 << 14;
  std::vector<PointSummary> parts(static_cast<std::size_t>((count + chunk - 1) / chunk));
  parallel_for(count, chunk, threads, [&](long begin, long end) {
    float* const points = out + 3 * begin;
    for (std::size_t k = 0; k < 3; ++k) {
      require(widths[k] == 4 || widths[k] == 8, "widths", "4 or 8 bytes", widths[k]);
      const std::uint8_t* from = columns[k] + begin * widths[k];
      const auto axis = widths[k] == 4 ? gather<float, false> : gather<double, false>;
      axis(from, widths[k], end - begin, factor, points + k);
    }
    parts[static_cast<std::size_t>(begin / chunk)] = summarise(points, begin, end - begin);
  });
  return merged(parts);
}

}  // namespace debulk
