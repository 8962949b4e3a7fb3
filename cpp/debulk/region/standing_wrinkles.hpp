#pragma once

#include <memory>
#include <vector>

#include "debulk/pocket/polygon.hpp"
#include "debulk/region/crossings.hpp"
#include "debulk/region/narrow_bumps.hpp"
#include "debulk/surface/reference.hpp"

namespace debulk {

struct WrinkleOptions {
  double pairs_mm = 14.0;      // between pairs of lines
  double side_mm = 10.0;       // from a point to those on both sides that it must stand out from
  double stands_out_mm = 1.0;  // above both sides, and above the reference
  double highest_mm = 25.0;    // what stands out by more is the edge of something else
  double widest_mm = 8.0;      // at half its height; what is wider survives the filters
  int links = 4;               // pairs of lines that a wrinkle crosses at least: about 40 mm
  double contrast = 0.6;       // share of the height above the reference by which it stands out from both sides
  double solid_share = 0.7;    // of the lines between the pairs in which something stands up on the way
  double sunk_share = 0.2;     // of them in which something lies below the reference, at most
  long most = 20000;           // crossings on the ply: more of them are no wrinkles but a spoiled scan
};

struct StandingWrinkle {
  std::vector<Eigen::Vector2d> along;  // points on its crest, mold XY, mm
  double height = 0;                   // above the reference, mm
  double width = 0;                    // at half its height, mm
};

struct StandingWrinkles {
  std::vector<StandingWrinkle> wrinkles;
  bool gave_up = false;  // more crossings than options.most, along rows or columns: nothing was looked for there
};

// Looks for wrinkles that stand already, narrow and long, which the filters take for noise: in the image before any filter,
// along pairs of adjacent rows and columns some millimetres apart. A chain of crossings is a wrinkle only where the pixels
// between its pairs stand up as well. In a highlight, depths are wild: as many points lie below the reference as above.
class WrinkleFinder {
 public:
  // seen: the heights that the reference was fitted to, NaN where nothing is known. ply_outline: empty where it is not known.
  WrinkleFinder(std::shared_ptr<const Reference> reference, const Grid<float>& seen, const Eigen::Matrix4d& mold_from_scanner,
                const Polygon& ply_outline, int threads = 0);

  // pitch: mm from pixel to pixel. A scan that is written to meanwhile gives a wrong result, and no other harm. Throws Stopped.
  StandingWrinkles find(const CloudView& scan, const std::uint8_t* masked, double pitch, const WrinkleOptions& options = WrinkleOptions(),
                        const Stop& stop = Stop()) const;

  // Looks for bumps that are narrow every way, or too short for a wrinkle: the filters take these for noise, too. As above.
  NarrowBumps find_bumps(const CloudView& scan, const std::uint8_t* masked, double pitch,
                         const NarrowBumpOptions& options = NarrowBumpOptions(), const Stop& stop = Stop()) const;

 private:
  struct Search;
  struct BumpSearch;

  Eigen::Vector3d moved(const float* point) const;
  std::uint8_t known(const Eigen::Vector3d& point) const;
  double above(const Eigen::Vector3d& point) const;  // the reference; NaN where it is not known

  std::shared_ptr<const Reference> reference_;
  Eigen::Matrix4d pose_;
  Grid<std::uint8_t> known_;  // 1: the reference is known there; 2: on the ply, too
  int threads_;
};

}  // namespace debulk
