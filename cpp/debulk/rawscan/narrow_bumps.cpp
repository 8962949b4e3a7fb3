#include "debulk/rawscan/narrow_bumps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/rawscan/standing_wrinkles.hpp"

namespace debulk {
namespace {

constexpr float nan_f = std::numeric_limits<float>::quiet_NaN();
constexpr int block = 64;            // places that are skipped at once where no point stands out
constexpr float lone_share = 0.75f;  // a point is alone if it is above both neighbours by this share of its height
constexpr double pi = 3.14159265358979323846;

int steps(double wanted) {
  return static_cast<int>(std::nearbyint(std::clamp(wanted, 1.0, 1e6)));
}

double middle_of(std::vector<double> values) {
  const auto half = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), half, values.end());
  return *half;
}

// Returns how far a point stands above the mean of the points on both sides, or above the one that was seen.
inline float out_of(float left, float here, float right) {
  const float l = left == left ? left : right, r = right == right ? right : left;
  return here - 0.5f * (l + r);
}

struct Pixel {
  int row = 0, column = 0;
};

// Connected samples, as indices into a window.
using Patch = std::vector<int>;

}  // namespace

// The search for narrow bumps in one scan.
struct WrinkleFinder::BumpSearch {
  const WrinkleFinder& finder;
  const Lines image;
  const NarrowBumpOptions& options;
  const double pitch;
  const int row_step = steps(options.rows_mm / pitch), step = steps(options.sample_mm / pitch);
  const double sample = step * pitch;  // mm
  const int half = steps(options.window_mm / sample), side = 2 * half + 1;
  const std::size_t most_samples = static_cast<std::size_t>(2 * side * steps(options.widest_mm / sample));

  Eigen::Vector3d point(Pixel p) const {
    if (p.row < 0 || p.column < 0 || p.row >= image.cloud.height || p.column >= image.cloud.width) return Eigen::Vector3d::Constant(nan_f);
    const std::size_t pixel = image.pixel(p.row, p.column);
    if (image.masked && image.masked[pixel]) return Eigen::Vector3d::Constant(nan_f);
    return finder.moved(image.cloud.point(pixel));
  }

  // Whether a point that stands out by `out` is on the ply, and does not stand on a wide elevation.
  bool may_be_top(Pixel pixel, double out) const {
    const Eigen::Vector3d seen = point(pixel);
    if (finder.known(seen) != 2) return false;
    const double height = finder.above(seen);
    return height > options.stands_out_mm && out > 0.5 * height;
  }

  // Returns the points of the ply that stand out along their row or across the rows. Only depths are read to find them.
  std::vector<Pixel> seeds(const Stop& stop) const {
    const int rows = (image.cloud.height - 1) / row_step + 1, columns = (image.cloud.width - 1) / step + 1;
    const int across = steps(options.side_mm / (row_step * pitch)), along = steps(options.side_mm / sample);
    const auto up = static_cast<float>(finder.pose_(2, 2));
    const auto width = static_cast<std::size_t>(columns);
    const std::unique_ptr<float[]> z(new float[static_cast<std::size_t>(rows) * width]);  // all values are written below
    parallel_for(rows, 16, finder.threads_, stop, [&](long begin, long end) {
      for (int r = static_cast<int>(begin); r < end; ++r)
        for (int c = 0; c < columns; ++c) {
          const std::size_t pixel = image.pixel(r * row_step, c * step);
          const bool hidden = image.masked && image.masked[pixel];
          z[static_cast<std::size_t>(r) * width + static_cast<std::size_t>(c)] = hidden ? nan_f : image.cloud.point(pixel)[2] * up;
        }
    });
    std::vector<std::vector<Pixel>> by_row(static_cast<std::size_t>(rows));
    parallel_for(rows, 16, finder.threads_, stop, [&](long begin, long end) {
      const std::vector<float> none(width, nan_f);
      const auto least = static_cast<float>(options.stands_out_mm), most = static_cast<float>(options.highest_mm);
      for (int r = static_cast<int>(begin); r < end; ++r) {
        const auto line = [&](int k) { return k < 0 || k >= rows ? none.data() : &z[static_cast<std::size_t>(k) * width]; };
        const float *here = line(r), *before = line(r - across), *behind = line(r + across);
        const auto out = [&](int c) {
          const float a = out_of(here[c - along], here[c], here[c + along]), b = out_of(before[c], here[c], behind[c]);
          const float in_row = a < most ? a : 0.0f, in_column = b < most ? b : 0.0f;
          return in_row > in_column ? in_row : in_column;
        };
        // The point must be the highest of its row there, and not alone. 1 mm beside its top, a bell-shaped bump only 5
        // mm wide still has 0.65 of its height, whereas a flying point has none.
        const auto is_top = [&](int c) {
          const float left = here[c - 1], right = here[c + 1], least_there = here[c] - lone_share * out(c);
          return !(left > here[c]) && !(right > here[c]) && (left > least_there || right > least_there);
        };
        for (int first = along; first < columns - along; first += block) {
          const int last = std::min(first + block, columns - along);
          int any = 0;
          for (int c = first; c < last; ++c) any |= static_cast<int>(out(c) > least);
          for (int c = first; any && c < last; ++c)
            if (const Pixel pixel{r * row_step, c * step}; out(c) > least && is_top(c) && may_be_top(pixel, out(c)))
              by_row[static_cast<std::size_t>(r)].push_back(pixel);
        }
      }
    });
    std::vector<Pixel> out;
    for (const std::vector<Pixel>& some : by_row) out.insert(out.end(), some.begin(), some.end());
    return out;
  }

