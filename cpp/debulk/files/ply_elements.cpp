#include "debulk/files/ply_elements.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>

#include "debulk/core/error.hpp"
#include "debulk/files/file_fault.hpp"

namespace debulk {
namespace {

constexpr long long window_bytes = 1 << 16;

// A place in a file that moves forward, with the bytes that follow it in memory.
class Walk {
 public:
  Walk(int file, long long begin, long long end, bool swapped) : file_(file), place_(begin), end_(end), swapped_(swapped) {}

  long long place() const { return place_; }

  double next(NumberType type) {
    return with_type(type, [this](auto value) {
      using T = decltype(value);
      const std::uint8_t* const from = bytes(sizeof(T));
      place_ += static_cast<long long>(sizeof(T));
      return static_cast<double>(load_number<T>(from, swapped_));
    });
  }

  void skip(long long bytes) {
    if (bytes > end_ - place_) fail();
    place_ += bytes;
  }

 private:
  [[noreturn]] void fail() const { throw FileFault(place_, "the file ends inside an element"); }

  const std::uint8_t* bytes(std::size_t wanted) {
    const auto need = static_cast<long long>(wanted);
    if (need > end_ - place_) fail();
    if (place_ < first_ || place_ + need > first_ + filled_) {
      first_ = place_;
      filled_ = std::min(window_bytes, end_ - place_);
      read_at(file_, first_, window_.get(), filled_);
    }
    return window_.get() + (place_ - first_);
  }

  const int file_;
  long long place_;
  const long long end_;
  const bool swapped_;
  const std::unique_ptr<std::uint8_t[]> window_{new std::uint8_t[window_bytes]};
  long long first_ = 0, filled_ = 0;  // bytes of the file that are in the window
};

}  // namespace

long long read_elements(int file, long long begin, long long end, const PlyElement& element, double* out) {
  for (const PlyProperty& property : element.properties) {
    require(property.column < element.columns, "properties", "columns below their number", property.column);
    require(!property.length || static_cast<int>(*property.length) <= static_cast<int>(NumberType::u4), "properties",
            "the length of a list as a whole number of at most 4 bytes", bytes_of(*property.length));
  }
  Walk walk(file, begin, end, element.big_endian);
  for (long row = 0; row < element.count; ++row, out += element.columns)
    for (const PlyProperty& property : element.properties) {
      const long long start = walk.place();
      const auto length = property.length ? static_cast<long long>(walk.next(*property.length)) : 1;
      if (length < 0) throw FileFault(start, "a list of negative length");
      if (length == 0 && property.column >= 0) out[property.column] = std::numeric_limits<double>::quiet_NaN();
      if (length == 0) continue;
      const double first = walk.next(property.type);
      if (property.column >= 0) out[property.column] = first;
      walk.skip((length - 1) * bytes_of(property.type));
    }
  return walk.place();
}

}  // namespace debulk
