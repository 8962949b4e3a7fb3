#include "debulk/files/number_type.hpp"

#include <array>
#include <cstddef>

#include "debulk/core/error.hpp"

namespace debulk {

NumberType number_type(const std::string& name) {
  constexpr std::array<const char*, 10> names{"i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f4", "f8"};
  std::size_t k = 0;
  while (k < names.size() && name != names[k]) ++k;
  require(k < names.size(), "types", "one of i1, u1, i2, u2, i4, u4, i8, u8, f4, f8", name);
  return static_cast<NumberType>(k);
}

}  // namespace debulk
