#pragma once

#include <cstddef>
#include <cstdint>

namespace debulk {

// Undoes the LZF compression of a PCD file of kind binary_compressed. The result must fill `out` exactly. Throws
// FileFault if it does not, or if a length or a back reference leads outside either buffer; the fault's byte is
// counted from `in`. Nothing outside the buffers is touched.
void decompress_lzf(const std::uint8_t* in, std::size_t in_bytes, std::uint8_t* out, std::size_t out_bytes);

// LZF cannot compress further than this: three bytes for 264.
constexpr std::size_t max_lzf_ratio = 88;

}  // namespace debulk
