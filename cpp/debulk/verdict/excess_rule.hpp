#pragma once

namespace debulk {

// The least and the greatest value that a figure may have: over the certified solutions from several starts, or within
// its uncertainty.
struct Spread {
  double low = 0.0;
  double high = 0.0;
};

// The excess lengths of the laid nets of one pocket: held_excess() of the net and of the net at half the spacing.
struct ExcessLengths {
  double at_spacing = 0.0;  // mm
  double at_half = 0.0;     // mm, at half the spacing; the members below are those of that net
  double half_spacing = 0.0;
  int segments = 0;
  double noise_gain = 0.0;
  double noise = 0.0;  // mm, standard deviation of a node's height
};

// The ridge that a pocket's excess length makes, with its uncertainty (docs/verdicts.md).
struct ExcessRidge {
  double excess = 0.0;         // mm, extrapolated to spacing 0, with the bias of the noise removed
  double noise_bias = 0.0;     // mm, false length that the noise had added to it
  double height = 0.0;         // mm, by the ridge formula; 0 if it is within the consolidated ply
  double noise = 0.0;          // mm, standard deviation of the height from scan to scan
  double spacing_error = 0.0;  // mm, change of the height by the extrapolation, or the whole difference of the two spacings
  double uncertainty = 0.0;    // mm, two standard deviations and the spacing's error combined, or the margin if that is more
  Spread range;                // mm, of the height
};

// Returns the ridge that the excess length makes. Chords miss a share of the excess that falls with the square of the
// spacing, so it is determined from two spacings: e(half) + (e(half) - e(spacing)) / 3 (Richardson). White noise of
// standard deviation s in the heights of nodes d apart adds s^2 / d per segment, that is, the fibre's length times
// s^2 / d^2; this is subtracted. If the two values differ by as much as the finer one itself, the range extends at
// least from the one to the other. `margin`: the least uncertainty, mm. Throws InputError for arguments that are not
// valid.
ExcessRidge ridge_by_excess(const ExcessLengths& lengths, double thickness, double bulk_factor, double margin);

}  // namespace debulk
