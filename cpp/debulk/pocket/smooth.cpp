#include "debulk/pocket/smooth.hpp"

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <vector>

#include "debulk/core/error.hpp"
#include "debulk/core/parallel.hpp"
#include "debulk/core/simd.hpp"

namespace debulk {
namespace {

constexpr long kRowsPerChunk = 64;

// Sums over the known points of one row's window, of x^a and of x^a times the height.
struct RowMoments {
  std::array<double, 5> x;
  std::array<double, 3> xh;
};

using Powers = std::array<double, 8>;  // of a distance, the 0th to the 4th; the rest is 0

// Sums over the known points of a window, of x^a y^b (xy[a][b], a + b <= 4) and of x^a y^b times the height.
struct WindowMoments {
  double known, xy[5][8], xyh[3][8];
};

constexpr int kColumns = 32;  // number of columns that the kernel's loops take at once

#define DEBULK_KERNEL "debulk/pocket/smooth_kernel.inl"
#include "debulk/core/simd_dispatch.inl"

// The least-squares quadratic through the known points of a (2 half + 1)^2 window, from the sums of its rows.
// Distances are in half-widths.
class WindowFit {
 public:
  // blur: as in SmoothOptions, in squares of the half-width.
  WindowFit(int half, double blur) : half_(half), blur_(blur) {
    // If the whole window is known, odd terms drop out, and the value at the centre is sum (a + b (x^2 + y^2)) h,
    // where the sum of the weights is 1 and their second moments are -blur.
    const double n = 2.0 * half + 1;
    double x2 = 0, x4 = 0;
    for (int k = -half; k <= half; ++k) {
      const double x = static_cast<double>(k) / half;
      power_of_.push_back({1, x, x * x, x * x * x, x * x * x * x, 0, 0, 0});
      x2 += x * x, x4 += x * x * x * x;
    }
    const double s0 = n * n, s2 = n * x2, s4 = n * x4 + x2 * x2;
    whole_ = s0;
    b_ = -(s2 + blur * s0) / (s0 * s4 - 2 * s2 * s2);
    a_ = (1 - 2 * b_ * s2) / s0;
  }

  double whole() const { return whole_; }

  double a() const { return a_; }
  double b() const { return b_; }

  // The fit to the known points alone. rows: the moments of the 2 half + 1 rows, starting with the first.
  double at_centre(const RowMoments* const* rows) const {
    WindowMoments sums;
    DEBULK_ON(best_isa(), add_up(rows, power_of_.data(), 2 * half_ + 1, sums));
    const double count = sums.known;
    Eigen::Matrix<double, 6, 1> right;
    Eigen::Matrix<double, 6, 6> matrix;
    for (int s = 0; s < 6; ++s) {
      right[s] = sums.xyh[kTerm[s][0]][kTerm[s][1]];
      for (int t = 0; t < 6; ++t) matrix(s, t) = sums.xy[kTerm[s][0] + kTerm[t][0]][kTerm[s][1] + kTerm[t][1]];
    }
    matrix.diagonal().array() += 1e-9 * count;
    const Eigen::Matrix<double, 6, 1> fit = matrix.llt().solve(right);
    return fit[0] - blur_ * (fit[3] + fit[5]);
  }

  const Powers& powers(int k) const { return power_of_[static_cast<std::size_t>(k + half_)]; }

 private:
  static constexpr std::size_t kTerm[6][2] = {{0, 0}, {1, 0}, {0, 1}, {2, 0}, {1, 1}, {0, 2}};
  int half_;
  double blur_, whole_, a_, b_;
  std::vector<Powers> power_of_;
};

RowMoments row_moments(const Grid<float>& heights, int i, int j, int half, const WindowFit& fit) {
  RowMoments m{};
  if (j < 0 || j >= heights.ny) return m;
  for (int k = std::max(-half, -i); k <= half && i + k < heights.nx; ++k) {
    const double h = heights.at(i + k, j);
    if (std::isnan(h)) continue;
    const auto& x = fit.powers(k);
    for (std::size_t a = 0; a < 5; ++a) m.x[a] += x[a];
    for (std::size_t a = 0; a < 3; ++a) m.xh[a] += x[a] * h;
  }
  return m;
}

// Fits in windows in which some points are not known. The moments of one row in one column's window are the same for
// all windows of that column, and are kept for the rows that were used last.
class IncompleteWindows {
 public:
  IncompleteWindows(const Grid<float>& heights, const WindowFit& fit, int half)
      : heights_(heights), fit_(fit), half_(half), rows_(2 * half + 1) {}

