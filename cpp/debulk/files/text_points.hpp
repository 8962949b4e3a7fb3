#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "debulk/files/point_summary.hpp"

namespace debulk {

// Lines of numbers, three of which are x, y, z.
struct TextLayout {
  int columns = 3;                  // of every line
  std::array<int, 3> xyz{0, 1, 2};  // the columns of x, y, z
  char separator = ' ';             // ' ': blanks and tabs; else this character, blanks round it
  bool comments = false;            // # or // starts one, which goes to the end of the line

  void check() const;
};

// The points in a part of a text file: counted when made, so that the caller can provide the memory, then read. Empty
// lines are passed over. Every number has a decimal point; the language of the system does not matter. The file is read
// in blocks, each by one thread; the result, and the line that a FileFault names, do not depend on their number.
class TextPoints {
 public:
  // Bytes [begin, end) of the file, the first of which stands in line `first_line` (counted from 1).
  TextPoints(int file, long long begin, long long end, long first_line, const TextLayout& layout, int threads = 0,
             long long block_bytes = 1 << 20);

  long rows() const { return rows_; }

  // The first `rows` lines of numbers, times `factor`, into out (3 floats per point).
  PointSummary read(long rows, double factor, float* out) const;

 private:
  struct Block {
    long lines = 0, rows = 0;  // that start in it; when all are counted, before it
  };
  struct Text {
    std::vector<char> bytes;
    long long offset = 0;    // in the file, of the first
    std::string_view lines;  // whole lines: those that start in the block
  };

  Text block_text(long long first) const;
  bool holds_numbers(std::string_view line) const;
  void read_row(std::string_view line, long long offset, long number, double factor, float* out) const;

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
