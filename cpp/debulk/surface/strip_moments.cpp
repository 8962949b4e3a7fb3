#include "debulk/surface/strip_moments.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace debulk {

FitNodes::FitNodes(const Grid<float>& heights, double spacing)
    : step(std::max(1, static_cast<int>(std::lround(spacing / heights.spacing)))) {
  nx = std::max(4, (heights.nx - 2 + step) / step + 1);
  ny = std::max(4, (heights.ny - 2 + step) / step + 1);
  first_i = -((nx - 1) * step - (heights.nx - 1)) / 2;
  first_j = -((ny - 1) * step - (heights.ny - 1)) / 2;
}

FitWindow::FitWindow(int r) : reach(r) {
  for (int d = -r; d <= r; ++d) {
    const double x = static_cast<double>(d) / (r + 1);
    double w = std::pow(1 - x * x, 2);
    std::array<double, 5>& at = powers.emplace_back();
    for (std::size_t a = 0; a < 5; ++a, w *= x) at[a] = w, all[a] += w;
  }
}

void StripMoments::mark_needed(const FitNodes& nodes, int first_node, const Grid<std::uint8_t>& wanted) {
  const int ny = static_cast<int>(needed_.size());
  for (int j = 0; j < nodes.ny; ++j) {
    const std::uint8_t *row = &wanted.at(0, j), *end = row + std::min(first_node + kTogether, nodes.nx);
    if (std::none_of(row + first_node, end, [](std::uint8_t mark) { return mark != 0; })) continue;
    const int middle = nodes.first_j + j * nodes.step;
    const int low = std::max(0, middle - window_->reach), high = std::min(ny - 1, middle + window_->reach);
    if (low <= high) std::fill(needed_.begin() + low, needed_.begin() + high + 1, 1);
  }
}

void StripMoments::read(const Grid<float>& heights, const FitNodes& nodes, const FitWindow& window, int first_node,
                        const Grid<std::uint8_t>& wanted) {
  window_ = &window;
  needed_.assign(static_cast<std::size_t>(heights.ny), wanted.size() == 0);
  if (wanted.size() != 0) mark_needed(nodes, first_node, wanted);
  sums_.resize(needed_.size() * kSums * kTogether);
  incomplete_.clear(), complete_.clear(), missing_.clear();
  for (int j = 0; j < heights.ny; j += kTogether) {
    const int end = std::min(j + kTogether, heights.ny);
    if (std::any_of(needed_.begin() + j, needed_.begin() + end, [](std::uint8_t mark) { return mark != 0; }))
      read_rows(heights, nodes, first_node, j, end);
  }
}

// Up to kTogether rows, whose heights are put side by side.
void StripMoments::read_rows(const Grid<float>& heights, const FitNodes& nodes, int first_node, int begin, int end) {
  const int reach = window_->reach, wide = (kTogether - 1) * nodes.step + 2 * reach + 1;
  const int left = nodes.first_i + first_node * nodes.step - reach;  // the strip's first column
  const int first = std::clamp(left, 0, heights.nx), last = std::clamp(left + wide, first, heights.nx);
  const std::size_t size = static_cast<std::size_t>(wide) * kTogether;
  columns_.resize(size), holes_.resize(size);
  if (last - first < wide) beyond_.assign(size, std::numeric_limits<float>::quiet_NaN());
  const float* rows[kTogether];
  for (int k = 0; k < kTogether; ++k) {
    rows[k] = heights.values.data() + heights.index(first, std::min(begin + k, end - 1));
    if (last - first == wide) continue;
    float* row = &beyond_[static_cast<std::size_t>(k) * static_cast<std::size_t>(wide)];
    std::copy(rows[k], rows[k] + (last - first), row + (first - left));
    rows[k] = row;
  }
  // The next rows of the strip lie far apart, where no machine would look ahead.
  for (int j = end; j < std::min(end + kTogether, heights.ny); ++j)
    for (int i = first; i < last; i += 16) __builtin_prefetch(heights.values.data() + heights.index(i, j));
  const bool whole = !rows_together(rows, wide, columns_.data(), holes_.data());

  double missing[kTogether][kWeights][kTogether] = {};
  double sums[kSums * kTogether], holes[kWeights * kTogether];
  for (int node = 0; node < kTogether; ++node) {
    const auto middle = static_cast<std::size_t>((node * nodes.step + reach) * kTogether);
    row_sums(&columns_[middle], reach, window_->at(0).data(), sums);
    double* to = &sums_[static_cast<std::size_t>(begin) * kSums * kTogether + static_cast<std::size_t>(node)];
    for (std::size_t k = 0; k < static_cast<std::size_t>(end - begin); ++k)
      for (std::size_t a = 0; a < kSums; ++a) to[(k * kSums + a) * kTogether] = sums[a * kTogether + k];
    if (whole) continue;
    missing_sums(&holes_[middle], reach, window_->at(0).data(), holes);
    for (std::size_t k = 0; k < kTogether; ++k)
      for (std::size_t a = 0; a < kWeights; ++a) missing[k][a][node] = holes[a * kTogether + k];
  }
  if (whole) return;
  for (int k = 0; k < end - begin; ++k) {
    std::uint8_t complete = 0;  // no weight is 0
    for (int node = 0; node < kTogether; ++node) complete |= static_cast<std::uint8_t>((missing[k][0][node] == 0 ? 1U : 0U) << node);
    if (complete == (1U << kTogether) - 1) continue;
    incomplete_.push_back(begin + k), complete_.push_back(complete);
    missing_.insert(missing_.end(), &missing[k][0][0], &missing[k][0][0] + kWeights * kTogether);
  }
}

void StripMoments::add_up(int low, int high, int middle, double* out) const {
  window_sums(&sums_[static_cast<std::size_t>(low) * kSums * kTogether], high - low + 1, window_->at(low - middle).data(), out);
}

unsigned StripMoments::add_up_weights(int low, int high, int middle, double* out) const {
  std::array<double, kWeights> rows{};
  unsigned complete = high - low == 2 * window_->reach ? (1U << kTogether) - 1 : 0;
  if (complete != 0)
    rows = window_->all;
  else
    for (int j = low; j <= high; ++j)
      for (std::size_t b = 0; b < kWeights; ++b) rows[b] += window_->at(j - middle)[b];
  double* sum = out;
  for (std::size_t a = 0; a < kWeights; ++a)
    for (std::size_t b = 0; a + b < kWeights; ++b, sum += kTogether) std::fill_n(sum, kTogether, rows[b] * window_->all[a]);
  const auto begin = std::lower_bound(incomplete_.begin(), incomplete_.end(), low);
  const auto end = std::upper_bound(begin, incomplete_.end(), high);
  const auto first = static_cast<std::size_t>(begin - incomplete_.begin()), count = static_cast<std::size_t>(end - begin);
  for (std::size_t n = first; n < first + count; ++n) complete &= complete_[n];
  if (count != 0)
    take_missing(&missing_[first * kWeights * kTogether], &*begin, low, static_cast<int>(count), window_->at(low - middle).data(), out);
  return complete;
}

}  // namespace debulk