  double at_centre(int i, int j) {
    if (row_of_.empty()) {
      row_of_.assign(static_cast<std::size_t>(heights_.nx) * static_cast<std::size_t>(rows_), kNone);
      moments_.reset(new RowMoments[row_of_.size()]);  // most are never used
      asked_.resize(static_cast<std::size_t>(rows_));
    }
    const std::size_t first = static_cast<std::size_t>(i) * asked_.size();
    std::size_t slot = static_cast<std::size_t>((((j - half_) % rows_) + rows_) % rows_);
    for (std::size_t k = 0; k < asked_.size(); ++k) {
      const int row = j - half_ + static_cast<int>(k);
      const std::size_t at = first + slot;
      if (row_of_[at] != row) {
        row_of_[at] = row;
        moments_[at] = row_moments(heights_, i, row, half_, fit_);
      }
      asked_[k] = &moments_[at];
      if (++slot == asked_.size()) slot = 0;
    }
    return fit_.at_centre(asked_.data());
  }

 private:
  static constexpr int kNone = std::numeric_limits<int>::min();

  const Grid<float>& heights_;
  const WindowFit& fit_;
  int half_, rows_;
  std::vector<int> row_of_;
  std::unique_ptr<RowMoments[]> moments_;
  std::vector<const RowMoments*> asked_;  // of one window
};

// Columns [left, right] of a grid.
struct Span {
  int left, right;
};

// Columns in which anything is wanted in the rows first .. last. Gaps narrower than a window are not worth leaving
// out.
std::vector<Span> wanted_spans(const Grid<float>& heights, const Grid<std::uint8_t>* where, int first, int last, int half) {
  if (!where) return {{0, heights.nx - 1}};
  std::vector<std::uint8_t> any(static_cast<std::size_t>(heights.nx), 0);
  for (int j = first; j <= last; ++j) {
    const std::uint8_t* row = &where->at(0, j);
    for (std::size_t i = 0; i < any.size(); ++i) any[i] |= row[i];
  }
  std::vector<Span> spans;
  for (int i = 0; i < heights.nx; ++i) {
    if (any[static_cast<std::size_t>(i)] == 0) continue;
    if (spans.empty() || i > spans.back().right + 2 * half + 1) spans.push_back({i, i});
    spans.back().right = i;
  }
  return spans;
}

// 1 where both masks, if given, are not 0.
void choose(const std::uint8_t* one, const std::uint8_t* other, std::vector<std::uint8_t>& out) {
  std::uint8_t* __restrict to = out.data();
  const std::size_t count = out.size();
  std::fill_n(to, count, std::uint8_t{1});
  for (const std::uint8_t* mask : {one, other})
    for (std::size_t k = 0; mask && k < count; ++k) to[k] = static_cast<std::uint8_t>(to[k] & (mask[k] != 0));
}

// Slides a window down the rows of a span. The sums of each row are computed once, and kept while a window needs them.
class SlidingFit {
 public:
  SlidingFit(const Grid<float>& heights, const WindowFit& fit, int half, Span span)
      : heights_(heights),
        fit_(fit),
        half_(half),
        left_(span.left),
        rows_(2 * half + 1),
        needed_(static_cast<std::size_t>(span.right - span.left) + rows_),
        size_((static_cast<std::size_t>(span.right - span.left) + kColumns) / kColumns * kColumns),
        values_(size_ + rows_ - 1),
        unknown_before_(needed_ + 1),
        s0_(size_ * rows_),
        s2_(size_ * rows_),
        missing_(size_ * rows_),
        lacks_(rows_),
        value_(size_),
        total_(size_),
        s0_of_(rows_),
        s2_of_(rows_) {
    for (int k = -half; k <= half; ++k) {
      squares_.push_back(fit.powers(k)[2]);
      factors_.push_back(fit.a() + fit.b() * squares_.back());
    }
  }