  // The heights above the reference around a pixel; each is computed when it is first asked for.
  struct Window {
    const BumpSearch& search;
    Pixel middle;
    std::vector<float> values = std::vector<float>(static_cast<std::size_t>(search.side * search.side));
    std::vector<std::uint8_t> asked = std::vector<std::uint8_t>(values.size(), 0);

    int row(int k) const { return k / search.side; }
    int column(int k) const { return k % search.side; }
    Pixel pixel(int k) const {
      return {middle.row + (row(k) - search.half) * search.step, middle.column + (column(k) - search.half) * search.step};
    }
    float at(int k) {
      const auto n = static_cast<std::size_t>(k);
      if (!asked[n]) asked[n] = 1, values[n] = static_cast<float>(search.finder.above(search.point(pixel(k))));
      return values[n];
    }
    bool on_border(int k) const { return row(k) == 0 || column(k) == 0 || row(k) == search.side - 1 || column(k) == search.side - 1; }

    // Takes those neighbours of sample k that lie above a level and are not taken yet.
    void take_around(int k, double level, std::vector<std::uint8_t>& taken, Patch& out) {
      for (int dj = -1; dj <= 1; ++dj)
        for (int di = -1; di <= 1; ++di) {
          const int next = k + dj * search.side + di;
          if (taken[static_cast<std::size_t>(next)] || !(at(next) > level)) continue;
          taken[static_cast<std::size_t>(next)] = 1, out.push_back(next);
        }
    }

    // Whether the samples above a level that are connected to the middle one reach the border, or are twice as many as
    // those of the widest bump as long as the window. The sample taken last is followed first: on a pocket's flank,
    // where most points that stand out lie, this order leads straight to the border.
    bool runs_out(double level) {
      std::vector<std::uint8_t> taken(values.size(), 0);
      Patch open{search.half * search.side + search.half};
      taken[static_cast<std::size_t>(open[0])] = 1;
      for (std::size_t followed = 1; !open.empty(); ++followed) {
        const int k = open.back();
        if (on_border(k) || followed + open.size() - 1 > search.most_samples) return true;
        open.pop_back(), take_around(k, level, taken, open);
      }
      return false;
    }

    // Returns the samples above a level that are connected to the middle one; none if they run out (runs_out()).
    Patch above(double level) {
      if (runs_out(level)) return {};
      std::vector<std::uint8_t> taken(values.size(), 0);
      Patch out{search.half * search.side + search.half};
      taken[static_cast<std::size_t>(out[0])] = 1;
      for (std::size_t n = 0; n < out.size(); ++n) take_around(out[n], level, taken, out);
      return out;
    }

    // Returns the second highest sample, because a single flying pixel may be connected to the patch.
    int top(const Patch& patch) {
      Patch ordered = patch;
      std::partial_sort(ordered.begin(), ordered.begin() + 2, ordered.end(), [&](int a, int b) { return at(a) > at(b); });
      return ordered[1];
    }

