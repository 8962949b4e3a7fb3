#pragma once

namespace debulk {

// What the excess length of a pocket's fibres allows before anything is solved (docs/model.md, sections 5 and 6). An inextensible fibre
// held at both ends cannot put more into a ridge than it has to spare, and may put less: it can share it among ridges.
struct RidgeBounds {
  double least = 0.0;      // mm, always 0
  double geometric = 0.0;  // mm, by the ridge formula, 2 t wide; 0 where it stays within the consolidated ply: no ridge
  double elastic = 0.0;    // mm, by an elastic fold, which is wider and higher; never below `geometric`
};

// `excess_length` in mm (nothing below 0), the largest of any fibre: ridge/mold_length.hpp. `natural_length` as below.
RidgeBounds excess_bounds(double excess_length, double thickness, double bulk_factor, double natural_length);

// By the ridge formula, mm; 0 where it stays within the consolidated ply, t / beta: no ridge.
double ridge_by_formula(double excess_length, double thickness, double bulk_factor);

// (c / P)^(1/3) with c = E t^3 / 12 per unit width: the length that bending and pressure make between them, mm (MPa, mm).
double natural_length(double modulus, double thickness, double pressure);

// Height of an elastic fold on a flat, frictionless floor under a dead load, as excess / natural length goes to 0:
// h / l = 1.3256 (dL / l)^(4/7). Exact values lie below (by 3 % at dL = l / 2, 11 % at 2 l), so it is an upper bound.
double elastic_fold_height(double excess_length, double natural_length);

}  // namespace debulk
