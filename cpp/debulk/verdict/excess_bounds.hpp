#pragma once

namespace debulk {

// Bounds of the ridge height from the excess length of a pocket's fibres, known before anything is solved
// (docs/model.md, sections 5 and 6). An inextensible fibre held at both ends cannot put more than its excess length
// into a ridge. It may put less, because it can distribute the excess over several ridges.
struct RidgeBounds {
  double least = 0.0;      // mm, always 0
  double geometric = 0.0;  // mm, by the ridge formula, 2 t wide; 0 (no ridge) if it is within the consolidated ply
  double elastic = 0.0;    // mm, by an elastic fold, which is wider and higher; never below `geometric`
};

// `excess_length`: the largest of any fibre, mm (ridge/mold_length.hpp); a negative one counts as 0. `natural_length`:
// as below, mm. Throws InputError for arguments that are not valid.
RidgeBounds excess_bounds(double excess_length, double thickness, double bulk_factor, double natural_length);

// Returns the ridge height by the ridge formula, mm; 0 (no ridge) if it is within the consolidated ply, t / beta.
double ridge_by_formula(double excess_length, double thickness, double bulk_factor);

// Returns the natural length (c / P)^(1/3), mm, with c = E t^3 / 12 per unit of width: the length scale that follows
// from bending stiffness and pressure. Arguments are in MPa and mm.
double natural_length(double modulus, double thickness, double pressure);

// Returns the height of an elastic fold on a flat, frictionless floor under a dead load, in the limit of excess /
// natural length going to 0: h / l = 1.3256 (dL / l)^(4/7). Exact values are lower (by 3 % at dL = l / 2, by 11 % at
// 2 l), so it is an upper bound.
double elastic_fold_height(double excess_length, double natural_length);

}  // namespace debulk
