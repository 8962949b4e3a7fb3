#include "debulk/files/text_points.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <string>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/files/file_fault.hpp"
#include "debulk/files/text_word.hpp"

namespace debulk {
namespace {

constexpr long long longest_line = 1 << 16;

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r';
}

bool starts_comment(const char* at, const char* end) {
  if (at == end || (*at != '#' && *at != '/')) return false;
  if (*at == '/') return at + 1 < end && at[1] == '/';
  return end - at < 4 || std::memcmp(at, "#N/A", 4) != 0;  // spreadsheets write #N/A for a missing value
}

// The end of the line that starts at `from`, which is its newline or the end of the text.
const char* line_end(const char* from, const char* end) {
  const void* found = std::memchr(from, '\n', static_cast<std::size_t>(end - from));
  return found ? static_cast<const char*>(found) : end;
}

std::string shown(std::string_view word) {
  std::string text;
  for (const char c : word.substr(0, 40)) text += c >= ' ' && c <= '~' ? c : '.';
  return "'" + text + "'";
}

// Thrown at the first decimal comma, since the file must then be read from its start by that sign.
struct DecimalComma {};

}  // namespace

void TextLayout::check() const {
  require(columns >= 3, "columns", "at least 3", columns);
  for (const int column : xyz) require(column >= 0 && column < columns, "xyz", "a column of the line", column);
}

TextPoints::TextPoints(int file, long long begin, long long end, long first_line, const TextLayout& layout, int threads,
                       long long block_bytes)
    : file_(file), begin_(begin), end_(end), first_line_(first_line), layout_(layout), threads_(threads), block_bytes_(block_bytes) {
  layout.check();
  require(block_bytes > 0, "block_bytes", "a positive number of bytes", block_bytes);
  require(begin >= 0 && begin <= end, "begin", "at least 0 and at most the end", begin);
  blocks_.resize(static_cast<std::size_t>((end - begin + block_bytes - 1) / block_bytes));
  parallel_for(static_cast<long>(blocks_.size()), 1, threads, [&](long k, long) {
    const Text text = block_text(k * block_bytes);
    Block& block = blocks_[static_cast<std::size_t>(k)];
    const char* const last = text.lines.data() + text.lines.size();
    for (const char* at = text.lines.data(); at < last; ++block.lines) {
      const char* const stop = line_end(at, last);
      block.rows += holds_numbers({at, static_cast<std::size_t>(stop - at)});
      at = stop + 1;
    }
  });
  long lines = 0;
  for (Block& block : blocks_) {
    const Block counted = block;
    block = {lines, rows_};
    lines += counted.lines;
    rows_ += counted.rows;
  }
}

// The lines that start in the block whose first byte is `first` bytes after begin_. The last line is complete, even if
// it goes on in the next block.
TextPoints::Text TextPoints::block_text(long long first) const {
  // The byte before the block shows whether a line starts with the block.
  const long long before = first > 0 ? 1 : 0, from = begin_ + first - before;
  const long long own_end = std::min(end_, begin_ + first + block_bytes_);
  Text text;
  text.offset = from;
  text.bytes.resize(static_cast<std::size_t>(own_end - from));
  read_at(file_, from, text.bytes.data(), own_end - from);

  const char* own = text.bytes.data() + text.bytes.size();
  const char* start = text.bytes.data();
  if (before) start = std::min(line_end(start, own) + 1, own);
  const long long skip = start - text.bytes.data();
  if (start == own) return text;
  if (text.bytes.back() != '\n' && own_end < end_) {  // the last line goes on in the next block
    const std::size_t size = text.bytes.size();
    const long long more = std::min(end_ - own_end, longest_line);
    text.bytes.resize(size + static_cast<std::size_t>(more));
    read_at(file_, own_end, text.bytes.data() + size, more);
    const char* const last = text.bytes.data() + text.bytes.size();
    const char* const stop = line_end(text.bytes.data() + size, last);
    if (stop == last && own_end + more < end_) throw FileFault(own_end, "a line of more than " + std::to_string(longest_line) + " bytes");
    text.bytes.resize(static_cast<std::size_t>(stop - text.bytes.data()));
  }
  text.offset += skip;
  text.lines = std::string_view(text.bytes.data() + skip, text.bytes.size() - static_cast<std::size_t>(skip));
  return text;
}

bool TextPoints::holds_numbers(std::string_view line) const {
  const char* at = line.data();
  const char* const end = at + line.size();
  while (at < end && is_blank(*at)) ++at;
  return at < end && !(layout_.comments && starts_comment(at, end));
}

// The column that starts at `from`, up to its separator or a comment, with its quotes but without blanks at its end.
std::string_view TextPoints::next_word(const char* from, const char* end) const {
  const bool by_blanks = layout_.separator == ' ';
  const char* at = from;
  while (at < end && *at == '"') {  // what is between quotes may hold separators; a quote in it is written twice
    at = std::find(at + 1, end, '"');
    if (at < end) ++at;
  }
  for (; at < end && (by_blanks ? !is_blank(*at) : *at != layout_.separator); ++at)
    if (layout_.comments && starts_comment(at, end) && !(*at == '#' && at - from > 1 && (at[-1] == '.' || at[-1] == ',')))
      break;  // not at 1.#QNAN
  while (at > from && is_blank(at[-1])) --at;
  return {from, static_cast<std::size_t>(at - from)};
}

