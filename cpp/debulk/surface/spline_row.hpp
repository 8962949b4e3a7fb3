#pragma once

namespace debulk {

// Cubic B-splines along a row: for each of `count` places u, in spacings from the first of n heights, 0 <= u <= n - 1, the sums over the
// four splines that are not zero there, of their slopes times `value` and of their values times `slope`. value[0] and slope[0] are of the
// first spline that is not zero at place `from`.
void spline_row(const double* u, int count, int n, int from, const double* value, const double* slope, double* by_slope, double* by_value);

}  // namespace debulk
