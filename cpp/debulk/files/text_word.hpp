#pragma once

#include <string_view>

namespace debulk {

// What a word in a column of numbers is. A missing value is written in many ways: nan(ind), 1.#QNAN, inf, NA, N/A, null,
// none, dashes, or nothing at all.
enum class TextWord {
  number,
  missing,
  decimal_comma,  // a number, but with a decimal comma
  two_signs,      // points and commas, or several of them: a sign between thousands
  no_number,
};

// Reads a word without blanks round it, whose quotes are off. `value` is set for numbers and missing values (NaN), also
// for those with a decimal comma.
TextWord read_word(std::string_view word, double& value);

}  // namespace debulk
