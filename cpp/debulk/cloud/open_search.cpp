#include "debulk/cloud/open_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "debulk/core/parallel.hpp"
#include "debulk/core/simd.hpp"

namespace debulk {
namespace {

constexpr int bin_side = 32;  // pixels
constexpr float infinity = std::numeric_limits<float>::infinity();

// The search's input. The arrays of points have 16 more entries than there are points.
struct OpenTables {
  const WindowPass* pass;
  double stretch;
  const float *u_low, *u_high, *v_low, *v_high;
  int bins_x;
  const std::uint32_t *starts, *index;
  const float *x, *y, *z, *limit;
  bool multiples = true;  // searched are the points whose number is a multiple of `every`, or all others
  std::uint32_t every = 1;
  float radius = 0, enough = 0;  // mm, see Finder::find
};

struct NearTile {
  float bound;  // mm2
  int x, y;
};

#define DEBULK_KERNEL "debulk/cloud/open_kernel.inl"
#include "debulk/core/simd_dispatch.inl"

void search(Isa isa, const OpenTables& tables, long begin, long end, float* distances) {
  return DEBULK_ON(isa, run(tables, begin, end, distances));
}

}  // namespace

void OpenSearch::prepare(const WindowPass& pass, const std::vector<WindowBand>& bands, int threads) {
  pass_ = pass;
  const CloudView& cloud = pass.cloud;
  const double slack = pass.tolerance / pass.camera.f;
  double widest = 0;
  for (const double at : {pass.camera.u(0), pass.camera.u(cloud.width - 1.0), pass.camera.v(0), pass.camera.v(cloud.height - 1.0)})
    widest = std::max(widest, std::abs(at) + slack);
  stretch_ = std::sqrt(1 + widest * widest);
  const auto bound = [&](std::vector<float>& low, std::vector<float>& high, int count, int side, const auto& ray) {
    low.resize(static_cast<std::size_t>(count)), high.resize(low.size());
    for (std::size_t t = 0; t < low.size(); ++t) {
      low[t] = static_cast<float>(ray(static_cast<double>(t) * side) - slack);
      high[t] = static_cast<float>(ray(static_cast<double>(t + 1) * side - 1) + slack);
    }
  };
  bound(u_low_, u_high_, pass.tiles->pitch, tile_width, [&](double at) { return pass.camera.u(at); });
  bound(v_low_, v_high_, pass.tiles->ny, tile_height, [&](double at) { return pass.camera.v(at); });

  bins_x_ = (cloud.width + bin_side - 1) / bin_side;
  const int bins_y = (cloud.height + bin_side - 1) / bin_side;
  static_assert(band_rows % bin_side == 0);  // a bin belongs to one band
  const std::size_t bins = static_cast<std::size_t>(bins_x_) * static_cast<std::size_t>(bins_y);
  std::vector<std::uint32_t> first(bands.size() + 1, 0);
  for (std::size_t b = 0; b < bands.size(); ++b) first[b + 1] = first[b] + static_cast<std::uint32_t>(bands[b].open.size());
  count_ = first.back();
  starts_.resize(bins + 1), starts_[bins] = first.back();
  const std::size_t padded = count_ + 16;
  index_.resize(padded), x_.resize(padded), y_.resize(padded), z_.resize(padded), limit_.resize(padded);
  parallel_for(static_cast<long>(bands.size()), 1, threads, [&](long begin, long) {
    const auto band = static_cast<std::size_t>(begin);
    const auto width = static_cast<std::uint32_t>(cloud.width);
    const auto bin_of = [&](const OpenPixel& p) {
      return static_cast<std::size_t>(p.index / width / bin_side) * static_cast<std::size_t>(bins_x_) + p.index % width / bin_side;
    };
    const std::size_t low = band * (band_rows / bin_side) * static_cast<std::size_t>(bins_x_);
    const std::size_t high = std::min(bins, low + band_rows / bin_side * static_cast<std::size_t>(bins_x_));
    std::fill(&starts_[low], &starts_[high], 0);
    for (const OpenPixel& p : bands[band].open) ++starts_[bin_of(p)];
    std::uint32_t end = first[band];
    for (std::size_t b = low; b < high; ++b) end += std::exchange(starts_[b], end);
    for (const OpenPixel& p : bands[band].open) {
      const std::uint32_t at = starts_[bin_of(p)]++;
      index_[at] = p.index, x_[at] = p.x, y_[at] = p.y, z_[at] = p.z, limit_[at] = p.limit;
    }
    for (std::size_t b = high - 1; b > low; --b) starts_[b] = starts_[b - 1];  // filling the bins moved them on
    starts_[low] = first[band];
  });
}

void OpenSearch::measure(std::vector<float>& distances, std::size_t every, double pitch, int threads, const Stop& stop) const {
  run(distances, true, every, 4 * pitch, std::numeric_limits<double>::infinity(), threads, stop);
}

void OpenSearch::decide(std::vector<float>& distances, std::size_t every, double threshold, int threads, const Stop& stop) const {
  run(distances, false, every, 4 * threshold / 3, threshold, threads, stop);
}

void OpenSearch::run(std::vector<float>& distances, bool multiples, std::size_t every, double radius, double enough, int threads,
                     const Stop& stop) const {
  OpenTables tables{&pass_,         stretch_,      u_low_.data(), u_high_.data(), v_low_.data(), v_high_.data(), bins_x_,
                    starts_.data(), index_.data(), x_.data(),     y_.data(),      z_.data(),     limit_.data()};
  tables.multiples = multiples, tables.every = static_cast<std::uint32_t>(every);
  tables.radius = static_cast<float>(radius), tables.enough = static_cast<float>(enough);
  distances.resize(count_);
  parallel_for(static_cast<long>(starts_.size()) - 1, 128, threads, stop,
               [&](long begin, long end) { search(pass_.isa, tables, begin, end, distances.data()); });
}

}  // namespace debulk
