#include "debulk/cloud/made_points.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numeric>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/core/wide.hpp"

namespace debulk {
namespace {

constexpr long strip = 32;           // rows
constexpr std::size_t some = 20000;  // differences, whose median is taken
constexpr std::size_t block = 16;
constexpr float most = std::numeric_limits<float>::max();

// Counts of three kinds of points in a window, side by side in one number, so that one sum has them all.
constexpr int bits = 10, widest = 31;
constexpr std::uint32_t one = 1, second = one << bits, third = second << bits, mask = second - 1;

// How many points on the ply have a known difference, block by block.
DEBULK_WIDE void count_known(const float* __restrict values, const std::uint8_t* __restrict on, std::size_t blocks,
                             std::uint8_t* __restrict known) {
  for (std::size_t b = 0; b < blocks; ++b) {
    std::uint8_t count = 0;
    for (std::size_t k = b * block; k < (b + 1) * block; ++k)
      count = static_cast<std::uint8_t>(count + ((on[k] != 0) & (std::abs(values[k]) <= most)));
    known[b] = count;
  }
}

// The median of the first and every so many of them. Only blocks that hold one of these and a gap are read point by point.
float median_of_some(const float* values, const std::uint8_t* on, std::size_t size) {
  const auto is_known = [&](std::size_t k) { return on[k] != 0 && std::isfinite(values[k]); };
  std::vector<std::uint8_t> known(size / block + 1);
  count_known(values, on, size / block, known.data());
  for (std::size_t k = size / block * block; k < size; ++k) known.back() += is_known(k);
  const std::size_t count = std::accumulate(known.begin(), known.end(), std::size_t{0});
  if (count == 0) return 0;
  const std::size_t every = 1 + count / some;
  std::vector<float> few;
  std::size_t left = 0;  // before the next that is taken
  for (std::size_t b = 0; b < known.size(); left -= known[b++]) {
    if (known[b] == block)
      for (; left < block; left += every) few.push_back(values[b * block + left]);
    else if (left < known[b])
      for (std::size_t k = b * block, seen = 0; left < known[b]; ++k)
        if (is_known(k) && seen++ == left) few.push_back(values[k]), left += every;
  }
  const auto upper = few.begin() + static_cast<std::ptrdiff_t>(few.size() / 2);
  std::nth_element(few.begin(), upper, few.end());
  return few.size() % 2 == 1 ? *upper : (*std::max_element(few.begin(), upper) + *upper) / 2;
}

DEBULK_WIDE void mark_quiet(const float* __restrict down, const float* __restrict right, float below_down, float below_right, int count,
                            std::uint8_t* __restrict marks) {
  for (int k = 0; k < count; ++k) marks[k] |= static_cast<std::uint8_t>((down[k] < below_down) & (right[k] < below_right));
}

// What flies does so along both: beside a flying pixel a point does along one.
DEBULK_WIDE void mark_odd(const float* __restrict down, const float* __restrict right, float above_down, float above_right,
                          const std::uint8_t* __restrict copied, const std::uint8_t* __restrict on, int count,
                          std::uint8_t* __restrict copies, std::uint8_t* __restrict flies, std::uint32_t* __restrict counts) {
  for (int k = 0; k < count; ++k) {
    copies[k] = copied[k] & on[k];
    flies[k] = static_cast<std::uint8_t>((down[k] > above_down) & (right[k] > above_right));
    counts[k] = on[k] + second * copies[k];
  }
}

DEBULK_WIDE void mark_below(const float* __restrict values, float limit, int count, std::uint8_t* __restrict marks) {
  for (int k = 0; k < count; ++k) marks[k] = values[k] < limit;
}

// Counts of the points of a row that are on the ply and known both ways: of all, of the quiet, and of the odd.
struct Kinds {
  std::uint32_t known = 0, quiet = 0, odd = 0;
};
DEBULK_WIDE Kinds count_kinds(const float* __restrict across, const float* __restrict along, const std::uint8_t* __restrict on,
                              const std::uint8_t* __restrict quiet, const std::uint8_t* __restrict odd, int count,
                              std::uint32_t* __restrict counts) {
  Kinds sum;
  for (int k = 0; k < count; ++k) {
    const std::uint32_t known = (on[k] != 0) & (std::abs(across[k]) <= most) & (std::abs(along[k]) <= most);
    const std::uint32_t is_odd = known & (odd[k] != 0), is_quiet = known & (odd[k] == 0) & (quiet[k] != 0);
    counts[k] = one * known + second * is_quiet + third * is_odd;
    sum.known += known, sum.quiet += is_quiet, sum.odd += is_odd;
  }
  return sum;
}

DEBULK_WIDE void add_row(const std::uint32_t* __restrict from, int count, std::uint32_t* __restrict to) {
  for (int c = 0; c < count; ++c) to[c] += from[c];
}

DEBULK_WIDE void take_row(const std::uint32_t* __restrict from, int count, std::uint32_t* __restrict to) {
  for (int c = 0; c < count; ++c) to[c] -= from[c];
}

// Weights of the kinds of points in a window whose sum is above 0 if they are likelier made than measured.
struct Weights {
  double rest = 0, quiet = 0, odd = 0;
  int least = 0;  // points known
};
DEBULK_WIDE void judge_row(const std::uint32_t* __restrict sums, const std::uint8_t* __restrict on, Weights of, int count,
                           std::uint8_t* __restrict made) {
  for (int c = 0; c < count; ++c) {
    const std::uint32_t sum = sums[c];
    const int seen = static_cast<int>(sum & mask), still = static_cast<int>((sum >> bits) & mask), odd = static_cast<int>(sum >> 2 * bits);
    const double log_odds = (seen - still - odd) * of.rest + still * of.quiet + odd * of.odd;
    made[c] |= static_cast<std::uint8_t>((on[c] != 0) & (seen >= of.least) & (log_odds > 0));
  }
}

class Search {
 public:
  Search(const AskedPoints& asked, const MadeLimits& limits, int threads, const Stop& stop)
      : asked_(asked),
        limits_(limits),
        threads_(threads),
        stop_(stop),
        size_(static_cast<std::size_t>(asked.rows) * width()),
        counts_(size_) {
    const int side = limits.window_cells;
    require(side >= 1 && side <= widest && side % 2 == 1, "window_cells", "an odd number of at most 31 cells", side);
  }

