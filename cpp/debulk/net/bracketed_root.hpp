#pragma once

#include <algorithm>
#include <cmath>

namespace debulk {

// Finds a root of f in [a, b], where fa = f(a) and fb = f(b) have opposite signs (or one is 0), by false position with
// the Illinois rule; every eighth step is a bisection. It ends when |f| <= tolerance or when the bracket cannot shrink,
// and returns the point with the smallest |f| seen.
template <class Function>
double bracketed_root(const Function& f, double a, double fa, double b, double fb, double tolerance) {
  if (fa == 0) return a;
  double kept = 0;  // the end that the last step kept: -1 = a, +1 = b
  double best = std::abs(fa) < std::abs(fb) ? a : b, best_value = std::min(std::abs(fa), std::abs(fb));
  for (int step = 0; step < 100 && best_value > tolerance; ++step) {
    double x = (a * fb - b * fa) / (fb - fa);
    const double low = std::min(a, b), high = std::max(a, b);
    if (!(x > low && x < high) || step % 8 == 7) x = 0.5 * (a + b);
    if (x == a || x == b) break;
    const double fx = f(x);
    if (std::abs(fx) < best_value) best = x, best_value = std::abs(fx);
    if ((fx > 0) == (fb > 0)) {
      b = x, fb = fx;
      if (kept == -1) fa *= 0.5;
      kept = -1;
    } else {
      a = x, fa = fx;
      if (kept == 1) fb *= 0.5;
      kept = 1;
    }
  }
  return best;
}

}  // namespace debulk
