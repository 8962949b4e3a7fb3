#include "debulk/cloud/open_search.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "debulk/core/parallel.hpp"
#include "debulk/core/wide.hpp"

namespace debulk {
namespace {

constexpr int bin_side = 32;        // pixels
constexpr std::uint32_t ahead = 6;  // points of which the memory is asked for
constexpr float infinity = std::numeric_limits<float>::infinity();

// What the search looks at; the arrays of points have 16 more entries than points.
struct OpenTables {
  const WindowPass* pass;
  double stretch;
  float square_bound;
  const float *u_low, *u_high, *v_low, *v_high;
  int bins_x;
  const std::uint32_t *starts, *index;
  const float *x, *y, *z;
};

struct NearTile {
  float bound;  // mm2
  int x, y;
};

#define DEBULK_KERNEL "debulk/cloud/open_kernel.inl"
#include "debulk/core/each_isa.inl"

void search(Isa isa, const OpenTables& tables, long begin, long end, float* distances) {
  return DEBULK_ON(isa, run(tables, begin, end, distances));
}

}  // namespace

void OpenSearch::prepare(const WindowPass& pass, const std::vector<WindowBand>& bands, bool certified) {
  pass_ = pass;
  const CloudView& cloud = pass.cloud;
  const double slack = pass.tolerance / pass.camera.f;
  double widest = 0;
  for (const double at : {pass.camera.u(0), pass.camera.u(cloud.width - 1.0), pass.camera.v(0), pass.camera.v(cloud.height - 1.0)})
    widest = std::max(widest, std::abs(at) + slack);
  stretch_ = std::sqrt(1 + widest * widest);
  const double apart = (3 - 2 * pass.tolerance) / pass.camera.f, slope = widest + 3 / pass.camera.f;
  square_bound_ = certified ? apart * apart / (1 + slope * slope) * (1 - 1e-5) : std::numeric_limits<double>::max();
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
  count_ = 0;
  for (const WindowBand& band : bands) count_ += band.open.size();
  const auto bin_of = [&](std::uint32_t pixel) {
    const auto width = static_cast<std::uint32_t>(cloud.width);
    return static_cast<std::size_t>(pixel / width / bin_side) * static_cast<std::size_t>(bins_x_) + pixel % width / bin_side;
  };
  // Counted two places on and handed out one place on, so that starts_[bin] is right in the end.
  starts_.assign(static_cast<std::size_t>(bins_x_) * static_cast<std::size_t>(bins_y) + 2, 0);
  for (const WindowBand& band : bands)
    for (const std::uint32_t pixel : band.open) ++starts_[bin_of(pixel) + 2];
  for (std::size_t b = 2; b < starts_.size(); ++b) starts_[b] += starts_[b - 1];
  const std::size_t padded = count_ + 16;
  index_.resize(padded), x_.resize(padded), y_.resize(padded), z_.resize(padded);
  for (const WindowBand& band : bands)
    for (const std::uint32_t pixel : band.open) {
      const std::uint32_t at = starts_[bin_of(pixel) + 1]++;
      index_[at] = pixel;
      const float* p = cloud.point(pixel);
      x_[at] = p[0], y_[at] = p[1], z_[at] = p[2];
    }
}

void OpenSearch::run(std::vector<float>& distances, int threads, const Stop& stop) const {
  const OpenTables tables{&pass_,         stretch_,       static_cast<float>(square_bound_),
                          u_low_.data(),  u_high_.data(), v_low_.data(),
                          v_high_.data(), bins_x_,        starts_.data(),
                          index_.data(),  x_.data(),      y_.data(),
                          z_.data()};
  distances.resize(count_);
  parallel_for(static_cast<long>(starts_.size()) - 2, 128, threads, stop,
               [&](long begin, long end) { search(pass_.isa, tables, begin, end, distances.data()); });
}

}  // namespace debulk
