#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>

namespace debulk {

// The types of numbers in binary files, as NumPy names them without a byte order: kind and width in bytes.
enum class NumberType { i1, u1, i2, u2, i4, u4, i8, u8, f4, f8 };

// Throws InputError if there is no such type.
NumberType number_type(const std::string& name);

// Calls body with a value of the C++ type, for code that is written once for all types.
template <class Body>
auto with_type(NumberType type, const Body& body) {
  switch (type) {
    case NumberType::i1:
      return body(std::int8_t{});
    case NumberType::u1:
      return body(std::uint8_t{});
    case NumberType::i2:
      return body(std::int16_t{});
    case NumberType::u2:
      return body(std::uint16_t{});
    case NumberType::i4:
      return body(std::int32_t{});
    case NumberType::u4:
      return body(std::uint32_t{});
    case NumberType::i8:
      return body(std::int64_t{});
    case NumberType::u8:
      return body(std::uint64_t{});
    case NumberType::f4:
      return body(float{});
    default:
      return body(double{});
  }
}

inline int bytes_of(NumberType type) {
  return with_type(type, [](auto value) { return static_cast<int>(sizeof value); });
}

// Reads a number that may be unaligned, in the machine's byte order or, if swapped, in the other one.
template <class T>
T load_number(const std::uint8_t* from, bool swapped) {
  using Bits = std::conditional_t<
      sizeof(T) == 8, std::uint64_t,
      std::conditional_t<sizeof(T) == 4, std::uint32_t, std::conditional_t<sizeof(T) == 2, std::uint16_t, std::uint8_t>>>;
  Bits bits;
  std::memcpy(&bits, from, sizeof bits);
  if (swapped) {
    if constexpr (sizeof(T) == 8) bits = __builtin_bswap64(bits);
    if constexpr (sizeof(T) == 4) bits = __builtin_bswap32(bits);
    if constexpr (sizeof(T) == 2) bits = __builtin_bswap16(bits);
  }
  T value;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

}  // namespace debulk
