#include "debulk/rawscan/crossings.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr int shift = 2;  // pixels, between the two lines of a pair

// Returns the heights, up to a constant, of the points on both lines of every pair: pair by pair, line by line.
std::unique_ptr<float[]> read_heights(const Lines& lines, int pairs, const CrossingOptions& options, int threads, const Stop& stop) {
  const auto length = static_cast<std::size_t>(lines.length());
  std::unique_ptr<float[]> out(new float[2 * static_cast<std::size_t>(pairs) * length]);  // all values are written below
  const auto read = [&](int line, int at) {
    const std::size_t pixel = lines.pixel(line, at);
    return lines.masked && lines.masked[pixel] ? nan : lines.cloud.point(pixel)[2] * options.up_per_depth;
  };
  if (!lines.turned) {
    parallel_for(pairs, 4, threads, stop, [&](long begin, long end) {
      for (int pair = static_cast<int>(begin); pair < end; ++pair)
        for (int k = 0; k < 2; ++k) {
          float* to = &out[static_cast<std::size_t>(2 * pair + k) * length];
          for (int at = 0; at < lines.length(); ++at) to[at] = read(pair * options.step + k, at);
        }
    });
  } else {  // read row by row of the image, as it lies in memory; each block writes as many places as share a cache line
    constexpr int together = 16;
    const auto count = 2 * static_cast<std::size_t>(pairs);
    parallel_for(lines.length(), 4 * together, threads, stop, [&](long begin, long end) {
      std::vector<float> tile(count * together);
      for (long first = begin; first < end; first += together) {
        const long behind = std::min(first + together, end);
        for (long at = first; at < behind; ++at)
          for (int pair = 0; pair < pairs; ++pair)
            for (int k = 0; k < 2; ++k)
              tile[static_cast<std::size_t>((2 * pair + k) * together + (at - first))] =
                  read(pair * options.step + k, static_cast<int>(at));
        for (std::size_t line = 0; line < count; ++line)
          std::copy_n(&tile[line * together], behind - first, &out[line * length + static_cast<std::size_t>(first)]);
      }
    });
  }
  return out;
}

constexpr std::size_t block = 64;  // places that are skipped at once where no point stands out

// The points of one line that stand out. Place 0 is the line's pixel number `side`.
struct Profile {
  std::vector<float> height;
  std::vector<std::uint8_t> stands, near;  // whether the place itself stands out, and whether one up to `shift` pixels away does
  std::vector<std::uint8_t> any;           // per block: whether `near` is set anywhere in it

  void take(const float* z, std::size_t places, const CrossingOptions& options) {
    height.resize(places), stands.assign(places, 0), near.assign(places, 0), any.assign(places / block + 1, 0);
    const auto side = static_cast<std::size_t>(options.side);
    const float *left = z, *middle = z + side, *right = z + 2 * side;
    const float least = options.stands_out_mm, most = options.highest_mm;
    for (std::size_t begin = 0; begin < places; begin += block) {
      const std::size_t end = std::min(places, begin + block);
      int found = 0;
      for (std::size_t k = begin; k < end; ++k) {  // the mean of both sides, or the side that was seen
        const float l = left[k] == left[k] ? left[k] : right[k], r = right[k] == right[k] ? right[k] : left[k];
        const float out = middle[k] - 0.5f * (l + r);
        height[k] = out;
        found |= static_cast<int>(out > least) & static_cast<int>(out < most);
      }
      if (found) mark(begin, end, options);
    }
  }

 private:
  void mark(std::size_t begin, std::size_t end, const CrossingOptions& options) {
    for (std::size_t k = begin; k < end; ++k) {
      if (!(height[k] > options.stands_out_mm && height[k] < options.highest_mm)) continue;
      stands[k] = 1;
      const std::size_t first = k < shift ? 0 : k - shift, last = std::min(height.size() - 1, k + shift);
      for (std::size_t n = first; n <= last; ++n) near[n] = 1;
      any[first / block] = any[last / block] = 1;
    }
  }
};

void add_crossings(const Profile& a, const Profile& b, int pair, int side, std::vector<Crossing>& out) {
  const std::size_t places = a.height.size();
  const auto stands = [&](std::size_t k) { return (a.stands[k] & b.near[k]) | (b.stands[k] & a.near[k]); };
  for (std::size_t k = 0; k < places; ++k) {
    if (k % block == 0 && !(a.any[k / block] && b.any[k / block])) {
      k += block - 1;
      continue;
    }
    if (!stands(k)) continue;
    std::size_t top = k;
    float highest = -std::numeric_limits<float>::infinity();
    for (; k < places && stands(k); ++k)
      if (const float here = std::fmax(a.height[k], b.height[k]); here > highest) highest = here, top = k;
    out.push_back({pair, static_cast<int>(top) + side, highest});
  }
}

// Finds chains of crossings, from pair to pair.
class Linker {
 public:
  Linker(const std::vector<Crossing>& crossings, const ChainOptions& options) : all_(crossings), options_(options) {
    const int pairs = all_.empty() ? 0 : all_.back().pair + 1;
    first_.assign(static_cast<std::size_t>(pairs) + 1, 0);
    for (const Crossing& c : all_) ++first_[static_cast<std::size_t>(c.pair) + 1];
    for (std::size_t k = 1; k < first_.size(); ++k) first_[k] += first_[k - 1];
  }

