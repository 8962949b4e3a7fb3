#include "debulk/region/sampled_threshold.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

constexpr int block_width = 256, block_height = 192;  // pixels
constexpr int border = 24;                            // pixels along a block's edge in which open points do not count
constexpr double share = 0.05;
constexpr std::size_t small = std::size_t{1} << 21;  // pixels; every point of an image up to this size is sampled

struct Sums {
  double n = 0, sum = 0, squares = 0;
};

double threshold_of(const Sums& s, const OutlierOptions& options, double* mean = nullptr, double* deviation = nullptr) {
  if (s.n < 2) return 0;
  const double m = s.sum / s.n, d = std::sqrt(std::max(0.0, (s.squares - s.sum * m) / (s.n - 1)));
  if (mean) *mean = m, *deviation = d;
  return std::max(m + options.std_ratio * d, options.least_ratio * m);
}

// Sums over those outermost points that the pixel window decided, from their up to five neighbours, as the window pass
// does.
Sums rim_of(const CloudView& part, const PinholeOutliers& outliers) {
  std::vector<std::uint8_t> open(part.size(), 0);
  for (long k = 0; k < outliers.open(); ++k) open[outliers.open_pixel(k)] = 1;
  Sums out;
  const auto add = [&](int column, int row) {
    const std::size_t at = static_cast<std::size_t>(row) * static_cast<std::size_t>(part.width) + static_cast<std::size_t>(column);
    if (open[at] || !part.seen(at)) return;
    std::array<double, 8> squares;
    std::size_t count = 0;
    for (int j = std::max(0, row - 1); j <= std::min(part.height - 1, row + 1); ++j)
      for (int i = std::max(0, column - 1); i <= std::min(part.width - 1, column + 1); ++i) {
        const std::size_t other = static_cast<std::size_t>(j) * static_cast<std::size_t>(part.width) + static_cast<std::size_t>(i);
        if (other == at || !part.seen(other)) continue;
        const float *a = part.point(at), *b = part.point(other);
        squares[count++] = (Eigen::Vector3d(a[0], a[1], a[2]) - Eigen::Vector3d(b[0], b[1], b[2])).squaredNorm();
      }
    if (count < 4) return;
    std::partial_sort(squares.begin(), squares.begin() + 4, squares.begin() + static_cast<long>(count));
    double d = 0;
    for (std::size_t k = 0; k < 4; ++k) d += std::sqrt(squares[k]) / 4;
    out.n += 1, out.sum += d, out.squares += d * d;
  };
  for (int i = 0; i < part.width; ++i) add(i, 0), add(i, part.height - 1);
  for (int j = 1; j + 1 < part.height; ++j) add(0, j), add(part.width - 1, j);
  return out;
}

}  // namespace

void CloudPart::copy(const CloudView& cloud, const std::uint8_t* masked) {
  const int inside = std::min(width, cloud.width - column);
  width = (inside + 15) / 16 * 16;
  points.resize(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int j = 0; j < height; ++j) {
    const std::size_t from = static_cast<std::size_t>(row + j) * static_cast<std::size_t>(cloud.width) + static_cast<std::size_t>(column);
    float* to = &points[3 * static_cast<std::size_t>(j) * static_cast<std::size_t>(width)];
    std::memcpy(to, cloud.point(from), 3 * static_cast<std::size_t>(inside) * sizeof(float));
    std::fill(to + 3 * inside, to + 3 * width, std::numeric_limits<float>::quiet_NaN());
    if (!masked) continue;
    for (int i = 0; i < inside; ++i)
      if (masked[from + static_cast<std::size_t>(i)]) to[3 * i] = std::numeric_limits<float>::quiet_NaN();
  }
}

