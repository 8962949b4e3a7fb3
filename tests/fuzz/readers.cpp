// Fuzzes the C++ readers of files (libFuzzer, with the address and undefined-behaviour sanitizers): whatever the bytes, a
// reader reads them or throws FileFault or InputError. The first byte chooses the reader, the next ones its layout.
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstring>
#include <vector>

#include "debulk/core/error.hpp"
#include "debulk/files/file_fault.hpp"
#include "debulk/files/lzf.hpp"
#include "debulk/files/ply_elements.hpp"
#include "debulk/files/point_records.hpp"
#include "debulk/files/text_points.hpp"

namespace {

constexpr std::size_t most_bytes = 1 << 16;

// Takes bytes off the front of what the fuzzer gives.
struct Bytes {
  const std::uint8_t* data;
  std::size_t size;

  std::uint8_t next() {
    if (size == 0) return 0;
    --size;
    return *data++;
  }
  int below(int n) { return next() % n; }
};

// A file in memory with the bytes that are left.
struct File {
  int fd;

  explicit File(const Bytes& bytes) : fd(memfd_create("fuzz", 0)) {
    if (bytes.size > 0 && write(fd, bytes.data, bytes.size) < 0) _exit(1);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  ~File() { close(fd); }
};

debulk::NumberType type(Bytes& bytes) {
  return static_cast<debulk::NumberType>(bytes.below(10));
}

void read_text(Bytes bytes) {
  debulk::TextLayout layout;
  layout.columns = 1 + bytes.below(6);
  for (int& column : layout.xyz) column = bytes.below(8) - 1;
  layout.separator = " ,;\t"[bytes.below(4)];
  layout.comments = bytes.below(2) == 1;
  const long long block = 16 + bytes.next();
  const File file(bytes);
  const debulk::TextPoints points(file.fd, 0, static_cast<long long>(bytes.size), 1, layout, 1, block);
  std::vector<float> out(3 * static_cast<std::size_t>(points.rows()));
  points.read(points.rows(), 1.0, out.data());
}

void read_ply(Bytes bytes) {
  debulk::PlyElement element;
  element.columns = 3;
  element.big_endian = bytes.below(2) == 1;
  element.count = bytes.next();
  const int properties = 1 + bytes.below(5);
  for (int k = 0; k < properties; ++k) {
    debulk::PlyProperty property;
    property.type = type(bytes);
    if (bytes.below(2) == 1) property.length = type(bytes);
    property.column = k < 3 ? k : -1;
    element.properties.push_back(property);
  }
  const File file(bytes);
  std::vector<double> out(static_cast<std::size_t>(element.columns * element.count));
  debulk::read_elements(file.fd, 0, static_cast<long long>(bytes.size), element, out.data());
}

void unpack(Bytes bytes) {
  std::vector<std::uint8_t> out(static_cast<std::size_t>(bytes.next()) * 16);
  const std::vector<std::uint8_t> in(bytes.data, bytes.data + bytes.size);  // of exactly this size: a byte too far is seen
  debulk::decompress_lzf(in.data(), in.size(), out.data(), out.size());
}

void read_records(Bytes bytes) {
  debulk::RecordLayout layout;
  layout.bytes = bytes.next();
  for (long& offset : layout.offsets) offset = bytes.next();
  for (debulk::NumberType& one : layout.types) one = type(bytes);
  layout.big_endian = bytes.below(2) == 1;
  const long count = bytes.next();
  const long long offset = bytes.next();
  layout.check();
  const File file(bytes);
  std::vector<float> out(3 * static_cast<std::size_t>(count));
  debulk::read_records(file.fd, offset, count, layout, 1.0, out.data(), 1);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > most_bytes) return -1;
  Bytes bytes{data, size};
  try {
    switch (bytes.below(4)) {
      case 0:
        read_text(bytes);
        break;
      case 1:
        read_ply(bytes);
        break;
      case 2:
        unpack(bytes);
        break;
      default:
        read_records(bytes);
    }
  } catch (const debulk::FileFault&) {
  } catch (const debulk::InputError&) {
  }
  return 0;
}
