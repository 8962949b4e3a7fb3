#include "debulk/fibre/runs.hpp"

#include <algorithm>
#include <cmath>

namespace debulk {
namespace {

// mm, standard deviation of an excess that is read from heights without noise: of the steps along a line, and of their
// grid (tests/cpp/fibre, bench/open/margins.txt).
constexpr double kReading = 0.006;
// d^2 / w, see below: of a bump that is narrower yet, a line at that distance shows next to nothing.
constexpr double kFarthest = 2.0;

// One span with the noise's share taken out.
struct Measured {
  ExcessRange excess;
  double variance = 0.0;  // mm2
};

Measured measured(const FibreSpan& span, const FlatNoise& noise, const ScaleBlurs& blurs, const FibreOptions& options) {
  Measured out;
  const double fine = span.fine - noise.fine_per_mm() * span.length, coarse = span.coarse - noise.coarse_per_mm() * span.length;
  // White noise of the heights, correlated over the finer mean's width, moves the length by its product with the
  // curvature, and the low end by more, as it changes with `fine`; the noise's own slopes add the scatter that the low end
  // has on flat ply. What makes up for the filters makes all of it up, too.
  const double width = std::sqrt(12 * blurs.fine), more = blurs.coarse / (blurs.coarse - blurs.fine);
  out.variance = noise.variance_per_mm(options.step) * span.length + more * more * noise.gap_variance() * width * span.bend;
  out.excess = before_filters(fine, coarse, blurs.fine, blurs.coarse, blurs.least);
  if (fine <= 0) return out;
  out.variance *= std::pow(out.excess.mid / fine, 2);
  // The crest of a round bump of the variance w may lie where no line is read, at d from the nearest. There its slopes
  // are lower by exp(-d^2 / 2w), and the excess by the square of that; the middle tells w (filter_loss.hpp).
  const double of_width = blurs.fine > 0 ? (std::pow(out.excess.mid / fine, 1 / kRound) - 1) / blurs.fine : 0.0;
  out.excess.high *= std::exp(std::min(span.aside * span.aside * of_width, kFarthest));
  return out;
}

struct Held {
  FibreEnd end = FibreEnd::held;
  double beyond = 0.0;
};

// Follows the line outwards from one of its points.
Held held_beyond(const FibreLine& line, int at, int side, const std::vector<Stretch>& gaps, const FibreOptions& options) {
  const double to_end = (side < 0 ? at : line.count - 1 - at) * line.step;
  double to_gap = to_end + 1;
  for (const Stretch& gap : gaps) {
    const int steps = side < 0 ? at - gap.end + 1 : gap.first - at;
    if (steps >= 0) to_gap = std::min(to_gap, steps * line.step);
  }
  Held out;
  out.beyond = std::min(to_end, to_gap);
  if (out.beyond >= options.hold) return out;
  out.end = to_gap <= to_end || !line.to_edge[side < 0 ? 0 : 1] ? FibreEnd::unknown : FibreEnd::free;
  return out;
}

bool parted_by(const std::vector<Stretch>& gaps, int last, int first) {
  return std::any_of(gaps.begin(), gaps.end(), [&](const Stretch& gap) { return gap.first > last && gap.end <= first; });
}

}  // namespace

void join_spans(const FibreLine& line, int index, const std::vector<FibreSpan>& spans, const std::vector<Stretch>& gaps,
                const FlatNoise& noise, const ScaleBlurs& blurs, const FibreOptions& options, std::vector<FibreRun>& out) {
  std::vector<Measured> each;
  each.reserve(spans.size());
  for (const FibreSpan& span : spans) each.push_back(measured(span, noise, blurs, options));
  for (std::size_t m = 0; m < spans.size(); ++m) {
    FibreRun run;
    double variance = 0.0, most = 0.0, together = 0.0;
    for (std::size_t n = m; n < spans.size(); ++n) {
      if (n > m) {
        if (parted_by(gaps, spans[n - 1].last, spans[n].first)) break;
        const int between = spans[n].first - spans[n].unread[0] - spans[n - 1].last - spans[n - 1].unread[1];
        const double apart = between * line.step - spans[n - 1].tails[1] - spans[n].tails[0];
        if (apart > 0) run.flat += apart, together = 0.0;
        if (run.flat > options.draw) break;
      }
      // Whether one fold draws the spans beyond flat ply depends on how the vacuum rises, so only what no flat ply parts is
      // surely in one fold.
      together += each[n].excess.low;
      run.excess.low = n == m ? together : std::max(run.excess.low, together);
      run.excess.mid += each[n].excess.mid, run.excess.high += each[n].excess.high;
      run.turn += spans[n].turn;
      variance += each[n].variance;
      if (n == m || spans[n].gap > run.gap) run.gap = spans[n].gap, run.top = line.at(spans[n].top);
      most = n == m ? run.excess.high : std::max(most, each[n].excess.high);
      if (n > m && run.excess.high <= most) continue;
      run.family = line.family, run.line = index, run.spans = static_cast<int>(n - m) + 1;
      run.first = spans[m].first, run.last = spans[n].last;
      run.from = line.at(spans[m].first), run.to = line.at(spans[n].last);
      run.length = (spans[n].last - spans[m].first) * line.step;
      run.uncertainty = 2 * std::sqrt(variance + kReading * kReading);
      for (const int side : {0, 1}) {
        const int end = side == 0 ? spans[m].first - spans[m].unread[0] : spans[n].last + spans[n].unread[1];
        const Held held = held_beyond(line, end, side == 0 ? -1 : 1, gaps, options);
        run.ends[static_cast<std::size_t>(side)] = held.end, run.beyond[static_cast<std::size_t>(side)] = held.beyond;
      }
      out.push_back(run);
    }
  }
}

}  // namespace debulk
