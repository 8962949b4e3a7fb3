#include "debulk/files/lzf.hpp"

#include <cstring>

#include "debulk/files/file_fault.hpp"

namespace debulk {
namespace {

constexpr std::size_t block = 16;

// Copies whole blocks, up to one block past the end. The caller has checked that there is room.
inline void copy_blocks(std::uint8_t* to, const std::uint8_t* from, std::size_t length) {
  for (std::size_t k = 0; k < length; k += block) std::memcpy(to + k, from + k, block);
}

// Copies `length` bytes from `distance` bytes back. A back reference may reach into the bytes that it writes; then the
// last `distance` bytes are repeated.
inline void repeat(std::uint8_t* to, std::size_t distance, std::size_t length, std::size_t room) {
  const std::uint8_t* const from = to - distance;
  // The written part is a whole number of repetitions, so the distance can double each time.
  while (distance < block && length > distance) {
    std::memcpy(to, from, distance);
    to += distance;
    length -= distance;
    room -= distance;
    distance *= 2;
  }
  if (distance >= block && room >= length + block)
    copy_blocks(to, from, length);
  else
    for (std::size_t k = 0; k < length; ++k) to[k] = from[k];
}

}  // namespace

// The format: a control byte c below 32 is followed by c + 1 bytes, which are copied. The upper three bits of any
// other control byte are the length of a back reference less two (if they are 7, the next byte is added to the
// length); its lower five bits, together with the byte after that, are the distance less one.
void decompress_lzf(const std::uint8_t* in, std::size_t in_bytes, std::uint8_t* out, std::size_t out_bytes) {
  std::size_t read = 0, written = 0;
  const auto fail = [&](const char* problem) { throw FileFault(static_cast<long long>(read), problem); };
  while (read < in_bytes) {
    const std::size_t control = in[read++];
    if (control < 32) {
      const std::size_t length = control + 1;
      if (length > in_bytes - read) fail("the compressed data end inside a run of bytes");
      if (length > out_bytes - written) fail("the compressed data hold more than promised");
      if (in_bytes - read >= length + block && out_bytes - written >= length + block)
        copy_blocks(out + written, in + read, length);
      else
        std::memcpy(out + written, in + read, length);
      read += length;
      written += length;
      continue;
    }
    std::size_t length = (control >> 5) + 2;
    if (in_bytes - read < (length == 9 ? 2 : 1)) fail("the compressed data end inside a back reference");
    if (length == 9) length += in[read++];
    const std::size_t distance = ((control & 31) << 8 | in[read++]) + 1;
    if (distance > written) fail("the compressed data refer to what is before their start");
    if (length > out_bytes - written) fail("the compressed data hold more than promised");
    repeat(out + written, distance, length, out_bytes - written);
    written += length;
  }
  if (written != out_bytes) fail("the compressed data hold less than promised");
}

}  // namespace debulk
