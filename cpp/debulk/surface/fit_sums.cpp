#include "debulk/surface/fit_sums.hpp"

#include "debulk/core/wide.hpp"

namespace debulk {

DEBULK_WIDE void rows_together(const float* const* rows, int count, double* columns, double* known, int* missing) {
  int before[kTogether] = {};
  for (int i = 0; i < count; ++i)
    for (int k = 0; k < kTogether; ++k) {
      const float z = rows[k][i];
      const bool is = z == z;
      columns[i * kTogether + k] = is ? z : 0.0, known[i * kTogether + k] = is ? 1.0 : 0.0;
      missing[i * kTogether + k] = before[k];
      before[k] += is ? 0 : 1;
    }
  for (int k = 0; k < kTogether; ++k) missing[count * kTogether + k] = before[k];
}

DEBULK_WIDE void row_sums(const double* columns, int reach, const double* weights, double* out) {
  double even[kTogether], odd[kTogether], second[kTogether], squares[kTogether];
  for (int k = 0; k < kTogether; ++k) {
    const double z = columns[k];
    even[k] = weights[0] * z, odd[k] = 0, second[k] = 0, squares[k] = weights[0] * z * z;
  }
  for (int d = 1; d <= reach; ++d) {
    const double *w = weights + 3 * d, *at_left = columns - d * kTogether, *at_right = columns + d * kTogether;
    for (int k = 0; k < kTogether; ++k) {
      const double left = at_left[k], right = at_right[k], sum = right + left;
      even[k] += w[0] * sum, odd[k] += w[1] * (right - left), second[k] += w[2] * sum;
      squares[k] += w[0] * (left * left + right * right);
    }
  }
  for (int k = 0; k < kTogether; ++k) {
    out[k] = even[k], out[kTogether + k] = odd[k], out[2 * kTogether + k] = second[k], out[3 * kTogether + k] = squares[k];
  }
}

DEBULK_WIDE void incomplete_row_sums(const double* columns, const double* known, int count, const double* weights, double* out) {
  double sums[kSums + 5][kTogether] = {};
  for (int n = 0; n < count; ++n) {
    const double *w = weights + 5 * n, *z = columns + n * kTogether, *is = known + n * kTogether;
    for (int k = 0; k < kTogether; ++k) {
      sums[0][k] += w[0] * z[k], sums[1][k] += w[1] * z[k], sums[2][k] += w[2] * z[k], sums[3][k] += w[0] * z[k] * z[k];
      for (std::size_t a = 0; a < 5; ++a) sums[kSums + a][k] += w[a] * is[k];
    }
  }
  for (std::size_t a = 0; a < kSums + 5; ++a)
    for (std::size_t k = 0; k < kTogether; ++k) out[a * kTogether + k] = sums[a][k];
}

DEBULK_WIDE void window_sums(const double* rows, int wide, int count, const double* weights, double* out) {
  double sums[kSquareSums][kTogether] = {};
  for (int n = 0; n < count; ++n) {
    const double *w = weights + 5 * n, *even = rows + static_cast<long>(n) * static_cast<long>(kSums) * wide;
    const double *odd = even + wide, *second = odd + wide, *squares = second + wide;
    for (int k = 0; k < kTogether; ++k) {
      sums[0][k] += w[0] * even[k], sums[1][k] += w[0] * odd[k], sums[2][k] += w[0] * second[k];
      sums[3][k] += w[1] * even[k], sums[4][k] += w[1] * odd[k], sums[5][k] += w[2] * even[k];
      sums[6][k] += w[0] * squares[k];
    }
  }
  for (std::size_t a = 0; a < kSquareSums; ++a)
    for (int k = 0; k < kTogether; ++k) out[a * kTogether + static_cast<std::size_t>(k)] = sums[a][k];
}

DEBULK_WIDE void window_weights(const double* rows, int wide, int count, const double* weights, double* out) {
  double sums[kSquareWeights][kTogether] = {};
  for (int n = 0; n < count; ++n) {
    const double *w = weights + 5 * n, *row = rows + static_cast<long>(n) * static_cast<long>(kWeights) * wide;
    std::size_t at = 0;
    for (std::size_t b = 0; b < kWeights; ++b)
      for (std::size_t a = 0; a + b < kWeights; ++a, ++at)
        for (int k = 0; k < kTogether; ++k) sums[at][k] += w[b] * row[static_cast<long>(a) * wide + k];
  }
  for (std::size_t at = 0; at < kSquareWeights; ++at)
    for (int k = 0; k < kTogether; ++k) out[at * kTogether + static_cast<std::size_t>(k)] = sums[at][k];
}

}  // namespace debulk
