#pragma once

#include <optional>
#include <vector>

#include "debulk/files/number_type.hpp"

namespace debulk {

// A property of an element of a binary PLY file: one number, or a list of numbers that begins with its length.
struct PlyProperty {
  NumberType type = NumberType::f4;
  std::optional<NumberType> length;  // type of the length of a list; none for a single number
  int column = -1;                   // where the number, or a list's first number, is kept; -1: nowhere
};

// A kind of elements in which lists may occur, so that each element may have another size.
struct PlyElement {
  std::vector<PlyProperty> properties;
  long count = 0;
  int columns = 0;  // numbers that are kept of each element
  bool big_endian = false;
};

// Walks through the elements between two bytes of a file, and writes the numbers to be kept to `out`, count x columns;
// NaN for an empty list. Returns the byte after the last element. Only a small part of the file is in memory at a time.
// Throws FileFault if the elements do not end before `end`, or if a list has a negative length.
long long read_elements(int file, long long begin, long long end, const PlyElement& element, double* out);

}  // namespace debulk
