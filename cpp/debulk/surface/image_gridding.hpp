#pragma once

#include <vector>

#include <Eigen/Core>

#include "debulk/cloud/pinhole_outliers.hpp"
#include "debulk/core/grid.hpp"
#include "debulk/core/simd.hpp"
#include "debulk/core/stop.hpp"
#include "debulk/surface/reference.hpp"

namespace debulk {

// A pinhole camera that looks at the mold: the size of its image, and its pose.
struct View {
  Pinhole camera;
  int width = 0, height = 0;                                        // pixels
  Eigen::Matrix4d mold_from_scanner = Eigen::Matrix4d::Identity();  // x_mold = T x_scanner, rigid

  Eigen::Matrix3d rotation() const { return mold_from_scanner.topLeftCorner<3, 3>(); }
  Eigen::Vector3d centre() const { return mold_from_scanner.topRightCorner<3, 1>(); }
};

// The reference along the view's rays. Let o be the camera's centre, D = R ((i - cx)/f, (j - cy)/f, 1) the ray in the
// mold's frame, and Z0 the depth at which it meets F. The point at depth Z stands above F, at its own x and y, by
//   h = (Z - Z0) (D_z - grad F . D_xy) + O((Z - Z0)² curvature),
// where the last term is 1e-3 mm for a pocket of 15 mm on a mold of 5 m radius. There are no rays and no heights
// outside F's grid.
RayBase ray_base(const Reference& reference, const View& view, int threads = 0);

// Converts heights in the image to heights on a grid of the mold's XY plane. This undoes the parallax without copying
// the image. The higher a node's surface point (x, y, F + h) stands, the farther its pixel is shifted. The pixel
// follows from h, which is looked up three times: in the tiles' mean heights, then at the pixel found from that, and
// finally, with a smooth kernel of 3 by 3 pixels, at the pixel found from that. Each time the error shrinks by the
// ply's slope times the ray's, which is below 0.1.
class ImageGridding {
 public:
  ImageGridding(const Reference& reference, const View& view, const Grid<float>& grid, int threads = 0);

  // Overwrites the grid's values. They are NaN where less than four tenths of the kernel were kept. Throws Stopped.
  void run(const PinholeOutliers& image, Grid<float>& grid, Isa isa = best_isa(), int threads = 0, const Stop& stop = Stop()) const;

  // The blur of the kernel, a quadratic B-spline, as a variance along x and along y: a quarter of a pixel squared, in
  // the image's middle.
  double blur_mm2() const { return blur_mm2_; }

 private:
  View view_;
  double blur_mm2_ = 0;
  int across_ = 0;                                  // stretches of 16 nodes, and one more
  std::vector<float> point_x_, point_y_, point_z_;  // (x, y, F) of every 16th node of a row, in the scanner's frame
};

}  // namespace debulk
