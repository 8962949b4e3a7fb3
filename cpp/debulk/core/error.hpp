#pragma once

#include <sstream>
#include <stdexcept>
#include <string>

namespace debulk {

// Every part of the library throws this on bad input. The message is one sentence with the argument's name, what was
// expected and what was given. Python sees it as debulk.InputError, a ValueError.
class InputError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

// Throws InputError unless `holds` is true; `came` is the value that was given. For example:
// require(spacing > 0, "spacing_mm", "a positive length in mm", spacing);
template <class T>
void require(bool holds, const char* argument, const char* expected, const T& came) {
  if (holds) return;
  std::ostringstream message;
  message << argument << ": expected " << expected << ", but got " << came;
  throw InputError(message.str());
}

}  // namespace debulk
