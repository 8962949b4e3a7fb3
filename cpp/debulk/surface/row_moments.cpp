#include "debulk/surface/row_moments.hpp"

#include <algorithm>
#include <cmath>

#include "debulk/core/parallel.hpp"

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

void RowMemory::hold(std::size_t count) {
  if (count <= size) return;
  sums.reset(new double[kSums * count]), weights.reset(new double[kWeights * count]);
  size = count;
}

RowMoments::RowMoments(const Grid<float>& heights, const FitNodes& nodes, const FitWindow& window, const Grid<std::uint8_t>& wanted,
                       RowMemory& memory, int threads, const Stop& stop)
    : heights_(heights), nodes_(nodes), window_(window), wanted_(wanted), wide_((nodes.nx + kTogether - 1) / kTogether * kTogether) {
  const std::size_t size = static_cast<std::size_t>(heights.ny) * static_cast<std::size_t>(wide_);
  complete_.resize(size);
  memory.hold(size);
  sums_ = memory.sums.get(), weights_ = memory.weights.get();
  for (int d = 0; d <= window.reach; ++d)
    for (std::size_t a = 0; a < 3; ++a) powers_.push_back(window.at(d)[a]);
  parallel_for(heights.ny, 2 * kTogether, threads, stop, [&](long begin, long end) {
    for (long j = begin; j < end; j += kTogether) read_rows(static_cast<int>(j), static_cast<int>(std::min<long>(j + kTogether, end)));
  });
}

std::array<std::uint8_t, kTogether> RowMoments::all_complete(int i, int low, int high) const {
  std::array<std::uint8_t, kTogether> out;
  out.fill(1);
  for (int row = low; row <= high; ++row)
    for (std::size_t k = 0; k < kTogether; ++k) out[k] &= complete_[at(i, row) + k];
  return out;
}

void RowMoments::add_up(int i, int low, int high, int middle, double* out) const {
  window_sums(&sums_[place(kSums, i, low)], wide_, high - low + 1, window_.at(low - middle).data(), out);
}

void RowMoments::add_up_weights(int i, int low, int high, int middle, double* out) const {
  window_weights(&weights_[place(kWeights, i, low)], wide_, high - low + 1, window_.at(low - middle).data(), out);
}

// Whether a window of the kTogether nodes from node i on reaches one of the rows [begin, end).
bool RowMoments::needed(int i, int begin, int end) const {
  if (wanted_.size() == 0) return true;
  for (int j = 0; j < nodes_.ny; ++j) {
    const int middle = nodes_.first_j + j * nodes_.step;
    if (middle + window_.reach < begin || middle - window_.reach >= end) continue;
    const std::uint8_t* row = &wanted_.at(0, j);
    if (std::any_of(row + i, row + std::min(i + kTogether, nodes_.nx), [](std::uint8_t mark) { return mark != 0; })) return true;
  }
  return false;
}

// Up to kTogether rows, whose heights are put side by side.
void RowMoments::read_rows(int begin, int end) {
  std::vector<int> asked;
  for (int i = 0; i < wide_; i += kTogether)
    if (needed(i, begin, end))
      for (int k = 0; k < kTogether; ++k) asked.push_back(i + k);
  if (asked.empty()) return;
  const int nx = heights_.nx, reach = window_.reach;
  const std::size_t size = static_cast<std::size_t>(nx) * kTogether;
  const std::unique_ptr<double[]> columns(new double[size]), known(new double[size]);
  std::vector<int> missing(size + kTogether);
  const float* rows[kTogether];
  for (int k = 0; k < kTogether; ++k) rows[k] = &heights_.at(0, std::min(begin + k, end - 1));
  rows_together(rows, nx, columns.get(), known.get(), missing.data());
  for (const int i : asked) {
    const int middle = nodes_.first_i + i * nodes_.step;
    const int first = std::max(0, middle - reach), last = std::min(nx - 1, middle + reach);
    const bool inside = i < nodes_.nx && last - first == 2 * reach;
    bool whole = inside;
    for (int j = begin; j < end; ++j) {
      const auto before = [&](int column) {
        return missing[static_cast<std::size_t>(column) * kTogether + static_cast<std::size_t>(j - begin)];
      };
      complete_[at(i, j)] = inside && before(last + 1) == before(first);
      whole = whole && complete_[at(i, j)];
    }
    double paired[kSums * kTogether] = {}, single[(kSums + 5) * kTogether] = {};
    if (inside) row_sums(&columns[static_cast<std::size_t>(middle) * kTogether], reach, powers_.data(), paired);
    if (!whole && i < nodes_.nx && first <= last) {
      const std::size_t from = static_cast<std::size_t>(first) * kTogether;
      incomplete_row_sums(&columns[from], &known[from], last - first + 1, window_.at(first - middle).data(), single);
    }
    for (int j = begin; j < end; ++j) {
      const auto k = static_cast<std::size_t>(j - begin);
      const double* found = complete_[at(i, j)] ? paired : single;
      for (std::size_t a = 0; a < kSums; ++a) sums_[place(kSums, i, j, a)] = found[a * kTogether + k];
      for (std::size_t a = 0; a < kWeights; ++a)
        weights_[place(kWeights, i, j, a)] = complete_[at(i, j)] ? window_.all[a] : single[(kSums + a) * kTogether + k];
    }
  }
}

}  // namespace debulk
