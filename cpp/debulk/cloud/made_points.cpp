#include "debulk/cloud/made_points.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"

namespace debulk {
namespace {

constexpr long strip = 32;           // rows
constexpr std::size_t some = 20000;  // differences, whose median is taken

// Counts of three kinds of points in a window, side by side in one number, so that one sum has them all.
constexpr int bits = 10, widest = 31;
constexpr std::uint32_t one = 1, second = one << bits, third = second << bits, mask = second - 1;

float median_of_some(const float* values, const std::uint8_t* on, std::size_t size) {
  const auto known = [&](std::size_t k) { return on[k] != 0 && std::isfinite(values[k]); };
  std::size_t count = 0;
  for (std::size_t k = 0; k < size; ++k) count += known(k);
  if (count == 0) return 0;
  const std::size_t every = 1 + count / some;
  std::vector<float> few;
  for (std::size_t k = 0, left = 0; k < size; ++k) {
    if (!known(k)) continue;
    if (left == 0) few.push_back(values[k]), left = every;
    --left;
  }
  const auto upper = few.begin() + static_cast<std::ptrdiff_t>(few.size() / 2);
  std::nth_element(few.begin(), upper, few.end());
  return few.size() % 2 == 1 ? *upper : (*std::max_element(few.begin(), upper) + *upper) / 2;
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
    out.made.resize(size_), out.marks.resize(3 * size_);
    mark(out.marks.data());
    const float *across = apart(0), *along = apart(1);
    const std::uint8_t* still = out.marks.data();
    add(
        out, [&](std::size_t k) { return std::isfinite(across[k]) && std::isfinite(along[k]); },
        [&](std::size_t k) { return still[k] != 0; });
    // A fill that runs from rim to rim along rows or columns lacks noise along these alone.
    for (std::size_t way = 0; way < middle.size(); ++way) {
      const float *of = apart(way), below = quiet_[way];
      add(out, [&](std::size_t k) { return std::isfinite(of[k]); }, [&](std::size_t k) { return of[k] < below; });
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
      for (std::size_t way = 0; way < quiet_.size(); way += 2) {
        const float *down = apart(way), *right = apart(way + 1), below_down = quiet_[way], below_right = quiet_[way + 1];
        for (std::size_t k = begin; k < end; ++k) marks[k] |= static_cast<std::uint8_t>((down[k] < below_down) & (right[k] < below_right));
      }
      const float *down = apart(0), *right = apart(1), above_down = wild_[0], above_right = wild_[1];
      const std::uint8_t *copied = asked_.copied, *on = asked_.on_ply;
      std::uint8_t *copies = marks + size_, *flies = copies + size_;  // along both: beside a flying pixel it is along one
      std::uint32_t* counts = counts_.data();
      for (std::size_t k = begin; k < end; ++k) {
        copies[k] = copied[k] & on[k];
        flies[k] = static_cast<std::uint8_t>((down[k] > above_down) & (right[k] > above_right));
        counts[k] = on[k] + second * copies[k];
      }
    });
    if (copies_are_common()) std::fill_n(marks + size_, size_, std::uint8_t{0});
    odd_.assign(marks + size_, marks + 2 * size_);
    for (std::size_t k = 0; k < size_; ++k) odd_[k] |= marks[2 * size_ + k];
  }

