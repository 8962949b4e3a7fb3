#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "debulk/files/point_summary.hpp"

namespace debulk {

// Where x, y, z stand in a record of a binary file, each as a float or a double.
struct RecordLayout {
  long bytes = 12;                       // of one record
  std::array<long, 3> offsets{0, 4, 8};  // of x, y, z in it
  std::array<int, 3> widths{4, 4, 4};    // 4: float, 8: double
  bool big_endian = false;

  bool all_floats() const;
  bool packed() const;  // what a cloud is in memory, but for the order of bytes
  void check() const;
};

// Reads `count` records from byte `offset` on, as points times `factor`, into out (3 floats per point). Chunks that fit into
// the cache are read, converted and summarised by one thread each: the memory is read once. Throws FileFault.
PointSummary read_records(int file, long long offset, long count, const RecordLayout& layout, double factor, float* out, int threads = 0);

// The same from memory, where each of x, y, z is a column of its own, of native order: those of a binary_compressed PCD.
PointSummary gather_columns(const std::array<const std::uint8_t*, 3>& columns, const std::array<int, 3>& widths, long count, double factor,
                            float* out, int threads = 0);

}  // namespace debulk