  // Moves on to row j, and computes the fit's values at the span's columns [first, end). Rows must be taken one by
  // one.
  void to_row(int j, int first, int end) {
    if (!begun_)
      for (int row = j - half_; row < j + half_; ++row) add(row);
    else
      take_away(j - half_ - 1);
    begun_ = true;
    add(j + half_);
    if (first >= end) return;
    const int from = first / kColumns * kColumns, count = (end - from + kColumns - 1) / kColumns * kColumns;
    for (std::size_t k = 0; k < rows_; ++k) {
      const std::size_t at = size_ * slot(j - half_ + static_cast<int>(k)) + static_cast<std::size_t>(from);
      s0_of_[k] = &s0_[at], s2_of_[k] = &s2_[at];
    }
    DEBULK_ON(best_isa(),
              fit_row(s0_of_.data(), s2_of_.data(), factors_.data(), fit_.b(), half_, count, &value_[static_cast<std::size_t>(from)]));
  }
  const double* values() const { return value_.data(); }  // from the span's left on
  bool complete() const { return lacking_ == 0; }         // all windows of the row are known
  int known(int i) const { return static_cast<int>(rows_ * rows_) - total_[static_cast<std::size_t>(i - left_)]; }

 private:
  std::size_t slot(int row) const {
    const int count = static_cast<int>(rows_);
    return static_cast<std::size_t>(((row % count) + count) % count);
  }

  void add(int j) {
    const bool whole = read(j);
    const std::size_t s = slot(j), at = size_ * s;
    DEBULK_ON(best_isa(), row_sums(values_.data(), squares_.data(), half_, static_cast<int>(size_), &s0_[at], &s2_[at]));
    lacks_[s] = !whole;
    if (whole) return;
    ++lacking_;
    for (std::size_t k = 0; k + rows_ <= needed_; ++k) {
      missing_[at + k] = unknown_before_[k + rows_] - unknown_before_[k];
      total_[k] += missing_[at + k];
    }
  }

  // Reads a row's values, 0 where unknown. Returns whether all are known; if not, unknown_before_ counts the unknown
  // ones before each.
  bool read(int j) {
    const int first = left_ - half_, begin = std::max(first, 0), end = std::min(first + static_cast<int>(values_.size()), heights_.nx);
    if (j < 0 || j >= heights_.ny) {
      std::fill(values_.begin(), values_.end(), 0.0);
      for (std::size_t k = 0; k < needed_; ++k) unknown_before_[k + 1] = static_cast<int>(k) + 1;
      return false;
    }
    const float* row = &heights_.at(0, j);
    std::fill_n(values_.begin(), begin - first, 0.0);
    const bool all = DEBULK_ON(best_isa(), widen(row + begin, end - begin, &values_[static_cast<std::size_t>(begin - first)]));
    std::fill(values_.begin() + (end - first), values_.end(), 0.0);
    if (all && begin == first && end - first >= static_cast<int>(needed_)) return true;
    for (std::size_t k = 0; k < needed_; ++k) {
      const int i = first + static_cast<int>(k);
      unknown_before_[k + 1] = unknown_before_[k] + (i < 0 || i >= heights_.nx || std::isnan(row[i]));
    }
    return unknown_before_[needed_] == 0;
  }

  void take_away(int j) {
    const std::size_t s = slot(j), at = size_ * s;
    if (!lacks_[s]) return;
    --lacking_;
    for (std::size_t k = 0; k + rows_ <= needed_; ++k) total_[k] -= missing_[at + k];
  }

