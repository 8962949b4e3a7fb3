#pragma once

#include <cstddef>

namespace debulk {

// The sums of the local fits in fit_reference.cpp, for several rows or nodes at once.
constexpr int kTogether = 8;
constexpr std::size_t kSums = 4, kSquareSums = 7, kWeights = 5, kSquareWeights = 15;

// Puts kTogether rows of `count` heights, which begin at these places, side by side: the heights, 0 for a missing one;
// 1 where a height is known, else 0; and how many are missing before each column, and in all.
void rows_together(const float* const* rows, int count, double* columns, double* known, int* missing);

// For kTogether rows whose heights z stand side by side, with `columns` at the middle of a window: the sums of w z,
// w x z, w x² z and w z² over 2 reach + 1 columns. weights: w, w x and w x² at the middle and to the right of it. The
// weights are even, so that the heights to the left and right are taken in pairs.
void row_sums(const double* columns, int reach, const double* weights, double* out);

// The same for rows of `count` columns of which some are missing (height 0, and known 0 instead of 1), from left to
// right; behind them the sums of w x^a, a = 0 ... 4, of what is known. weights: five for each column.
void incomplete_row_sums(const double* columns, const double* known, int count, const double* weights, double* out);

// For kTogether neighbouring nodes: the sums over `count` rows of y^b w times row_sums' first three, b = 0 ... 2, as far
// as they are of second order (for each b all of x), and of w times the last. The rows' sums stand kSums by kSums
// `wide` apart; weights: five for each row.
void window_sums(const double* rows, int wide, int count, const double* weights, double* out);

// For these nodes: the sums over the rows of y^b w times their sums of w x^a, a + b <= 4, for each b all a. The rows' sums
// stand kWeights by kWeights `wide` apart.
void window_weights(const double* rows, int wide, int count, const double* weights, double* out);

}  // namespace debulk
