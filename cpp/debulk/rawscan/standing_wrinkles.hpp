#pragma once

#include <memory>
#include <vector>

#include "debulk/pocket/polygon.hpp"
#include "debulk/rawscan/crossings.hpp"
#include "debulk/rawscan/narrow_bumps.hpp"
#include "debulk/surface/reference.hpp"

namespace debulk {

struct WrinkleOptions {
  double pairs_mm = 14.0;      // distance of the pairs of lines
  double side_mm = 10.0;       // distance from a point to the two points beside it that it must stand out from
  double stands_out_mm = 1.0;  // height above both sides, and above the reference
  double highest_mm = 25.0;    // a point that stands out by more is the edge of another object
  double widest_mm = 8.0;      // width at half height; wider wrinkles survive the filters
  int links = 4;               // least number of pairs of lines that a wrinkle crosses: about 40 mm
  double contrast = 0.6;       // least share of its height above the reference by which a wrinkle stands out from both sides
  double solid_share = 0.7;    // least share of the lines between the pairs in which the wrinkle stands out
  double sunk_share = 0.2;     // largest share of these lines in which a point near the crest lies deep below both sides
  long most = 20000;           // most crossings on the ply: more of them are not wrinkles but a spoiled scan
};

struct StandingWrinkle {
  std::vector<Eigen::Vector2d> along;  // points on its crest, mold XY, mm
  double height = 0;                   // above the reference, mm
  double width = 0;                    // at half its height, mm
};

struct StandingWrinkles {
  std::vector<StandingWrinkle> wrinkles;
  bool gave_up = false;  // more crossings than options.most along rows or columns, so no wrinkles were looked for there
};

// Finds narrow, long wrinkles that are already in the draped ply and that the filters take for noise. It searches the
// image before any filter, along pairs of adjacent rows and columns some millimetres apart. A chain of crossings is a
// wrinkle only where the pixels between its pairs stand up as well. In a highlight, the depths are erratic: as many
// points lie below the reference as above.
class WrinkleFinder {
 public:
  // seen: the heights that the reference was fitted to, NaN where they are not known. ply_outline: empty if it is not
  // known.
  WrinkleFinder(std::shared_ptr<const Reference> reference, const Grid<float>& seen, const Eigen::Matrix4d& mold_from_scanner,
                const Polygon& ply_outline, int threads = 0);

  // pitch: mm from pixel to pixel. If the scan is written to meanwhile, the result is wrong, but it does no other harm.
  // Throws Stopped.
  StandingWrinkles find(const CloudView& scan, const std::uint8_t* masked, double pitch, const WrinkleOptions& options = WrinkleOptions(),
                        const Stop& stop = Stop()) const;

  // Finds bumps that are narrow in every direction, or too short for a wrinkle: the filters take these for noise, too.
  // Parameters and exceptions are those of find().
  NarrowBumps find_bumps(const CloudView& scan, const std::uint8_t* masked, double pitch,
                         const NarrowBumpOptions& options = NarrowBumpOptions(), const Stop& stop = Stop()) const;

 private:
  struct Search;
  struct BumpSearch;

  Eigen::Vector3d moved(const float* point) const;
  std::uint8_t known(const Eigen::Vector3d& point) const;
  double above(const Eigen::Vector3d& point) const;  // height above the reference, mm; NaN where the reference is not known

  std::shared_ptr<const Reference> reference_;
  Eigen::Matrix4d pose_;
  Grid<std::uint8_t> known_;  // 1: the reference is known there; 2: it is known and the point is on the ply
  int threads_;
};

}  // namespace debulk
