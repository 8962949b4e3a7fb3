#pragma once

#include "debulk/core/nominal_ply.hpp"
#include "debulk/core/simd.hpp"

namespace debulk {

// How the excess of the fibre lines is read (docs/model.md, section 9).
struct FibreOptions {
  double thickness = kNominalThicknessMm;  // mm, of the ply: a scan sees its upper side
  double mold_tol = kNominalMoldTolMm;     // mm, a lower side this near lies on the mold
  double apart = 2.0;                      // mm, between neighbouring lines of a family
  double step = 1.0;                       // mm, between the points of a line
  double fine_mm = 2.0;                    // mm, side of the square of the finer mean, and at least three cells
  double blur_cells2 = 0.75;               // variance, in squares of the spacing, of the filters before the heights are given
  double draw = 21.0;                      // mm of ply lying flat over which one fold can draw more ply in: H / (mu P)
  double hold = 20.0;                      // mm of ply beyond an end, along the line, that hold this end by friction
  int edge_cells = 2;                      // cells along the ply's edge in which heights may be partly the mold's
  int threads = 0;                         // 0: as many as the process may use
  Isa isa = best_isa();

  void check() const;
};

}  // namespace debulk
