#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "debulk/files/point_summary.hpp"

namespace debulk {

// The layout of lines of numbers, three of which are x, y and z.
struct TextLayout {
  int columns = 3;                  // number of columns in every line
  std::array<int, 3> xyz{0, 1, 2};  // the columns of x, y, z
  char separator = ' ';             // ' ' stands for blanks and tabs; any other character may have blanks around it
  bool comments = false;            // whether # or // starts a comment, which goes to the end of the line

  void check() const;
};

// The points in a part of a text file. The constructor counts them, so that the caller can provide the memory; read()
// then reads them. Empty lines are ignored, and columns may stand in quotes. What was not seen (see text_word.hpp) becomes
// NaN. The decimal sign is a point in all numbers or a comma in all, whatever the language of the system; a comma that
// separates columns is none. The file is read in blocks, each by one thread; neither the result nor the line that a
// FileFault names depends on the number of threads.
class TextPoints {
 public:
  // Bytes [begin, end) of the file are read. The first of them stands in line `first_line` (counted from 1).
  TextPoints(int file, long long begin, long long end, long first_line, const TextLayout& layout, int threads = 0,
             long long block_bytes = 1 << 20);

  long rows() const { return rows_; }

  // Reads the first `rows` lines of numbers, times `factor`, into `out` (3 floats per point).
  PointSummary read(long rows, double factor, float* out) const;

 private:
  struct Block {
    long lines = 0, rows = 0;  // number that start in the block; once all blocks are counted, number before the block
  };
  struct Text {
    std::vector<char> bytes;
    long long offset = 0;    // position of the first byte in the file
    std::string_view lines;  // the whole lines that start in the block
  };

  Text block_text(long long first) const;
  bool holds_numbers(std::string_view line) const;
  std::string_view next_word(const char* from, const char* end) const;
  void read_row(std::string_view line, long long offset, long number, bool commas, double factor, float* out) const;
  PointSummary read(long rows, bool commas, double factor, float* out) const;

  int file_;
  long long begin_, end_;
  long first_line_;
  TextLayout layout_;
  int threads_;
  long long block_bytes_;
  std::vector<Block> blocks_;
  long rows_ = 0;
};

}  // namespace debulk