SampledThreshold ThresholdSampler::run(const CloudView& cloud, const std::uint8_t* masked, const Pinhole& camera,
                                       const OutlierOptions& options, int threads, const Stop& stop) {
  SampledThreshold out;
  if (cloud.size() <= small) {
    const std::shared_ptr<Block> whole = blocks_.borrow();
    CloudPart& part = whole->part;
    PinholeOutliers& outliers = whole->outliers;
    part.column = part.row = 0, part.width = cloud.width, part.height = cloud.height;
    outliers.fixed = 0;
    part.copy(cloud, masked);  // a copy, because the cloud's owner may write into it meanwhile
    out.pinhole = outliers.run(part.view(), camera, options, nullptr, threads, stop);
    const Outliers& found = outliers.summary();
    out.mean = found.mean, out.deviation = found.deviation, out.value = found.threshold, out.points = found.seen;
    return out;
  }
  if (cloud.width < block_width || cloud.height < block_height) return out;
  const double pixels = static_cast<double>(cloud.size()), wanted = std::max(share * pixels, 0.5 * small);
  const double blocks = std::max(1.0, wanted / (block_width * block_height));
  const double aspect = static_cast<double>(cloud.width) / cloud.height * block_height / block_width;
  const int across = std::max(1, static_cast<int>(std::lround(std::sqrt(blocks * aspect))));
  const int down = std::max(1, static_cast<int>(std::lround(blocks / across)));
  const int count = across * down;

  std::vector<Sums> sums(static_cast<std::size_t>(count));
  std::vector<std::uint8_t> right(sums.size(), 1);
  parallel_for(count, (count + 7) / 8, threads, [&](long begin, long end) {
    const std::shared_ptr<Block> mine = blocks_.borrow();
    CloudPart& part = mine->part;
    PinholeOutliers& outliers = mine->outliers;
    outliers.fixed = 1;  // one pass, because only its statistics are needed
    for (long b = begin; b < end; ++b) {
      if (stop.now()) throw Stopped("the sample of the outlier threshold was stopped");
      // Place the block at a jittered position in the b-th of equal fields.
      const double golden = 0.6180339887498949 * static_cast<double>(b + 1);
      const double place_x = golden - std::floor(golden), place_y = 2 * golden - std::floor(2 * golden);
      const auto at = [&](int k, double place, int fields, int size, int block) {
        const double room = static_cast<double>(size) / fields;
        const double first = room * k + place * std::max(0.0, room - block);
        return std::clamp(static_cast<int>(first), 0, size - block);
      };
      part.column = at(static_cast<int>(b) % across, place_x, across, cloud.width, block_width) / 16 * 16;
      part.row = at(static_cast<int>(b) / across, place_y, down, cloud.height, block_height);
      part.width = block_width, part.height = block_height;
      part.copy(cloud, masked);
      const auto k = static_cast<std::size_t>(b);
      right[k] = outliers.run(part.view(), part.camera(camera), options, nullptr, 1, stop);
      if (!right[k]) continue;
      const Outliers& found = outliers.summary();
      if (found.seen < 2) continue;
      long alone = 0;
      for (long o = 0; o < outliers.open(); ++o) alone += !std::isfinite(outliers.open_distance(o));
      const double n = static_cast<double>(found.seen - alone);
      Sums s{n, n * found.mean, (n - 1) * found.deviation * found.deviation + n * found.mean * found.mean};
      // Open points near the border may have neighbours outside the block: those farther in are weighted to replace
      // them.
      Sums open, inner;
      for (long o = 0; o < outliers.open(); ++o) {
        const double d = outliers.open_distance(o);
        if (!std::isfinite(d)) continue;
        open.n += 1, open.sum += d, open.squares += d * d;
        const int column = static_cast<int>(outliers.open_pixel(o)) % part.width,
                  row = static_cast<int>(outliers.open_pixel(o)) / part.width;
        if (column < border || row < border || column >= part.width - border || row >= part.height - border) continue;
        inner.n += 1, inner.sum += d, inner.squares += d * d;
      }
      const Sums rim = rim_of(part.view(), outliers);
      s = {s.n - rim.n, s.sum - rim.sum, s.squares - rim.squares};
      constexpr double weight =
          static_cast<double>((block_width - 2) * (block_height - 2)) / ((block_width - 2 * border) * (block_height - 2 * border));
      sums[k] = {s.n - open.n + weight * inner.n, s.sum - open.sum + weight * inner.sum, s.squares - open.squares + weight * inner.squares};
    }
  });
  if (std::find(right.begin(), right.end(), 0) != right.end()) return out;
  Sums all;
  for (const Sums& s : sums) all.n += s.n, all.sum += s.sum, all.squares += s.squares;
  if (all.n < 1000) return out;
  out.pinhole = true;
  out.points = static_cast<long>(all.n);
  out.value = threshold_of(all, options, &out.mean, &out.deviation);
  std::vector<double> without;
  for (const Sums& s : sums) without.push_back(threshold_of({all.n - s.n, all.sum - s.sum, all.squares - s.squares}, options));
  double middle = 0, scatter = 0;
  for (const double t : without) middle += t / count;
  for (const double t : without) scatter += (t - middle) * (t - middle);
  out.error = count > 1 ? std::sqrt(scatter * (count - 1) / count) : out.value;
  return out;
}

}  // namespace debulk
