#pragma once

#include <cstddef>
#include <cstdint>

namespace debulk {

// Undoes the LZF compression of a binary_compressed PCD. The result must fill `out` exactly; a length or a back reference
// that leads outside either buffer is a FileFault, its byte counted from `in`. Nothing outside the buffers is touched.
void decompress_lzf(const std::uint8_t* in, std::size_t in_bytes, std::uint8_t* out, std::size_t out_bytes);

// LZF cannot do better: three bytes for 264.
constexpr std::size_t max_lzf_ratio = 88;

}  // namespace debulk
