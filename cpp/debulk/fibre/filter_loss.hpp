#pragma once

namespace debulk {

// An excess length at three levels of trust: what is surely there, the best estimate, and what may be there, mm.
struct ExcessRange {
  double low = 0.0;
  double mid = 0.0;
  double high = 0.0;
};

// Returns what an excess was before the filters, from its values after two of them. A filter with the variance v along x
// and along y leaves a Gaussian bump of the variance w the share (w / (w + v))^p of its excess: p = 5/2 for a round bump
// (its height falls by w / (w + v), and so do its slopes, which count squared), p = 3/2 for a long one across its
// length. Two filters determine w. `fine` and `coarse` are the values, with the noise's share taken out, after filters
// of the variances `fine_blur` < `coarse_blur`. The low end is `fine` itself, because filters only take away; the middle
// belongs to a round bump; the high end to a long one, which loses more of what it has for the same two values. All
// three are `fine` if it is not above `coarse`. No bump is taken to be narrower than `least`, its variance in mm2: what is
// narrower is looked for in the raw scan.
ExcessRange before_filters(double fine, double coarse, double fine_blur, double coarse_blur, double least);

}  // namespace debulk
