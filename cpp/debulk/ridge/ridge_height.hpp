#pragma once

namespace debulk {

// Height of a ridge above the mold, mm, from the excess ply length that it has to hold (paper, "Post-Processing the Results";
// docs/model.md, section 5). The cross-section is 2 t wide with a semicircular top of radius t; the rest of the ply lies on the mold:
//   L_base = (L_mold - 2 t) / 2,   h = (L_ply - 2 L_base - pi t) / 2 + t = (L_ply - L_mold) / 2 + (2 - pi / 2) t.
// It does not go to zero with the excess: at L_ply = L_mold it still says 0.43 t. post_process() clamps it from below.
double ridge_height_of_excess(double excess_length, double thickness);

// The same from both lengths, as the paper writes it. Throws InputError for lengths that leave no room for the ridge.
double ridge_height(double ply_length, double mold_length, double thickness);

}  // namespace debulk
