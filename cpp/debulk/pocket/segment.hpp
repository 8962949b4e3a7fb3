#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "debulk/core/grid.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/pocket/components.hpp"
#include "debulk/pocket/ply_mask.hpp"
#include "debulk/pocket/polygon.hpp"

namespace debulk {

// The defaults are those of the paper's table of segmentation settings.
struct SegmentOptions {
  double cut_height_mm = 2.0;          // a pocket is where ply minus reference is at least this
  double area_tol_mm2 = 200.0;         // least area inside the outline
  double peak_tol_mm = 1.25;           // least peak above the cut (above the reference, it would reject nothing)
  double edge_tol_mm = 0.0;            // an outline this near to the ply's touches the ply's edge; 0: two grid spacings
  double bridge_mm = 12.0;             // components of unknown heights up to this thickness are bridged; 0: none
  double smooth_mm = 0.0;              // window of the surface for measuring (smooth_outline.hpp); 0: heights as given
  double blur_mm2 = 0.0;               // variance along x and y that has blurred the heights; undone by the smoothing
  std::optional<Polygon> ply_outline;  // mold XY, mm; empty: unknown
  void check() const;
};

struct Pocket {
  int id = 0;         // from 1, largest area first
  Polygon outline;    // at the cut height, counter-clockwise, mold XY, mm
  double area = 0;    // inside the outline, mm2
  double volume = 0;  // integral of the height above the reference inside the outline, mm3
  double peak = 0;    // largest height above the reference, mm; with smooth_mm, of the smooth surface, as outline and volume
  Eigen::Vector2d peak_position = Eigen::Vector2d::Zero();
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
  Box box;
  bool touches_ply_edge = false;
  bool touches_unknown = false;  // the outline runs along unknown heights or the border of the grid: area and volume are lower bounds
  double measured_share = 0;     // share of its grid points that were measured rather than filled
};

// A component above the cut that is no pocket.
struct Dropped {
  enum class Reason : std::uint8_t { area, peak, area_and_peak };
  Reason reason = Reason::area;
  double area = 0;  // mm2
  double peak = 0;  // mm above the reference
  Eigen::Vector2d centroid = Eigen::Vector2d::Zero();
  bool touches_unknown = false;  // as in Pocket: area and peak are lower bounds
};

struct Segmentation {
  std::vector<Pocket> pockets;   // largest first; ties by the first grid point, row by row
  std::vector<Dropped> dropped;  // largest first
  int specks = 0;                // number dropped but not listed, because they are below a twentieth of area_tol_mm2
  Grid<std::int32_t> labels;     // 0: none, else the pocket's id
  Grid<float> heights;           // the input, unknown off the ply, bridged where that was allowed
  std::vector<Run> bridged;      // of these heights
  std::vector<Run> unmeasured;   // of the input: what was filled in, or is unknown
  SegmentOptions options;
  PlyMask ply;
};

// Finds the pockets in heights of the ply above the reference (mm, NaN = unknown). `measured`, if given, is nonzero
// where the height was measured rather than filled. Throws InputError and Stopped.
//
// Unknown heights: a component of them is bridged before the cut, by the least-bent surface (thin_plate.hpp), if it
// does not reach the grid's border, has no point further than half bridge_mm from a known height, and has a height
// above a quarter of the cut at its rim (pockets' feet count too). It may be a long strip: the scanner loses one along
// a raised edge of the ply. The slopes at the component's rim thus decide whether it hides a saddle between two
// pockets or the crest of one. A larger component does not count as a pocket: outlines close along it, and it joins
// nothing. But if a pocket surrounds it wholly, it is filled like any other hole.
//
// With smooth_mm, pockets are found in the same way, but measured on a smooth surface. That surface is fitted to the
// heights before a median, if these are given (and not empty), and otherwise to `heights`.
Segmentation segment(const Grid<float>& heights, const SegmentOptions& options, const Grid<std::uint8_t>* measured = nullptr,
                     const Grid<float>* before_median = nullptr, int threads = 0, const Stop& stop = Stop());

// The same for one map after another, in memory that is reused.
class Segmenter {
 public:
  // The result stays valid until the next call. threads, 0: as many as the process may use. Throws Stopped soon after
  // the stop is raised.
  const Segmentation& run(const Grid<float>& heights, const SegmentOptions& options, const Grid<std::uint8_t>* measured = nullptr,
                          const Grid<float>* before_median = nullptr, int threads = 0, const Stop& stop = Stop());
  Segmentation take() { return std::move(out_); }            // the last result; the next run allocates anew
  void reuse(Segmentation&& old) { out_ = std::move(old); }  // provides memory for the next result

 private:
  void prepare(const Grid<float>& given, const SegmentOptions& options);
  void scan(const Grid<float>& given, int threads, const Stop& stop);
  bool bridge_components(const Components& components, bool all_of_them, int threads, const Stop& stop);
  const std::vector<Run>& foreground(int threads, const Stop& stop);

  Segmentation out_;
  StripRuns unknown_, high_;
  RunFilling filling_;
  RunJoining unknown_components_, components_;
  std::vector<Run> within_, known_;
  std::vector<std::vector<double>> bridged_;
};

}  // namespace debulk
