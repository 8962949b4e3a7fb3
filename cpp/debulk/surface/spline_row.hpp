#pragma once

namespace debulk {

// Cubic B-splines along a row, at each of `count` places u in spacings from the first of n heights, 0 <= u <= n - 1.
// Of the four splines that are not zero at a place, by_slope is the sum of their slopes times `value`, and by_value
// the sum of their values times `slope`. value[0] and slope[0] belong to the first spline that is not zero at place
// `from`.
void spline_row(const double* u, int count, int n, int from, const double* value, const double* slope, double* by_slope, double* by_value);

// The values of the four splines that are not zero at places as above, and the number of the first of them; where u is not
// between 0 and n - 1, both are anything. values[a * count + k] belongs to spline first[k] + a.
void spline_weights(const double* u, int count, int n, int* first, double* values);

// The weighted sum of four rows, added up in their order.
void weighted_rows(const double* const* rows, const double* weights, int count, double* out);

}  // namespace debulk
