// Cycle after cycle a RegionFront takes little memory anew.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "debulk/region/region_front.hpp"
#include "looking_down.hpp"
#include "support/taken_memory.hpp"

namespace debulk {
namespace {

constexpr int width = 1024, height = 640;

// The scan of a round hill of 10 mm.
std::vector<float> hill() {
  const View view = looking_down(width, height);
  std::vector<float> points;
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) {
      const double r = 0.5 * std::hypot(i - 500.0, j - 300.0), z = 500 - (r < 120 ? 5 * (1 + std::cos(std::acos(-1.0) * r / 120)) : 0);
      for (const double v : {view.camera.u(i) * z, view.camera.v(j) * z, z}) points.push_back(static_cast<float>(v));
    }
  return points;
}

// But for the search for feet, which takes and gives back what it needs.
TEST(RegionFront, TakesNoMemoryForTheSecondScan) {
  RegionOptions options;
  options.front.outliers = {4, 1.0, 2.0};
  options.front.spike = 0.5;
  options.feet.noise_mm = 0.05;
  const Eigen::Vector2d far = Eigen::Vector2d::Constant(1e9);
  RegionFront front(std::make_shared<Reference>(Grid<double>(161, 121, {-320, -240}, 4.0, 0.0)), -far, far, looking_down(width, height),
                    options, 2);
  const std::vector<float> points = hill();
  const CloudView scan{points.data(), width, height};
  long taken = bytes_taken;
  ASSERT_TRUE(front.run(scan, nullptr));
  const long first = bytes_taken - taken;
  ASSERT_TRUE(front.run(scan, nullptr));  // the threads may have changed places
  ASSERT_EQ(front.regions().size(), 1U);
  EXPECT_GT(front.regions()[0]->window.size(), 200000);

  taken = bytes_taken;
  find_feet(front.regions()[0]->segmentation, options.feet);
  const long feet = bytes_taken - taken;
  taken = bytes_taken;
  ASSERT_TRUE(front.run(scan, nullptr));
  EXPECT_LT(bytes_taken - taken - feet, 800000)
      << "runs, outlines, maps of cells; a map of heights would be more; the first took " << first << ", feet take " << feet;
}

}  // namespace
}  // namespace debulk