    // Returns the median height of the samples around the patch; NaN if too few were seen.
    double around(const Patch& patch) {
      std::vector<std::uint8_t> in(values.size(), 0);
      for (const int k : patch) in[static_cast<std::size_t>(k)] = 1;
      std::vector<double> seen;
      for (int k = 0; k < search.side * search.side; ++k)
        if (const float here = at(k); !in[static_cast<std::size_t>(k)] && here == here) seen.push_back(here);
      return seen.size() < values.size() / 3 ? nan_f : middle_of(std::move(seen));
    }
  };

  // Whether the samples near the patch are free of the many holes and erratic depths of a highlight.
  bool calm(Window& window, const Patch& patch, double base, double height) const {
    int first_row = side, last_row = 0, first_column = side, last_column = 0;
    for (const int k : patch) {
      first_row = std::min(first_row, window.row(k)), last_row = std::max(last_row, window.row(k));
      first_column = std::min(first_column, window.column(k)), last_column = std::max(last_column, window.column(k));
    }
    const int margin = 3;
    int count = 0, sunk = 0, unseen = 0;
    for (int j = std::max(0, first_row - margin); j <= std::min(side - 1, last_row + margin); ++j)
      for (int i = std::max(0, first_column - margin); i <= std::min(side - 1, last_column + margin); ++i) {
        const float here = window.at(j * side + i);
        ++count, unseen += !(here == here), sunk += here < base - 0.25 * height;
      }
    return sunk <= 1 + options.sunk_share * count && unseen <= options.unseen_share * count;
  }

  std::optional<NarrowBump> measured(Pixel seed) const {
    Window first{*this, seed};
    const Patch rough = first.above(0.5 * first.at(half * side + half));
    if (static_cast<int>(rough.size()) < std::max(2, options.fewest)) return std::nullopt;
    const int highest = first.top(rough);
    Window window{*this, first.pixel(highest)};
    const Patch whole = window.above(0.5 * first.at(highest));
    if (whole.empty()) return std::nullopt;
    const double peak = first.at(highest), base = window.around(whole);
    NarrowBump out;
    out.height = peak - base;
    if (!(out.height > options.contrast * peak && out.height < options.highest_mm && base > -0.5 * peak)) return std::nullopt;
    const Patch patch = window.above(base + 0.5 * out.height);
    if (static_cast<int>(patch.size()) < options.fewest || !calm(window, patch, base, out.height)) return std::nullopt;
    double longest = 0;
    for (const int a : patch)
      for (const int b : patch) longest = std::max(longest, std::hypot(window.row(a) - window.row(b), window.column(a) - window.column(b)));
    out.length = (longest + 1) * sample;
    out.width = 4 / pi * static_cast<double>(patch.size()) * sample * sample / out.length;
    // The crest lies between samples, so the sampled height is too low on average: corrected here for a bell-shaped
    // bump.
    const double off = std::min(0.25, 0.6 * sample / (2 * out.width));
    out.height /= std::pow(std::cos(pi * off), 2);
    out.top = point(window.pixel(half * side + half)).head<2>();
    if (out.width > options.widest_mm) return std::nullopt;
    return out;
  }
};

NarrowBumps WrinkleFinder::find_bumps(const CloudView& scan, const std::uint8_t* masked, double pitch, const NarrowBumpOptions& options,
                                      const Stop& stop) const {
  require(pitch > 0, "pitch_mm", "a positive length in mm", pitch);
  const BumpSearch search{*this, {scan, masked, false}, options, pitch};
  const std::vector<Pixel> seeds = search.seeds(stop);
  NarrowBumps out;
  out.gave_up = static_cast<long>(seeds.size()) > options.most;
  if (out.gave_up) return out;
  std::vector<std::optional<NarrowBump>> found(seeds.size());
  parallel_for(static_cast<long>(seeds.size()), 4, threads_, stop, [&](long begin, long end) {
    for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k) found[k] = search.measured(seeds[k]);
  });
  std::vector<NarrowBump> all;
  for (const std::optional<NarrowBump>& one : found)
    if (one) all.push_back(*one);
  std::stable_sort(all.begin(), all.end(), [](const NarrowBump& a, const NarrowBump& b) { return a.height > b.height; });
  for (const NarrowBump& one : all) {  // several points that stood out may have found the same bump
    const auto same = [&](const NarrowBump& other) { return (one.top - other.top).norm() < std::max(options.side_mm, other.length); };
    if (std::none_of(out.bumps.begin(), out.bumps.end(), same)) out.bumps.push_back(one);
  }
  return out;
}

}  // namespace debulk
