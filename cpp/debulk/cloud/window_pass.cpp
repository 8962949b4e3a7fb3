#include "debulk/cloud/window_pass.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "debulk/core/simd.hpp"

namespace debulk {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float nan = std::numeric_limits<float>::quiet_NaN();

#define DEBULK_KERNEL "debulk/cloud/window_kernel.inl"
#include "debulk/core/simd_dispatch.inl"

}  // namespace

void Tiles::resize(int width, int height) {
  const int across = (width + tile_width - 1) / tile_width, down = (height + tile_height - 1) / tile_height;
  if (across == nx && down == ny) return;
  nx = across, ny = down, pitch = nx + 16;
  const std::size_t size = static_cast<std::size_t>(pitch) * static_cast<std::size_t>(ny + 1);
  near.assign(size, infinity);
  far.assign(size, -infinity);
  mean_height.assign(size, nan);
}

void WindowBand::clear() {
  sum = squares = 0;
  certain = seen = strays = 0;
  open.clear(), close.clear();
}

void window_pass(const WindowPass& pass, int band, WindowBand& out) {
  return DEBULK_ON(pass.isa, run(pass, band, out));
}

}  // namespace debulk
