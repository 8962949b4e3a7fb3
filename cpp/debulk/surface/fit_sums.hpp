#pragma once

#include <cstddef>

namespace debulk {

// The sums of the local fits in fit_reference.cpp, for several rows or nodes at once.
constexpr int kTogether = 8;
constexpr std::size_t kSums = 4, kSquareSums = 7, kWeights = 5, kSquareWeights = 15;

// Puts kTogether rows of `count` >= 4 heights side by side: the heights, 0 for a missing one; and 1 where a height is
// missing, else 0. Returns whether any is.
bool rows_together(const float* const* rows, int count, double* columns, double* missing);

// For kTogether rows whose heights z stand side by side, with `columns` at the middle of a window: the sums of w z,
// w x z, w x² z and w z² over 2 reach + 1 columns. weights: w x^a, five for each column, at the middle and to the right
// of it; w is even, so that the heights to the left and right are taken in pairs.
void row_sums(const double* columns, int reach, const double* weights, double* out);

// The same for the sums of w x^a, a = 0 ... 4, over the heights that are missing.
void missing_sums(const double* missing, int reach, const double* weights, double* out);

// For kTogether neighbouring nodes: the sums over `count` rows of y^b w times row_sums' first three, b = 0 ... 2, as far
// as they are of second order (for each b all of x), and of w times the last. A row's sums stand together, each for all
// nodes; weights: five for each row.
void window_sums(const double* rows, int count, const double* weights, double* out);

// Takes from the sums of y^b w x^a over whole windows, a + b <= 4, for each a all b, what is missing in `count` rows of
// the window. row_of: their places among the window's rows, to which `weights` belong, counted from `low`.
void take_missing(const double* rows, const int* row_of, int low, int count, const double* weights, double* out);

}  // namespace debulk