  // Returns the longest chain that begins with this crossing.
  std::vector<int> longest_from(int index) const {
    std::vector<int> best, chain;
    const Crossing& here = all_[static_cast<std::size_t>(index)];
    for (int ahead = 1; ahead <= options_.ahead; ++ahead) {
      const double reach = options_.steepest * options_.step * ahead;
      for_near(here.pair + ahead, here.at, reach, [&](int second) {
        if (!alike(index, second)) return;
        chain = {index, second};
        for (int next = following(chain); next >= 0; next = following(chain)) chain.push_back(next);
        if (chain.size() > best.size()) best.swap(chain);
      });
    }
    return best;
  }

 private:
  // Calls body, in order of place, with each crossing of a pair that is at most `reach` pixels from `at`.
  template <class Body>
  void for_near(int pair, double at, double reach, const Body& body) const {
    if (static_cast<std::size_t>(pair) + 1 >= first_.size()) return;
    const auto begin = all_.begin() + first_[static_cast<std::size_t>(pair)],
               end = all_.begin() + first_[static_cast<std::size_t>(pair) + 1];
    const double left = at - reach - 1;  // the exact bound is tested below
    auto c = std::lower_bound(begin, end, left, [](const Crossing& one, double place) { return one.at < place; });
    for (; c != end && c->at <= at + reach; ++c)
      if (std::abs(c->at - at) <= reach) body(static_cast<int>(c - all_.begin()));
  }

  bool alike(int a, int b) const {
    const double one = all_[static_cast<std::size_t>(a)].height, other = all_[static_cast<std::size_t>(b)].height;
    return std::max(one, other) <= options_.alike * std::min(one, other);
  }

  // Returns the crossing nearest to where the chain points, if it is near enough and about as high; -1 if there is
  // none.
  int following(const std::vector<int>& chain) const {
    const int end = chain.back();
    const Crossing &last = all_[static_cast<std::size_t>(end)], &before = all_[static_cast<std::size_t>(chain[chain.size() - 2])];
    const double slope = static_cast<double>(last.at - before.at) / (last.pair - before.pair);
    for (int ahead = 1; ahead <= options_.ahead; ++ahead) {
      const double expected = last.at + ahead * slope;
      int nearest = -1;
      double least = std::numeric_limits<double>::infinity();
      for_near(last.pair + ahead, expected, 3 + 0.3 * options_.step, [&](int c) {
        const double off = std::abs(all_[static_cast<std::size_t>(c)].at - expected);
        if (off < least && alike(c, end)) least = off, nearest = c;
      });
      if (nearest >= 0) return nearest;
    }
    return -1;
  }

  const std::vector<Crossing>& all_;
  const ChainOptions& options_;
  std::vector<std::ptrdiff_t> first_;  // index of each pair's first crossing
};

}  // namespace

std::vector<Crossing> find_crossings(const Lines& lines, const CrossingOptions& options, int threads, const Stop& stop) {
  require(options.step >= 1, "step", "a positive number of lines", options.step);
  require(options.side >= 1, "side", "a positive number of pixels", options.side);
  const int length = lines.length();
  if (lines.count() < 2 || length < 2 * options.side + 3) return {};
  const int pairs = (lines.count() - 2) / options.step + 1;
  const std::unique_ptr<float[]> heights = read_heights(lines, pairs, options, threads, stop);
  std::vector<std::vector<Crossing>> by_pair(static_cast<std::size_t>(pairs));
  parallel_for(pairs, 4, threads, stop, [&](long begin, long end) {
    Profile a, b;
    const auto places = static_cast<std::size_t>(length - 2 * options.side);
    for (int pair = static_cast<int>(begin); pair < end; ++pair) {
      const float* z = &heights[2 * static_cast<std::size_t>(pair) * static_cast<std::size_t>(length)];
      a.take(z, places, options), b.take(z + length, places, options);
      add_crossings(a, b, pair, options.side, by_pair[static_cast<std::size_t>(pair)]);
    }
  });
  std::vector<Crossing> out;
  for (const std::vector<Crossing>& some : by_pair) out.insert(out.end(), some.begin(), some.end());
  return out;
}

std::vector<std::vector<int>> link_crossings(const std::vector<Crossing>& crossings, const ChainOptions& options, const Stop& stop) {
  const Linker linker(crossings, options);
  std::vector<std::uint8_t> taken(crossings.size(), 0);
  std::vector<std::vector<int>> out;
  for (std::size_t k = 0; k < crossings.size(); ++k) {
    if (taken[k]) continue;
    if (stop.now()) throw Stopped("the search for standing wrinkles was stopped");
    std::vector<int> chain = linker.longest_from(static_cast<int>(k));
    if (static_cast<int>(chain.size()) < options.links) continue;
    for (const int c : chain) taken[static_cast<std::size_t>(c)] = 1;
    out.push_back(std::move(chain));
  }
  return out;
}

}  // namespace debulk