  const Grid<float>& heights_;
  const WindowFit& fit_;
  int half_, left_;
  std::size_t rows_;
  std::size_t needed_, size_;  // columns that windows of the span reach; places that the loops above work on
  std::vector<double> squares_, factors_;
  std::vector<double> values_;
  std::vector<int> unknown_before_;
  std::vector<double> s0_, s2_;  // of the last rows, each in its slot
  std::vector<int> missing_;     // the same, for rows that are not complete
  std::vector<std::uint8_t> lacks_;
  std::vector<double> value_;
  std::vector<int> total_;
  std::vector<const double*> s0_of_, s2_of_;
  int lacking_ = 0;
  bool begun_ = false;
};

}  // namespace

void SmoothOptions::check() const {
  require(std::isfinite(window_mm) && window_mm >= 0, "smooth_mm", "a length in mm, not negative", window_mm);
  require(std::isfinite(blur_mm2) && blur_mm2 >= 0, "blur_mm2", "a variance in mm2, not negative", blur_mm2);
  require(least_known > 0 && least_known <= 1, "least_known", "a share above 0, at most 1", least_known);
}

Grid<float> smooth_heights(const Grid<float>& heights, const PlyMask& ply, const SmoothOptions& options, const Grid<std::uint8_t>* where,
                           int threads, const Stop& stop) {
  Grid<float> out;
  smooth_heights(heights, ply, options, where, out, threads, stop);
  return out;
}

void smooth_heights(const Grid<float>& heights, const PlyMask& ply, const SmoothOptions& options, const Grid<std::uint8_t>* where,
                    Grid<float>& out, int threads, const Stop& stop) {
  options.check();
  const int half = static_cast<int>(std::lround(options.window_mm / (2 * heights.spacing)));
  if (half < 1) return static_cast<void>(out = heights);
  out.reshape(heights);
  const WindowFit fit(half, options.blur_mm2 / std::pow(half * heights.spacing, 2));
  parallel_for(heights.ny, kRowsPerChunk, threads, stop, [&](long begin, long end) {
    const int first = static_cast<int>(begin), last = static_cast<int>(end) - 1;
    std::copy_n(&heights.at(0, first), heights.index(0, last + 1) - heights.index(0, first), &out.at(0, first));
    const std::vector<Span> spans = wanted_spans(heights, where, first, last, half);
    if (spans.empty()) return;
    IncompleteWindows incomplete(heights, fit, half);
    std::vector<std::uint8_t> wanted;
    for (const Span span : spans) {
      SlidingFit sliding(heights, fit, half, span);
      const int count = span.right - span.left + 1;
      wanted.resize(static_cast<std::size_t>(count));
      for (int j = first; j <= last; ++j) {
        choose(where ? &where->at(span.left, j) : nullptr, ply.known() ? ply.row(j) + span.left : nullptr, wanted);
        const auto one = std::find(wanted.begin(), wanted.end(), 1);
        const int from = static_cast<int>(one - wanted.begin());
        int to = count;
        while (to > from && wanted[static_cast<std::size_t>(to - 1)] == 0) --to;
        sliding.to_row(j, from, to);
        if (sliding.complete()) {
          DEBULK_ON(best_isa(), put(sliding.values() + from, wanted.data() + from, to - from, &out.at(span.left, j) + from));
          continue;
        }
        for (int i = span.left + from; i < span.left + to; ++i) {
          if (!wanted[static_cast<std::size_t>(i - span.left)]) continue;
          if (sliding.known(i) == static_cast<int>(fit.whole())) {
            out.at(i, j) = static_cast<float>(sliding.values()[i - span.left]);
            continue;
          }
          const double least = std::isnan(heights.at(i, j)) ? fit.whole() * options.least_known : 0;
          if (sliding.known(i) < std::max(9.0, least)) continue;
          const double fitted = incomplete.at_centre(i, j);
          if (!std::isnan(fitted)) out.at(i, j) = static_cast<float>(fitted);
        }
      }
    }
  });
}

}  // namespace debulk
