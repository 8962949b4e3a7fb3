#include "debulk/files/lzf.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <random>
#include <string>
#include <unordered_map>
#include <vector>

#include "debulk/files/file_fault.hpp"

namespace debulk {
namespace {

using Bytes = std::vector<std::uint8_t>;

void append_run(Bytes& out, const Bytes& in, std::size_t begin, std::size_t end) {
  for (; begin < end; begin += 32) {
    const std::size_t n = std::min<std::size_t>(32, end - begin);
    out.push_back(static_cast<std::uint8_t>(n - 1));
    out.insert(out.end(), in.begin() + static_cast<long>(begin), in.begin() + static_cast<long>(begin + n));
  }
}

// A plain LZF compressor: the last place where the next three bytes stood, if it is near enough.
Bytes compress(const Bytes& in) {
  Bytes out;
  std::unordered_map<std::uint32_t, std::size_t> seen;
  std::size_t run = 0, i = 0;
  while (i < in.size()) {
    std::size_t length = 0, distance = 0;
    if (i + 3 <= in.size()) {
      std::size_t& place = seen.try_emplace(in[i] | in[i + 1] << 8 | in[i + 2] << 16, i).first->second;
      distance = i - place;
      place = i;
      if (distance >= 1 && distance <= 8192)
        while (length < 264 && i + length < in.size() && in[i + length - distance] == in[i + length]) ++length;
    }
    if (length < 3) {
      ++i;
      continue;
    }
    append_run(out, in, run, i);
    const std::size_t far = distance - 1, code = length - 2;
    out.push_back(static_cast<std::uint8_t>(std::min<std::size_t>(code, 7) << 5 | far >> 8));
    if (code >= 7) out.push_back(static_cast<std::uint8_t>(code - 7));
    out.push_back(static_cast<std::uint8_t>(far));
    run = i += length;
  }
  append_run(out, in, run, i);
  return out;
}

Bytes decompress(const Bytes& in, std::size_t size) {
  Bytes out(size, 0xEE);
  decompress_lzf(in.data(), in.size(), out.data(), out.size());
  return out;
}

Bytes repetitive(std::mt19937& random, std::size_t size) {
  Bytes bytes;
  while (bytes.size() < size) {
    const std::size_t period = 1 + random() % (random() % 2 ? 20 : 9000), length = random() % 400;
    for (std::size_t k = 0; k < length; ++k)
      bytes.push_back(bytes.size() < period || random() % 50 == 0 ? static_cast<std::uint8_t>(random()) : bytes[bytes.size() - period]);
  }
  bytes.resize(size);
  return bytes;
}

std::string fault(const Bytes& in, std::size_t size) {
  try {
    decompress(in, size);
  } catch (const FileFault& error) {
    EXPECT_LE(error.byte(), static_cast<long long>(in.size()));
    return error.what();
  }
  return "";
}

TEST(Lzf, UndoesCompressionOfEveryPeriodAndLength) {
  for (std::size_t period = 1; period <= 40; ++period)
    for (const std::size_t size : {1, 2, 3, 8, 15, 16, 17, 31, 32, 33, 64, 263, 264, 265, 266, 280, 700}) {
      Bytes bytes(size);
      for (std::size_t k = 0; k < size; ++k) bytes[k] = static_cast<std::uint8_t>(k % period * 37 + 1);
      EXPECT_EQ(decompress(compress(bytes), size), bytes) << period << " " << size;
    }
}

TEST(Lzf, UndoesCompressionOfWhatRepeatsItselfFarBack) {
  std::mt19937 random(1);
  for (int round = 0; round < 40; ++round) {
    const Bytes bytes = repetitive(random, 1 + random() % 30000);
    const Bytes packed = compress(bytes);
    EXPECT_EQ(decompress(packed, bytes.size()), bytes);
  }
}

TEST(Lzf, NamesWhatIsWrong) {
  EXPECT_EQ(decompress({}, 0), Bytes{});
  EXPECT_EQ(decompress({2, 'a', 'b', 'c', 0x20, 2}, 6), (Bytes{'a', 'b', 'c', 'a', 'b', 'c'}));
  EXPECT_EQ(fault({}, 1), "the compressed data hold less than promised");
  EXPECT_EQ(fault({2, 'a', 'b', 'c'}, 4), "the compressed data hold less than promised");
  EXPECT_EQ(fault({2, 'a', 'b', 'c'}, 2), "the compressed data hold more than promised");
  EXPECT_EQ(fault({2, 'a', 'b', 'c', 0x20, 2}, 5), "the compressed data hold more than promised");
  EXPECT_EQ(fault({2, 'a', 'b'}, 3), "the compressed data end inside a run of bytes");
  EXPECT_EQ(fault({2, 'a', 'b', 'c', 0x20}, 6), "the compressed data end inside a back reference");
  EXPECT_EQ(fault({2, 'a', 'b', 'c', 0xE0, 1}, 99), "the compressed data end inside a back reference");
  EXPECT_EQ(fault({2, 'a', 'b', 'c', 0x20, 3}, 6), "the compressed data refer to what is before their start");
  EXPECT_EQ(fault({0x20, 0}, 3), "the compressed data refer to what is before their start");
}

TEST(Lzf, CannotDoBetterThanItsRatio) {
  const Bytes zeros(264 * 1000 + 1, 0);
  EXPECT_LE(zeros.size(), compress(zeros).size() * max_lzf_ratio);
}

// What it finds, it finds under `make asan`. DEBULK_FUZZ_ROUNDS asks for more rounds.
TEST(Lzf, StaysInsideItsBuffersWhateverTheBytes) {
  const char* const asked = std::getenv("DEBULK_FUZZ_ROUNDS");
  const long rounds = asked ? std::atol(asked) : 3000;
  std::mt19937 random(2);
  long accepted = 0;
  for (long round = 0; round < rounds; ++round) {
    const Bytes bytes = repetitive(random, 1 + random() % 2000);
    Bytes packed = round % 8 ? compress(bytes) : Bytes(random() % 300);
    if (round % 8 == 0)
      for (std::uint8_t& byte : packed) byte = static_cast<std::uint8_t>(random());
    for (unsigned k = random() % 5; k > 0 && !packed.empty(); --k) packed[random() % packed.size()] = static_cast<std::uint8_t>(random());
    if (random() % 4 == 0) packed.resize(random() % (packed.size() + 1));
    packed.shrink_to_fit();
    const std::size_t size = random() % 3 ? bytes.size() : random() % 4000;
    accepted += fault(packed, size).empty();
  }
  EXPECT_GT(accepted, 0);
  EXPECT_LT(accepted, rounds);
}

}  // namespace
}  // namespace debulk
