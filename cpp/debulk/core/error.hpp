#pragma once

#include <sstream>
#include <stdexcept>
#include <string>

namespace debulk {

// What every room throws on bad input: one sentence with the argument's name, what was expected and what came.
// Python sees it as debulk.InputError, a ValueError.
class InputError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

// require(spacing > 0, "spacing_mm", "a positive length in mm", spacing);
template <class T>
void require(bool holds, const char* argument, const char* expected, const T& came) {
  if (holds) return;
  std::ostringstream message;
  message << argument << ": expected " << expected << ", but got " << came;
  throw InputError(message.str());
}

}  // namespace debulk