  MadePoints run(double step_mm) {
    std::vector<float> middle(static_cast<std::size_t>(asked_.ways));
    parallel_for(asked_.ways, 1, threads_, stop_, [&](long begin, long end) {
      for (auto way = begin; way < end; ++way)
        middle[static_cast<std::size_t>(way)] = median_of_some(apart(static_cast<std::size_t>(way)), asked_.on_ply, size_);
    });
    MadePoints out;
    const float least = middle.empty() ? 0 : *std::min_element(middle.begin(), middle.end());
    out.noisy = least > static_cast<float>(limits_.least_mm);
    if (!out.noisy) return out;
    out.rounded = step_mm > limits_.quiet * static_cast<double>(least);
    for (const float one_mm : middle) {
      quiet_.push_back(static_cast<float>(out.rounded ? 0.0 : limits_.quiet) * one_mm);
      wild_.push_back(static_cast<float>(limits_.wild) * one_mm);
    }
    out.made.resize(size_), out.marks.resize(3 * size_), still_.resize(size_);
    mark(out.marks.data());
    add(out, apart(0), apart(1), out.marks.data());
    // A fill that runs from rim to rim along rows or columns lacks noise along these alone.
    for (std::size_t way = 0; way < middle.size(); ++way) {
      points([&](std::size_t begin, std::size_t end) {
        mark_below(apart(way) + begin, quiet_[way], static_cast<int>(end - begin), still_.data() + begin);
      });
      add(out, apart(way), apart(way), still_.data());
    }
    return out;
  }

 private:
  std::size_t width() const { return static_cast<std::size_t>(asked_.columns); }
  const float* apart(std::size_t way) const { return asked_.apart + way * size_; }

  template <class Body>
  void points(const Body& body) const {
    parallel_for(asked_.rows, strip, threads_, stop_,
                 [&](long begin, long end) { body(static_cast<std::size_t>(begin) * width(), static_cast<std::size_t>(end) * width()); });
  }

  void mark(std::uint8_t* marks) {
    points([&](std::size_t begin, std::size_t end) {
      const int count = static_cast<int>(end - begin);
      for (std::size_t way = 0; way < quiet_.size(); way += 2)
        mark_quiet(apart(way) + begin, apart(way + 1) + begin, quiet_[way], quiet_[way + 1], count, marks + begin);
      mark_odd(apart(0) + begin, apart(1) + begin, wild_[0], wild_[1], asked_.copied + begin, asked_.on_ply + begin, count,
               marks + size_ + begin, marks + 2 * size_ + begin, counts_.data() + begin);
    });
    if (copies_are_common()) std::fill_n(marks + size_, size_, std::uint8_t{0});
    odd_.assign(marks + size_, marks + 2 * size_);
    for (std::size_t k = 0; k < size_; ++k) odd_[k] |= marks[2 * size_ + k];
  }

