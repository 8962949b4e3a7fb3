#include "debulk/scanner/lens_blur.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <vector>

#include "debulk/core/median.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/core/pool.hpp"
#include "debulk/scanner/rectified_row.hpp"

namespace debulk {
namespace {

constexpr float most_ratio = 0.6f;   // greatest (a - b) / (a + b) two pixels apart: a factor of four is an edge
constexpr float edge_ratio = 3.0f;   // neighbouring phases further apart than this many median steps lie on two surfaces
constexpr long samples = 400'000;    // number of pixels that the estimate uses, about
constexpr double surest = 5;         // the estimate must be this many standard deviations above zero
constexpr double most_variance = 1;  // px²
constexpr int narrowest = 18;        // px that an image is wide, for the groups of sixteen
constexpr int reach = 2;             // px over which a bend is taken; rows to the texture that is the instrument

struct Row {
  const float* phase;
  const float* light;
};

std::size_t start_of(const FringeLight& light, int row) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(light.width);
}

// One value per pixel of the sampled rows at which all three are known.
struct Samples {
  std::vector<float> bend, texture, beside;  // bend of the phase; the bend that the texture predicts; that of the rows beside
};

// The rows round a sampled one: their light, and what the texture predicts of them (see `along` in the kernel).
struct Round {
  std::vector<float> light[2 * reach + 1], above, here, below;
};

#define DEBULK_KERNEL "debulk/scanner/lens_blur_kernel.inl"
#include "debulk/core/simd_dispatch.inl"

float edge_of(const float* phase, const FringeLight& light) {
  PhaseView view;
  view.phase = phase, view.width = light.width, view.height = light.height;
  return edge_ratio * median_step(view);
}

}  // namespace

double estimate_blur(const float* phase, const FringeLight& light, int threads, const Stop& stop) {
  const float edge = edge_of(phase, light);
  const int every = static_cast<int>(std::max(1L, static_cast<long>(light.width) * light.height / samples));
  const int count = (light.height - 2 * reach + every - 1) / every;
  if (!(edge > 0) || count < 1 || light.width < narrowest) return 0;
  const Isa isa = best_isa();
  std::vector<Samples> parts(static_cast<std::size_t>(count));
  parallel_for(count, 4, threads, stop, [&](long begin, long end) {
    Round rows;
    for (long k = begin; k < end; ++k)
      DEBULK_ON(isa, sample_row(phase, light, reach + static_cast<int>(k) * every, edge, rows, parts[static_cast<std::size_t>(k)]));
  });
  std::vector<float> bends;
  for (const Samples& part : parts)
    for (const float bend : part.bend) bends.push_back(std::abs(bend));
  if (bends.size() < 1000) return 0;
  const float usual = 6 * upper_median(bends);  // four standard deviations; larger bends lie on folds and edges
  double follows = 0, strength = 0;
  for (const Samples& s : parts)
    for (std::size_t i = 0; i < s.bend.size(); ++i)
      if (std::abs(s.bend[i]) <= usual)
        follows += static_cast<double>(s.bend[i]) * s.beside[i], strength += static_cast<double>(s.texture[i]) * s.beside[i];
  if (!(strength > 0)) return 0;
  const double variance = follows / strength;
  double squares = 0;
  for (const Samples& s : parts)
    for (std::size_t i = 0; i < s.bend.size(); ++i)
      if (std::abs(s.bend[i]) <= usual) squares += std::pow((s.bend[i] - variance * s.texture[i]) * s.beside[i], 2);
  return variance > surest * std::sqrt(squares) / strength ? std::min(variance, most_variance) : 0;
}

void take_out_blur(float* phase, const FringeLight& light, double variance, int threads, const Stop& stop, Isa isa) {
  if (!(variance > 0) || light.width < narrowest || light.height < 3) return;
  const float edge = edge_of(phase, light);
  const std::size_t width = static_cast<std::size_t>(light.width);
  constexpr int strip = 64;
  // Copies of the rows above and below each strip, because another thread may have changed the rows by the time they
  // are needed.
  const int strips = (light.height + strip - 1) / strip;
  std::vector<float> kept(2 * width * static_cast<std::size_t>(strips));
  for (int s = 0; s < strips; ++s) {
    const int above = std::max(s * strip - 1, 0), below = std::min((s + 1) * strip, light.height - 1);
    std::copy_n(phase + start_of(light, above), width, kept.data() + 2 * width * static_cast<std::size_t>(s));
    std::copy_n(phase + start_of(light, below), width, kept.data() + 2 * width * static_cast<std::size_t>(s) + width);
  }
  struct Work {
    std::vector<float> light[3], above, here;
  };
  Pool<Work> pool;
  parallel_for(strips, 1, threads, stop, [&](long begin, long end) {
    const auto work = pool.borrow();
    for (long s = begin; s < end; ++s) {
      const float* beyond = kept.data() + 2 * width * static_cast<std::size_t>(s);
      const int first = static_cast<int>(s) * strip, last = std::min(first + strip, light.height);
      work->above.assign(beyond, beyond + width);
      if (first > 0) DEBULK_ON(isa, light_of_row(light, first - 1, work->light[0]));
      DEBULK_ON(isa, light_of_row(light, first, work->light[1]));
      for (int row = first; row < last; ++row) {
        float* out = phase + start_of(light, row);
        work->here.assign(out, out + width);
        if (row + 1 < light.height) DEBULK_ON(isa, light_of_row(light, row + 1, work->light[2]));
        if (row > 0 && row + 1 < light.height) {
          const Row above{work->above.data(), work->light[0].data()}, here{work->here.data(), work->light[1].data()};
          const Row below{row + 1 < last ? out + width : beyond + width, work->light[2].data()};
          DEBULK_ON(isa, run(above, here, below, light.width, static_cast<float>(variance), edge, out));
        }
        std::swap(work->above, work->here);
        std::swap(work->light[0], work->light[1]), std::swap(work->light[1], work->light[2]);
      }
    }
  });
}

}  // namespace debulk
