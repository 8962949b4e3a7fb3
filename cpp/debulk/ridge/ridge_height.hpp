#pragma once

namespace debulk {

// Returns the height of a ridge above the mold, mm, from the excess length of ply that it holds (paper,
// "Post-Processing the Results"; docs/model.md, section 5). Its cross-section is 2 t wide with a semicircular top of
// radius t; the rest of the ply lies on the mold:
//   L_base = (L_mold - 2 t) / 2,   h = (L_ply - 2 L_base - pi t) / 2 + t = (L_ply - L_mold) / 2 + (2 - pi / 2) t.
// The formula does not go to zero with the excess: at L_ply = L_mold it gives 0.43 t. post_process() makes a ridge only
// if the result is more than the thickness of the consolidated ply.
double ridge_height_of_excess(double excess_length, double thickness);

// Returns the same from both lengths, as the paper writes it. Throws InputError for lengths that leave no room for the
// ridge.
double ridge_height(double ply_length, double mold_length, double thickness);

}  // namespace debulk
