#include "debulk/files/text_points.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "debulk/core/error.hpp"
#include "debulk/files/file_fault.hpp"
#include "debulk/files/point_records.hpp"

namespace debulk {
namespace {

class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& bytes) : file_(std::tmpfile()), size_(static_cast<long>(bytes.size())) {
    std::fwrite(bytes.data(), 1, bytes.size(), file_);
    std::fflush(file_);
  }
  ~TemporaryFile() { std::fclose(file_); }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  int number() const { return fileno(file_); }
  long size() const { return size_; }

 private:
  std::FILE* file_;
  long size_;
};

std::vector<float> read(const std::string& text, const TextLayout& layout = {}, int threads = 1, double factor = 1,
                        long long block_bytes = 1 << 20) {
  const TemporaryFile file(text);
  const TextPoints points(file.number(), 0, file.size(), 1, layout, threads, block_bytes);
  std::vector<float> out(static_cast<std::size_t>(3 * points.rows()));
  points.read(points.rows(), factor, out.data());
  return out;
}

std::string fault(const std::string& text, const TextLayout& layout = {}, int threads = 1, long long block_bytes = 1 << 20) {
  try {
    read(text, layout, threads, 1, block_bytes);
  } catch (const FileFault& error) {
    return std::to_string(error.byte()) + ": " + error.what();
  }
  return "";
}

TextLayout commas(int columns, bool comments = false) {
  return {columns, {0, 1, 2}, ',', comments};
}

using Floats = std::vector<float>;

TEST(TextPoints, ReadsBlanksTabsSignsExponentsAndEmptyLines) {
  EXPECT_EQ(read("1 2 3\n\n \t-4\t+5.5  6e1 \r\n.5 -.5 1E-3"), (Floats{1, 2, 3, -4, 5.5F, 60, 0.5F, -0.5F, 1e-3F}));
  EXPECT_TRUE(std::isnan(read("1 nan 3\n")[1]));
  EXPECT_TRUE(std::isnan(read("1 -inf 3\n")[1]));
  EXPECT_EQ(read("").size(), 0U);
  EXPECT_EQ(read("0.1 0.2 0.3", {}, 1, 1000), (Floats{100, 200, 300}));
}

