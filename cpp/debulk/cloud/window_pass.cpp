#include "debulk/cloud/window_pass.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "debulk/core/wide.hpp"

namespace debulk {
namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float nan = std::numeric_limits<float>::quiet_NaN();

namespace base {
#include "debulk/cloud/window_kernel.inl"
}  // namespace base

#if defined(__x86_64__)
#pragma GCC push_options
#pragma GCC target("arch=x86-64-v3")
namespace v3 {
#include "debulk/cloud/window_kernel.inl"
}  // namespace v3
#pragma GCC pop_options

#define DEBULK_ISA_V4
#pragma GCC push_options
#pragma GCC target("arch=x86-64-v4")
namespace v4 {
#include "debulk/cloud/window_kernel.inl"
}  // namespace v4
#pragma GCC pop_options
#undef DEBULK_ISA_V4
#endif

}  // namespace

void Tiles::resize(int width, int height) {
  nx = (width + tile_width - 1) / tile_width, ny = (height + tile_height - 1) / tile_height;
  pitch = nx + 16;
  const std::size_t size = static_cast<std::size_t>(pitch) * static_cast<std::size_t>(ny);
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
#if defined(__x86_64__)
  if (pass.isa == Isa::v4) return v4::run(pass, band, out);
  if (pass.isa == Isa::v3) return v3::run(pass, band, out);
#endif
  base::run(pass, band, out);
}

}  // namespace debulk
