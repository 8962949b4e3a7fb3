#pragma once

#include <string>

#include "debulk/core/error.hpp"

namespace debulk {

// What the InputError of a call says; "no error" where it throws none.
template <class Call>
std::string message(const Call& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

}  // namespace debulk