TEST(TextPoints, ReadsColumnsInAnyOrderAndPassesOverOthers) {
  EXPECT_EQ(read("9 z3 1 2\n", {4, {2, 3, 0}, ' ', false}), (Floats{1, 2, 9}));
  EXPECT_EQ(read("a b,3, 2 ,1\n,6,5,4\n", {4, {3, 2, 1}, ',', false}), (Floats{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(read("1,2,3,\n4,5,6,x\n", commas(4)), (Floats{1, 2, 3, 4, 5, 6}));
}

TEST(TextPoints, PassesOverCommentsWhereTheyAreAllowed) {
  const TextLayout allowed{3, {0, 1, 2}, ' ', true};
  EXPECT_EQ(read("# one\n1 2 3 # two\n // three\n4 5 6// four\n", allowed), (Floats{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(fault("# one\n"), "0: line 1: expected a number for x, got '#'");
}

TEST(TextPoints, ReadsWhatWasNotSeen) {
  for (const std::string word : {"", "NA", "n/a", "#N/A", "null", "None", "-", "---", "nan(ind)", "-1.#IND", "1.#QNAN0", "+inf"}) {
    const Floats points = read("1," + word + ",3\n4,5," + word + "\n" + word + ",8,9", commas(3, true));
    ASSERT_EQ(points.size(), 9U) << word;
    for (std::size_t k = 0; k < 9; ++k) EXPECT_EQ(std::isnan(points[k]), k == 1 || k == 5 || k == 6) << word;
  }
  EXPECT_TRUE(std::isnan(read("1,5;-1,#IND;3\n", {3, {0, 1, 2}, ';', true})[1]));
  EXPECT_TRUE(std::isnan(read("1\t\t3\n", {3, {0, 1, 2}, '\t', false})[1]));
  EXPECT_NE(fault("1 nano 3\n"), "");
}

TEST(TextPoints, ReadsQuotesAndDecimalCommas) {
  const TextLayout semicolons{3, {0, 1, 2}, ';', true};
  EXPECT_EQ(read("\"1.5\",\" 2\",3\n", commas(3)), (Floats{1.5F, 2, 3}));
  EXPECT_EQ(read("\"1,5\",2,\"3,5\"\n", commas(3)), (Floats{1.5F, 2, 3.5F}));
  EXPECT_EQ(read("\"a, \"\"b\"\"\",1,2,3\n", {4, {1, 2, 3}, ',', false}), (Floats{1, 2, 3}));
  for (const long long block_bytes : {1LL, 1LL << 20}) {
    EXPECT_EQ(read("1;2;3\n-4,25;,5;6,e1 # seven\n", semicolons, 3, 2, block_bytes), (Floats{2, 4, 6, -8.5F, 1, 120}));
    EXPECT_EQ(fault("1;2;3\n4,5;5.5;6\n7;8,x;9\n", semicolons, 3, block_bytes),
              "10: line 2: expected a number for y, got '5.5', but other numbers have decimal commas");
  }
  EXPECT_EQ(fault("1.234,5;2;3\n", semicolons), "0: line 1: expected a number for x, got '1.234,5' (with a sign between thousands?)");
  EXPECT_NE(fault("1,234,567 2 3\n").find("(with a sign between thousands?)"), std::string::npos);
  EXPECT_EQ(fault("\"1,2,3\n", commas(3)), "0: line 1: expected a number for x, got '\"1,2,3'");
}

TEST(TextPoints, NamesTheLineAndTheByte) {
  EXPECT_EQ(fault("1 2 3\n\n4 5x 6\n"), "9: line 3: expected a number for y, got '5x'");
  EXPECT_EQ(fault("1 2 3\n4 5\n"), "9: line 2: expected 3 numbers, found 2");
  EXPECT_EQ(fault("1 2 3 4\n"), "6: line 1: expected 3 numbers, found more");
  EXPECT_EQ(fault("1,2\n", commas(3)), "3: line 1: expected 3 numbers, found 2");
  EXPECT_EQ(fault("1,2,3,4\n", commas(3)), "5: line 1: expected 3 numbers, found more");
  EXPECT_EQ(fault("1 1e999 3\n"), "2: line 1: expected a number for y, got '1e999'");
  EXPECT_EQ(fault("1 +-2 3\n"), "2: line 1: expected a number for y, got '+-2'");
  EXPECT_EQ(fault(std::string("1 2 \0\x80\n", 7)), "4: line 1: expected a number for z, got '..'");
  EXPECT_THROW(read("1 2\n", {2, {0, 1, 1}, ' ', false}), InputError);
}

std::string many(long lines, long bad) {
  std::mt19937 random(3);
  std::string text;
  for (long i = 0; i < lines; ++i) {
    if (random() % 100 == 0) text += std::string(random() % 3000, ' ') + "\n";
    text += std::to_string(i) + " " + std::to_string(random() % 1000) + (i == bad ? ".bad 3\n" : ".25 -3e-2\n");
  }
  return text;
}

TEST(TextPoints, BlocksAndThreadsChangeNothing) {
  const std::string text = many(200000, -1);
  const Floats one = read(text), three = read(text, {}, 3);
  ASSERT_EQ(one.size(), 600000U);
  EXPECT_EQ(one, three);
  for (long i = 0; i < 200000; ++i) ASSERT_EQ(one[static_cast<std::size_t>(3 * i)], static_cast<float>(i));
  const std::string wrong = many(200000, 150000);
  EXPECT_NE(fault(wrong).find("expected a number for y"), std::string::npos);
  EXPECT_EQ(fault(wrong), fault(wrong, {}, 3));
}

// Also for `make asan`. DEBULK_FUZZ_ROUNDS asks for more rounds.
TEST(TextPoints, BlocksOfAnySizeSayTheSameOfAnyText) {
  const char* const asked = std::getenv("DEBULK_FUZZ_ROUNDS");
  const long rounds = asked ? std::atol(asked) : 500;
  const std::string alphabet = "0123456789.,;-+eE \t\r\n\n#/naif\"x";
  std::mt19937 random(5);
  const auto any = [&](std::size_t below) { return random() % below; };
  for (long round = 0; round < rounds; ++round) {
    const TextLayout layout{static_cast<int>(3 + any(2)), {2, 0, 1}, " ,;"[any(3)], any(2) == 0};
    std::string text;
    for (std::size_t line = any(12); line > 0; --line) {
      for (int column = 0; column < layout.columns; ++column)
        text += (column ? std::string(1, layout.separator) : "") + std::to_string(any(99)) + ".5";
      text += any(9) ? "\n" : " \r\n\n";
    }
    for (std::size_t change = any(3); change > 0 && !text.empty(); --change)
      text[any(text.size())] = any(8) ? alphabet[any(alphabet.size())] : static_cast<char>(any(256));
    if (any(4) == 0) text.resize(any(text.size() + 1));
    const std::string whole = fault(text, layout);
    for (const long long block_bytes : {1LL, 7LL, 64LL}) {
      ASSERT_EQ(fault(text, layout, 1, block_bytes), whole) << text;
      if (!whole.empty()) continue;
      const Floats one = read(text, layout), other = read(text, layout, 1, 1, block_bytes);
      ASSERT_EQ(one.size(), other.size());
      ASSERT_TRUE(one.empty() || std::memcmp(one.data(), other.data(), one.size() * sizeof(float)) == 0) << text;
    }
  }
}

TEST(TextPoints, RefusesLinesWithoutEnd) {
  EXPECT_NE(fault(std::string(3 << 20, '1')).find("a line of more than"), std::string::npos);
  EXPECT_EQ(fault("1 2 3 " + std::string((1 << 20) + 1000, ' ') + "\n4 5 6"), "");
}

TEST(PointRecords, ReadsAnyLayoutLikeTheObviousLoop) {
  struct Case {
    RecordLayout layout;
    double factor;
  };
  using T = NumberType;
  const std::vector<Case> cases{
      {{12, {0, 4, 8}, {T::f4, T::f4, T::f4}, false}, 1},     {{12, {0, 4, 8}, {T::f4, T::f4, T::f4}, false}, 1000},
      {{12, {0, 4, 8}, {T::f4, T::f4, T::f4}, true}, 1},      {{16, {8, 0, 12}, {T::f4, T::f4, T::f4}, false}, 1},
      {{31, {1, 13, 22}, {T::f8, T::f8, T::f8}, true}, 1000}, {{21, {0, 5, 13}, {T::f4, T::f8, T::f8}, false}, 1},
      {{15, {1, 3, 11}, {T::u2, T::i8, T::i4}, true}, 1},     {{9, {0, 1, 2}, {T::u1, T::i1, T::u4}, false}, 1000},
      {{700000, {9, 5, 1}, {T::f4, T::f4, T::f4}, false}, 1}};
  std::mt19937 random(4);
  for (const Case& c : cases) {
    const long count = c.layout.bytes > 1000 ? 3 : 150001;
    std::string bytes(7, '#');
    Floats expected;
    for (long i = 0; i < count; ++i) {
      std::string record(static_cast<std::size_t>(c.layout.bytes), '\0');
      for (std::size_t k = 0; k < 3; ++k) {
        const float value = static_cast<float>(random() % 6400) / 64;
        with_type(c.layout.types[k], [&](auto number) {
          number = static_cast<decltype(number)>(value);
          std::string raw(reinterpret_cast<const char*>(&number), sizeof number);
          if (c.layout.big_endian) raw = std::string(raw.rbegin(), raw.rend());
          record.replace(static_cast<std::size_t>(c.layout.offsets[k]), raw.size(), raw);
          expected.push_back(static_cast<float>(static_cast<double>(number) * c.factor));
        });
      }
      bytes += record;
    }
    const TemporaryFile file(bytes);
    for (const int threads : {1, 3}) {
      Floats out(expected.size());
      const PointSummary summary = read_records(file.number(), 7, count, c.layout, c.factor, out.data(), threads);
      EXPECT_EQ(out, expected);
      for (std::size_t k = 0; k < 3; ++k) {
        float low = expected[k], high = low;
        for (std::size_t i = k; i < expected.size(); i += 3) low = std::min(low, expected[i]), high = std::max(high, expected[i]);
        EXPECT_EQ(summary.low[k], low);
        EXPECT_EQ(summary.high[k], high);
      }
      EXPECT_EQ(summary.at_origin, 0);
    }
    Floats out(expected.size() + 3);
    EXPECT_THROW(read_records(file.number(), 7, count + 1, c.layout, 1, out.data(), 1), FileFault);
  }
}

TEST(PointSummary, PassesOverNanAndTheOrigin) {
  const float nan = std::nanf("");
  for (const long count : {1L, 7L, 8L, 9L, 1000L}) {
    Floats points(static_cast<std::size_t>(3 * count), nan);
    EXPECT_GT(summarise(points.data(), count).low[0], summarise(points.data(), count).high[0]);
    points[points.size() - 2] = -5;
    const PointSummary one = summarise(points.data(), count);
    EXPECT_EQ(one.low[1], -5);
    EXPECT_EQ(one.high[1], -5);
    EXPECT_GT(one.low[2], one.high[2]);
    std::fill(points.begin(), points.end(), 0.0F);
    EXPECT_EQ(summarise(points.data(), count).at_origin, count);
    points[points.size() - 1] = 70;
    const PointSummary last = summarise(points.data(), count);
    EXPECT_EQ(last.at_origin, count - 1);
    EXPECT_EQ(last.low[2], 70);
    EXPECT_EQ(last.high[0], 0);
  }
}

}  // namespace
}  // namespace debulk