  // Whether the median over the ply of the share of copies in the window around is above the limit.
  bool copies_are_common() const {
    const auto limit = static_cast<float>(limits_.copied_share);
    struct Part {
      long above = 0, all = 0;
      float below = 0, next = std::numeric_limits<float>::infinity();  // the shares nearest to the limit
    };
    std::vector<Part> parts(static_cast<std::size_t>(asked_.rows / strip + 1));
    windows([&](std::size_t first, const std::uint32_t* sums) {
      Part& part = parts[first / width() / strip];
      for (std::size_t c = 0; c < width(); ++c) {
        if (asked_.on_ply[first + c] == 0) continue;
        const float share = static_cast<float>(sums[c] >> bits) / static_cast<float>(sums[c] & mask);
        ++part.all;
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
      const auto row = [&](long at, auto change) {
        if (at < 0 || at >= asked_.rows) return;
        const std::uint32_t* from = counts_.data() + static_cast<std::size_t>(at) * wide;
        std::uint32_t* to = columns.data() + beside;
        for (std::size_t c = 0; c < wide; ++c) to[c] = change(to[c], from[c]);
      };
      for (long at = begin - half; at < begin + half; ++at) row(at, std::plus<>());
      for (long at = begin; at < end; ++at) {
        row(at + half, std::plus<>());
        std::uint32_t sum = 0;
        for (std::size_t c = 0; c < 2 * beside; ++c) sum += columns[c];
        for (std::size_t c = 0; c < wide; ++c) sums[c] = sum += columns[c + 2 * beside], sum -= columns[c];
        visit(static_cast<std::size_t>(at) * wide, static_cast<const std::uint32_t*>(sums.data()));
        row(at - half, std::minus<>());
      }
    });
  }

  // Adds the points that are likelier made than measured by those around that are known, and quiet or odd.
  template <class Known, class Quiet>
  void add(MadePoints& out, const Known& known, const Quiet& quiet) {
    std::atomic<long> all{0}, quiets{0}, odds{0};
    points([&](std::size_t begin, std::size_t end) {
      const std::uint8_t *on = asked_.on_ply, *odd_one = odd_.data();
      std::uint32_t* counts = counts_.data();
      std::uint32_t n = 0, still = 0, odd = 0;
      for (std::size_t k = begin; k < end; ++k) {
        const std::uint32_t is_known = (on[k] != 0) & known(k), is_odd = is_known & (odd_one[k] != 0);
        const std::uint32_t is_quiet = is_known & (is_odd ^ one) & quiet(k);
        counts[k] = one * is_known + second * is_quiet + third * is_odd;
        n += is_known, still += is_quiet, odd += is_odd;
      }
      all += n, quiets += still, odds += odd;
    });
    const double number = static_cast<double>(std::max(1L, all.load()));
    const auto natural = [&](long count) {  // by the median, half of them are neither at least
      return std::clamp(static_cast<double>(count) / number, limits_.rarest, 0.5 - limits_.rarest);
    };
    const double natural_odd = natural(odds), natural_quiet = natural(quiets);
    const auto odds_of = [](double of_made, double of_all) { return static_cast<float>(std::log(of_made / of_all)); };
    const float of_rest = odds_of(1 - (limits_.made_copied + limits_.made_quiet), 1 - (natural_odd + natural_quiet));
    const auto weight = [of_rest](float of) { return static_cast<double>(of_rest + (of - of_rest)); };
    const double of_odd = weight(odds_of(limits_.made_copied, natural_odd)), of_quiet = weight(odds_of(limits_.made_quiet, natural_quiet));
    const double of_rest_exact = of_rest, enough = limits_.least_share * limits_.window_cells * limits_.window_cells;
    windows([&](std::size_t first, const std::uint32_t* sums) {
      const std::uint8_t* on = asked_.on_ply + first;
      std::uint8_t* made = out.made.data() + first;
      const auto least = static_cast<int>(std::ceil(enough));
      for (std::size_t c = 0, wide = width(); c < wide; ++c) {
        const auto part = [sum = sums[c]](int at) { return static_cast<int>((sum >> at) & mask); };
        const int seen = part(0), still = part(bits), odd = part(2 * bits);
        const double log_odds = (seen - still - odd) * of_rest_exact + still * of_quiet + odd * of_odd;
        made[c] |= static_cast<std::uint8_t>((on[c] != 0) & (seen >= least) & (log_odds > 0));
      }
    });
  }

  const AskedPoints& asked_;
  const MadeLimits& limits_;
  int threads_;
  const Stop& stop_;
  std::size_t size_;
  std::vector<std::uint32_t> counts_;
  std::vector<std::uint8_t> odd_;
  std::vector<float> quiet_, wild_;
};

}  // namespace

MadePoints made_points(const AskedPoints& asked, double step_mm, const MadeLimits& limits, int threads, const Stop& stop) {
  return Search(asked, limits, threads, stop).run(step_mm);
}

}  // namespace debulk
