#pragma once

namespace debulk {

// A figure and the least and most it may be: over the certified solutions from several starts, or within its uncertainty.
struct Spread {
  double low = 0.0;
  double high = 0.0;
};

// What the laid nets of one pocket tell (held_excess() of the net and of that at half the spacing).
struct ExcessLengths {
  double at_spacing = 0.0;  // mm
  double at_half = 0.0;     // mm, at half the spacing; the rest is of that net
  double half_spacing = 0.0;
  int segments = 0;
  double noise_gain = 0.0;
  double noise = 0.0;  // mm, standard deviation of a node's height
};

// The ridge that a pocket's excess length makes, with what is not known about it (docs/verdicts.md).
struct ExcessRidge {
  double excess = 0.0;         // mm, extrapolated to spacing 0, the noise's bias removed
  double noise_bias = 0.0;     // mm, false length that the noise has added to it
  double height = 0.0;         // mm, by the ridge formula; 0 where it stays within the consolidated ply
  double noise = 0.0;          // mm, standard deviation of the height from scan to scan
  double spacing_error = 0.0;  // mm, by which the extrapolation has changed the height, or all that the spacings differ by
  double uncertainty = 0.0;    // mm: two standard deviations and the spacing's error, or the margin, whichever is more
  Spread range;                // mm, of the height
};

// Chords miss a share of the excess that falls with the square of the spacing, so that the difference of two spacings tells
// it: e(half) + (e(half) - e(spacing)) / 3 (Richardson). White noise of standard deviation s in the heights of nodes d apart adds
// s^2 / d a segment, the fibre's length times s^2 / d^2, which is taken off. Where the two differ by as much as the finer one
// itself, the range spans at least from the one to the other. `margin`: mm, the least uncertainty.
ExcessRidge ridge_by_excess(const ExcessLengths& lengths, double thickness, double bulk_factor, double margin);

}  // namespace debulk
