#include "debulk/surface/fit_sums.hpp"

#include <cstring>

#include "debulk/core/simd.hpp"

namespace debulk {
namespace {

#define DEBULK_KERNEL "debulk/surface/fit_sums_kernel.inl"
#include "debulk/core/simd_dispatch.inl"

}  // namespace

bool rows_together(const float* const* rows, int count, double* columns, double* missing) {
  return DEBULK_ON(best_isa(), together(rows, count, columns, missing));
}

void row_sums(const double* columns, int reach, const double* weights, double* out) {
  return DEBULK_ON(best_isa(), along_rows(columns, reach, weights, out));
}

void missing_sums(const double* missing, int reach, const double* weights, double* out) {
  return DEBULK_ON(best_isa(), along_missing(missing, reach, weights, out));
}

void window_sums(const double* rows, int count, const double* weights, double* out) {
  return DEBULK_ON(best_isa(), over_rows(rows, count, weights, out));
}

void take_missing(const double* rows, const int* row_of, int low, int count, const double* weights, double* out) {
  return DEBULK_ON(best_isa(), missing_rows(rows, row_of, low, count, weights, out));
}

}  // namespace debulk