void TextPoints::read_row(std::string_view line, long long offset, long number, bool commas, double factor, float* out) const {
  const char* at = line.data();
  const char* const end = at + line.size();
  const auto fail = [&](const char* where, const std::string& problem) {
    throw FileFault(offset + (where - line.data()), "line " + std::to_string(number) + ": " + problem);
  };
  const bool by_blanks = layout_.separator == ' ', by_tabs = layout_.separator == '\t';
  const auto blank = [&](char c) { return is_blank(c) && !(by_tabs && c == '\t'); };
  const auto skip_blanks = [&] {
    while (at < end && blank(*at)) ++at;
  };
  const auto over = [&](const char* place) { return place == end || (layout_.comments && starts_comment(place, end)); };
  const auto expected = [&] { return "expected " + std::to_string(layout_.columns) + " numbers, found "; };
  skip_blanks();
  for (int column = 0; column < layout_.columns; ++column) {
    std::size_t axis = 0;
    while (axis < 3 && layout_.xyz[axis] != column) ++axis;
    if (over(at) && (by_blanks || column == 0)) fail(at, expected() + std::to_string(column));
    if (axis < 3) {
      const char* const token = at;
      double value = 0;
      if (!commas) {
        const std::from_chars_result read = std::from_chars(at + 1 < end && *at == '+' && at[1] != '-' ? at + 1 : at, end, value);
        at = read.ec == std::errc() ? read.ptr : token;
      }
      // Neither a number that goes on, as 1.#QNAN and 4,5 do, nor a word for infinity is finished.
      const bool finished =
          at != token && (at == end || blank(*at) || (!by_blanks && *at == layout_.separator) || (over(at) && at[-1] != '.'));
      if (!finished || std::isinf(value)) {
        std::string_view word = next_word(token, end);
        at = word.data() + word.size();
        if (word.size() > 1 && word.front() == '"' && word.back() == '"') word = word.substr(1, word.size() - 2);
        while (!word.empty() && is_blank(word.front())) word.remove_prefix(1);
        while (!word.empty() && is_blank(word.back())) word.remove_suffix(1);
        const auto wrong = [&](const std::string& why) {
          fail(token, std::string("expected a number for ") + "xyz"[axis] + ", got " + shown(word) + why);
        };
        const TextWord kind = read_word(word, value);
        if (kind == TextWord::two_signs) wrong(" (with a sign between thousands?)");
        if (kind == TextWord::no_number) wrong("");
        if (kind == TextWord::decimal_comma && !commas) throw DecimalComma();
        if (kind == TextWord::number && commas && word.find('.') != std::string_view::npos)
          wrong(", but other numbers have decimal commas");
      }
      out[axis] = static_cast<float>(value * factor);
    } else {
      at += next_word(at, end).size();
    }
    skip_blanks();
    if (!by_blanks && column + 1 < layout_.columns) {
      if (at == end || *at != layout_.separator) fail(at, expected() + std::to_string(column + 1));
      ++at;
      skip_blanks();
    }
  }
  if (!over(at)) fail(at, expected() + "more");
}

PointSummary TextPoints::read(long rows, double factor, float* out) const {
  try {
    return read(rows, false, factor, out);
  } catch (const DecimalComma&) {
    return read(rows, true, factor, out);
  }
}

PointSummary TextPoints::read(long rows, bool commas, double factor, float* out) const {
  require(rows >= 0 && rows <= rows_, "rows", "at most those of the file", rows);
  std::vector<PointSummary> parts(blocks_.size());
  parallel_for(static_cast<long>(blocks_.size()), 1, threads_, [&](long k, long) {
    const Block& block = blocks_[static_cast<std::size_t>(k)];
    const long next = k + 1 < static_cast<long>(blocks_.size()) ? blocks_[static_cast<std::size_t>(k) + 1].rows : rows_;
    const long last_row = std::min(rows, next);
    if (block.rows >= last_row) return;
    const Text text = block_text(k * block_bytes_);
    const char* const last = text.lines.data() + text.lines.size();
    long number = first_line_ + block.lines, row = block.rows;
    for (const char* at = text.lines.data(); at < last && row < last_row; ++number) {
      const char* const stop = line_end(at, last);
      const std::string_view line(at, static_cast<std::size_t>(stop - at));
      if (holds_numbers(line)) read_row(line, text.offset + (at - text.lines.data()), number, commas, factor, out + 3 * row++);
      at = stop + 1;
    }
    if (row != last_row) throw FileFault(text.offset, "the file changed while it was read");
    parts[static_cast<std::size_t>(k)] = summarise(out + 3 * block.rows, row - block.rows);
  });
  PointSummary all;
  for (const PointSummary& part : parts) all.merge(part);
  return all;
}

}  // namespace debulk
