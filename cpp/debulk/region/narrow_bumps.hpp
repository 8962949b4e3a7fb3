#pragma once

#include <vector>

#include <Eigen/Core>

namespace debulk {

struct NarrowBumpOptions {
  double rows_mm = 2.0;        // between the rows that are looked at; the lowest that matters shows in one of them
  double sample_mm = 1.0;      // along them, and between the points that a bump is measured with
  double side_mm = 6.0;        // from a point to those on both sides that it must stand out from
  double stands_out_mm = 0.6;  // above their middle, along the row or across the rows
  double highest_mm = 25.0;    // what stands out by more is the edge of something else
  double window_mm = 12.0;     // to each side of a bump, in which it must end
  double widest_mm = 6.0;      // at half its height; what is wider survives the filters
  double contrast = 0.6;       // share of the height above the reference by which it stands out from what is around it
  int fewest = 4;              // samples that stand higher than half its height: fewer are flying pixels
  double sunk_share = 0.05;    // of the samples near it that lie deep below, at most: in a highlight, half of them do
  double unseen_share = 0.3;   // of those that show nothing, at most
  long most = 20000;           // points on the ply that stand out: more of them are a spoiled scan
};

struct NarrowBump {
  Eigen::Vector2d top = Eigen::Vector2d::Zero();  // mold XY, mm
  double height = 0;                              // above what is around it, mm
  double width = 0, length = 0;                   // at half its height, mm: of an ellipse of its area
};

struct NarrowBumps {
  std::vector<NarrowBump> bumps;  // highest first
  bool gave_up = false;           // more points stood out than options.most: nothing was looked for
};

}  // namespace debulk
