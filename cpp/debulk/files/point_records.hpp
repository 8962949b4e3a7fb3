#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "debulk/files/number_type.hpp"
#include "debulk/files/point_summary.hpp"

namespace debulk {

// Where x, y and z stand in a record of a binary file.
struct RecordLayout {
  long bytes = 12;                       // length of one record
  std::array<long, 3> offsets{0, 4, 8};  // bytes from the start of the record to x, y, z
  std::array<NumberType, 3> types{NumberType::f4, NumberType::f4, NumberType::f4};
  bool big_endian = false;

  bool all_floats() const;
  bool packed() const;  // laid out as a cloud in memory, except perhaps for the byte order
  void check() const;
};

// Reads `count` records, starting at byte `offset`, multiplies their points by `factor` and writes them to `out` (3
// floats per point). Each chunk fits into the cache and is read, converted and summarised by one thread, so that the
// memory is read only once. Throws FileFault.
PointSummary read_records(int file, long long offset, long count, const RecordLayout& layout, double factor, float* out, int threads = 0);

// The same from memory, where x, y and z each have a column of their own, in the machine's byte order, as in a PCD
// file of kind binary_compressed.
PointSummary gather_columns(const std::array<const std::uint8_t*, 3>& columns, const std::array<NumberType, 3>& types, long count,
                            double factor, float* out, int threads = 0);

}  // namespace debulk