  // Whether the median over the ply of the share of copies in the window around is above the limit.
  bool copies_are_common() const {
    const auto limit = static_cast<float>(limits_.rarest);
    struct Part {
      long above = 0, all = 0;
      float below = 0, next = std::numeric_limits<float>::infinity();  // the shares nearest to the limit
    };
    std::vector<Part> parts(static_cast<std::size_t>(asked_.rows / strip + 1));
    windows([&](std::size_t first, const std::uint32_t* sums) {
      Part& part = parts[first / width() / strip];
      for (std::size_t c = 0; c < width(); ++c) {
        if (asked_.on_ply[first + c] == 0) continue;
        ++part.all;
        if (sums[c] < second) continue;  // no copy around
        const float share = static_cast<float>(sums[c] >> bits) / static_cast<float>(sums[c] & mask);
        if (share > limit)
          ++part.above, part.next = std::min(part.next, share);
        else
          part.below = std::max(part.below, share);
      }
    });
    Part whole;
    for (const Part& part : parts) {
      whole.above += part.above, whole.all += part.all;
      whole.below = std::max(whole.below, part.below), whole.next = std::min(whole.next, part.next);
    }
    if (2 * whole.above == whole.all) return (whole.below + whole.next) / 2 > limit;
    return 2 * whole.above > whole.all;
  }

  // Calls visit(k, sums) for each row, with its first point and the sums of the counts over the window around each of its
  // points; counts beyond the rim are 0.
  template <class Visit>
  void windows(const Visit& visit) const {
    const long half = limits_.window_cells / 2;
    parallel_for(asked_.rows, strip, threads_, stop_, [&](long begin, long end) {
      const auto beside = static_cast<std::size_t>(half), wide = width();
      std::vector<std::uint32_t> columns(wide + 2 * beside), sums(wide);  // columns: over the rows around; none at both ends
      const auto row = [&](long at, const auto& change) {
        if (at >= 0 && at < asked_.rows)
          change(counts_.data() + static_cast<std::size_t>(at) * wide, asked_.columns, columns.data() + beside);
      };
      for (long at = begin - half; at < begin + half; ++at) row(at, add_row);
      for (long at = begin; at < end; ++at) {
        row(at + half, add_row);
        std::uint32_t sum = 0;
        for (std::size_t c = 0; c < 2 * beside; ++c) sum += columns[c];
        for (std::size_t c = 0; c < wide; ++c) sums[c] = sum += columns[c + 2 * beside], sum -= columns[c];
        visit(static_cast<std::size_t>(at) * wide, static_cast<const std::uint32_t*>(sums.data()));
        row(at - half, take_row);
      }
    });
  }

  // Adds the points that are likelier made than measured by those around that are known both ways, and quiet or odd.
  void add(MadePoints& out, const float* across, const float* along, const std::uint8_t* quiet) {
    std::atomic<long> all{0}, quiets{0}, odds{0};
    points([&](std::size_t begin, std::size_t end) {
      const Kinds here = count_kinds(across + begin, along + begin, asked_.on_ply + begin, quiet + begin, odd_.data() + begin,
                                     static_cast<int>(end - begin), counts_.data() + begin);
      all += here.known, quiets += here.quiet, odds += here.odd;
    });
    const double number = static_cast<double>(std::max(1L, all.load()));
    const auto natural = [&](long count) {  // by the median, half of them are neither at least
      return std::clamp(static_cast<double>(count) / number, limits_.rarest, 0.5 - limits_.rarest);
    };
    const double natural_odd = natural(odds), natural_quiet = natural(quiets);
    const auto odds_of = [](double of_made, double of_all) { return static_cast<float>(std::log(of_made / of_all)); };
    const float of_rest = odds_of(1 - 2 * limits_.made, 1 - (natural_odd + natural_quiet));
    const auto weight = [of_rest](float of) { return static_cast<double>(of_rest + (of - of_rest)); };
    const double enough = limits_.least_share * limits_.window_cells * limits_.window_cells;
    const Weights weights{of_rest, weight(odds_of(limits_.made, natural_quiet)), weight(odds_of(limits_.made, natural_odd)),
                          static_cast<int>(std::ceil(enough))};
    windows([&](std::size_t first, const std::uint32_t* sums) {
      judge_row(sums, asked_.on_ply + first, weights, asked_.columns, out.made.data() + first);
    });
  }

  const AskedPoints& asked_;
  const MadeLimits& limits_;
  int threads_;
  const Stop& stop_;
  std::size_t size_;
  std::vector<std::uint32_t> counts_;
  std::vector<std::uint8_t> odd_, still_;
  std::vector<float> quiet_, wild_;
};

}  // namespace

MadePoints made_points(const AskedPoints& asked, double step_mm, const MadeLimits& limits, int threads, const Stop& stop) {
  return Search(asked, limits, threads, stop).run(step_mm);
}

}  // namespace debulk
