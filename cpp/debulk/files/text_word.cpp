#include "debulk/files/text_word.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <string>

namespace debulk {
namespace {

constexpr std::size_t longest_word = 400;  // a double written out has at most some 330 digits before its point

bool starts_with(std::string_view word, std::string_view start) {
  return word.substr(0, start.size()) == start;
}

bool is_missing(std::string_view word) {
  constexpr std::size_t longest = 12;
  if (word.size() > longest) return false;
  std::array<char, longest> lower{};
  std::transform(word.begin(), word.end(), lower.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  std::string_view text(lower.data(), word.size());
  if (text.find_first_not_of('-') == std::string_view::npos) return true;  // also nothing at all
  constexpr std::array<std::string_view, 5> names{"na", "n/a", "#n/a", "null", "none"};
  if (std::find(names.begin(), names.end(), text) != names.end()) return true;
  if (text[0] == '-' || text[0] == '+') text.remove_prefix(1);
  if (!starts_with(text, "1.#") && !starts_with(text, "1,#")) return false;  // as Microsoft's C library wrote nan and inf until 2015
  text.remove_prefix(3);
  text = text.substr(0, text.find_last_not_of('0') + 1);
  constexpr std::array<std::string_view, 4> endings{"qnan", "snan", "ind", "inf"};
  return std::find(endings.begin(), endings.end(), text) != endings.end();
}

bool is_number(const char* from, const char* to, double& value) {
  if (to - from > 1 && *from == '+' && from[1] != '-') ++from;
  const std::from_chars_result read = std::from_chars(from, to, value);
  if (read.ec != std::errc() || read.ptr != to) return false;
  if (std::isinf(value)) value = std::numeric_limits<double>::quiet_NaN();  // written out: a number too large is an error
  return true;
}

}  // namespace

TextWord read_word(std::string_view word, double& value) {
  if (is_number(word.data(), word.data() + word.size(), value)) return TextWord::number;
  if (is_missing(word)) {
    value = std::numeric_limits<double>::quiet_NaN();
    return TextWord::missing;
  }
  const long commas = std::count(word.begin(), word.end(), ','), points = std::count(word.begin(), word.end(), '.');
  const bool signs = word.size() < longest_word && word.find_first_not_of("0123456789.,+-eE") == std::string_view::npos;
  if (!signs || commas == 0) return TextWord::no_number;
  if (commas > 1 || points > 0) return TextWord::two_signs;
  std::string text(word);
  text[word.find(',')] = '.';
  return is_number(text.data(), text.data() + text.size(), value) ? TextWord::decimal_comma : TextWord::no_number;
}

}  // namespace debulk
