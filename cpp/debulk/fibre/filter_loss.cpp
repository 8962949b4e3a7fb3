#include "debulk/fibre/filter_loss.hpp"

#include <algorithm>
#include <cmath>

namespace debulk {
namespace {

constexpr double kLong = 1.5, kWide = 0.5;

// Solves fine / coarse = ((w + coarse_blur) / (w + fine_blur))^p for w, and returns fine ((w + fine_blur) / w)^p.
double unfiltered(double fine, double coarse, double fine_blur, double coarse_blur, double least, double p) {
  double w = least;
  if (coarse > 0) {
    const double ratio = std::pow(fine / coarse, 1 / p);
    w = std::max(least, (coarse_blur - ratio * fine_blur) / (ratio - 1));
  }
  return fine * std::pow(1 + fine_blur / w, p);
}

}  // namespace

ExcessRange before_filters(double fine, double coarse, double fine_blur, double coarse_blur, double least) {
  if (!(fine > coarse) || fine <= 0 || fine_blur <= 0) return {fine, fine, fine};
  const auto by = [&](double p) { return unfiltered(fine, coarse, fine_blur, coarse_blur, least, p); };
  const double round = by(kRound), low = coarse > 0 ? fine * std::pow(fine / coarse, fine_blur / (coarse_blur - fine_blur)) : fine;
  return {std::min(low, round), round, std::max({round, by(kLong), by(kWide)})};
}

}  // namespace debulk
