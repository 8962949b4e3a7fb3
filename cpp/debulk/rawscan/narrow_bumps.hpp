#pragma once

#include <vector>

#include <Eigen/Core>

namespace debulk {

struct NarrowBumpOptions {
  double rows_mm = 2.0;        // distance of the rows that are searched; the lowest bump that matters shows in one of them
  double sample_mm = 1.0;      // distance of the samples along the rows, and of the points that a bump is measured with
  double side_mm = 6.0;        // distance from a point to the two points beside it that it must stand out from
  double stands_out_mm = 0.6;  // height above the mean of those two points, along the row or across the rows
  double highest_mm = 25.0;    // a point that stands out by more is the edge of another object
  double window_mm = 12.0;     // a bump must end within this distance on each side
  double widest_mm = 6.0;      // width at half height; wider bumps survive the filters
  double contrast = 0.6;       // least share of its height above the reference by which a bump stands out from its surroundings
  int fewest = 4;              // least number of samples above half the height: fewer are flying pixels
  double sunk_share = 0.05;    // largest share of the samples near it that lie deep below: in a highlight, half of them do
  double unseen_share = 0.3;   // largest share of the samples near it that were not seen
  long most = 20000;           // most points on the ply that may stand out: more of them mean a spoiled scan
};

struct NarrowBump {
  Eigen::Vector2d top = Eigen::Vector2d::Zero();  // mold XY, mm
  double height = 0;                              // above its surroundings, mm
  double width = 0, length = 0;                   // at half its height, mm: axes of an ellipse of the same area
};

struct NarrowBumps {
  std::vector<NarrowBump> bumps;  // highest first
  bool gave_up = false;           // more points stood out than options.most, so no bumps were looked for
};

}  // namespace debulk
