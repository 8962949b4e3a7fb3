#pragma once

namespace debulk {

constexpr double kRound = 2.5;  // the exponent p below of a round bump

// An excess length at three levels of trust: what is surely there, the best estimate, and what may be there, mm.
struct ExcessRange {
  double low = 0.0;
  double mid = 0.0;
  double high = 0.0;
};

// Returns what an excess was before the filters, from its values after two of them, `fine` and `coarse`, with the noise's
// share taken out, after filters of the variances `fine_blur` < `coarse_blur`. A filter with the variance v along x and
// along y leaves a bump of the variance w the share (1 + v/w)^-p of its excess: p = 5/2 for a round Gaussian bump (its
// height falls by w / (w + v), and so do its slopes, which count squared), p = 3/2 for a long one across its length, and
// p = 1/2 if its slopes have all wavelengths alike down to w: a steep flank, a bend at the rim, or a narrow bump on a wide
// one. Two filters determine w. The middle belongs to a round bump, and the high end to the worst of the three.
// The low end holds for every shape: what is left is the integral of exp(-v k^2) over the squares of the slopes by their
// wave number k, and the logarithm of such an integral is convex in v. So it rises from `fine` towards no filter at least
// as steeply as from `coarse` to `fine`. All three are `fine` if it is not above `coarse`. No bump is taken to be narrower
// than `least`, its variance in mm2: what is narrower is looked for in the raw scan.
ExcessRange before_filters(double fine, double coarse, double fine_blur, double coarse_blur, double least);

}  // namespace debulk
