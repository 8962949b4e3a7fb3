#include "debulk/files/point_records.hpp"

#include <algorithm>
#include <cstring>
#include <memory>
#include <vector>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/files/file_fault.hpp"

namespace debulk {
namespace {

constexpr long chunk_bytes = 1 << 18;  // together with the converted points, well inside a core's second-level cache

template <class T>
void gather(const std::uint8_t* from, long stride, long count, bool swapped, double factor, float* to) {
  const auto all = [&](bool swap) {
    for (long i = 0; i < count; ++i) to[3 * i] = static_cast<float>(static_cast<double>(load_number<T>(from + i * stride, swap)) * factor);
  };
  if (swapped)
    all(true);
  else
    all(false);
}

void gather(const std::uint8_t* from, NumberType type, long stride, long count, bool swapped, double factor, float* to) {
  if (type == NumberType::f4 && factor == 1 && !swapped)
    for (long i = 0; i < count; ++i) std::memcpy(to + 3 * i, from + i * stride, 4);
  else
    with_type(type, [&](auto value) { gather<decltype(value)>(from, stride, count, swapped, factor, to); });
}

// Copies points whose three floats are adjacent. One wide copy takes a point and four bytes more, which the next point
// then overwrites.
void copy_points(const std::uint8_t* from, long stride, long count, float* to) {
  for (long i = 0; i + 1 < count; ++i) std::memcpy(to + 3 * i, from + i * stride, 16);
  if (count > 0) std::memcpy(to + 3 * (count - 1), from + (count - 1) * stride, 12);
}

void swap_bytes(float* values, long count) {
  for (long i = 0; i < count; ++i) {
    std::uint32_t bits;
    std::memcpy(&bits, values + i, 4);
    bits = __builtin_bswap32(bits);
    std::memcpy(values + i, &bits, 4);
  }
}

void scale(float* values, long count, double factor) {
  for (long i = 0; i < count; ++i) values[i] = static_cast<float>(values[i] * factor);
}

void convert(const std::uint8_t* from, const RecordLayout& layout, long count, double factor, float* to) {
  const std::array<long, 3>& at = layout.offsets;
  if (layout.all_floats()) {
    if (at[1] == at[0] + 4 && at[2] == at[0] + 8)
      copy_points(from + at[0], layout.bytes, count, to);
    else
      for (std::size_t k = 0; k < 3; ++k) gather(from + at[k], NumberType::f4, layout.bytes, count, false, 1, to + k);
    if (layout.big_endian) swap_bytes(to, 3 * count);
    if (factor != 1) scale(to, 3 * count, factor);
    return;
  }
  for (std::size_t k = 0; k < 3; ++k) gather(from + at[k], layout.types[k], layout.bytes, count, layout.big_endian, factor, to + k);
}

PointSummary merged(const std::vector<PointSummary>& parts) {
  PointSummary all;
  for (const PointSummary& part : parts) all.merge(part);
  return all;
}

}  // namespace

bool RecordLayout::all_floats() const {
  return types == std::array<NumberType, 3>{NumberType::f4, NumberType::f4, NumberType::f4};
}

bool RecordLayout::packed() const {
  return bytes == 12 && offsets == std::array<long, 3>{0, 4, 8} && all_floats();
}

void RecordLayout::check() const {
  require(bytes > 0, "bytes", "a positive number of bytes a record", bytes);
  for (std::size_t k = 0; k < 3; ++k)
    require(offsets[k] >= 0 && offsets[k] <= bytes - bytes_of(types[k]), "offsets", "a place inside the record", offsets[k]);
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
      if (layout.big_endian) swap_bytes(points, 3 * n);
      if (factor != 1) scale(points, 3 * n, factor);
    } else {
      const std::unique_ptr<std::uint8_t[]> buffer(new std::uint8_t[static_cast<std::size_t>(n * layout.bytes)]);
      read_at(file, start, buffer.get(), static_cast<long long>(n) * layout.bytes);
      convert(buffer.get(), layout, n, factor, points);
    }
    parts[static_cast<std::size_t>(begin / chunk)] = summarise(points, n);
  });
  return merged(parts);
}

PointSummary gather_columns(const std::array<const std::uint8_t*, 3>& columns, const std::array<NumberType, 3>& types, long count,
                            double factor, float* out, int threads) {
  constexpr long chunk = 1 << 14;
  std::vector<PointSummary> parts(static_cast<std::size_t>((count + chunk - 1) / chunk));
  parallel_for(count, chunk, threads, [&](long begin, long end) {
    float* const points = out + 3 * begin;
    for (std::size_t k = 0; k < 3; ++k) {
      const int bytes = bytes_of(types[k]);
      gather(columns[k] + begin * bytes, types[k], bytes, end - begin, false, factor, points + k);
    }
    parts[static_cast<std::size_t>(begin / chunk)] = summarise(points, end - begin);
  });
  return merged(parts);
}

}  // namespace debulk
