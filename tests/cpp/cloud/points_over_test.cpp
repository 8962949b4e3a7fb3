#include "debulk/cloud/points_over.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "clouds.hpp"
#include "debulk/cloud/transform.hpp"

namespace debulk {
namespace {

using namespace testing;

constexpr float beyond = std::numeric_limits<float>::infinity();

// Three by two marks, 10 mm apart, the first of which lies at (100, 200).
const std::vector<std::uint8_t> some = {1, 0, 1, 1, 1, 0};
CellMarks marks(const std::vector<std::uint8_t>& values) {
  return {values.data(), 3, 2, {100, 200}, 10};
}

std::vector<std::uint8_t> on(const std::vector<float>& xyz, const std::vector<CellMarks>& which, double right = 1000) {
  const CloudView cloud{xyz.data(), static_cast<int>(xyz.size() / 3), 1};
  return points_over(cloud, nullptr, {-1000, -1000}, {right, 1000}, which, 2).on;
}

TEST(PointsOver, TheNearestMarkCounts) {
  const std::vector<float> xyz = {100, 200, 5, 106, 200, 5, 104, 200, 5, 124, 204, 5, 124, 206, 5, 95.1F, 214.9F, 5};
  EXPECT_EQ(on(xyz, {marks(some)}), (std::vector<std::uint8_t>{1, 0, 1, 1, 0, 1}));
  EXPECT_EQ(on(xyz, {}), (std::vector<std::uint8_t>{1, 1, 1, 1, 1, 1}));
}

TEST(PointsOver, AMarkHalfWayIsTheEvenOneAsInNumPy) {
  EXPECT_EQ(on({105, 200, 5, 115, 200, 5, 95, 200, 5}, {marks(some)}), (std::vector<std::uint8_t>{1, 1, 1}));
}

TEST(PointsOver, AllMarksHaveToBeSet) {
  const std::vector<std::uint8_t> others = {1, 1, 0, 0, 1, 1};
  EXPECT_EQ(on({100, 200, 5, 110, 200, 5, 120, 200, 5, 100, 210, 5, 110, 210, 5}, {marks(some), marks(others)}),
            (std::vector<std::uint8_t>{1, 0, 0, 0, 1}));
}

TEST(PointsOver, NothingLiesOffTheGridOffTheBoxOrWhereACoordinateIsMissing) {
  const std::vector<std::uint8_t> all(6, 1);
  const std::vector<float> xyz = {94,  200,    5, 126, 200, 5, 100, 194, 5, 100, 216, 5,   1e30F, 200, 5,
                                  100, -1e30F, 5, nan, 200, 5, 100, nan, 5, 100, 200, nan, 100,   200, beyond};
  EXPECT_EQ(on(xyz, {marks(all)}), std::vector<std::uint8_t>(10, 0));
  EXPECT_EQ(on({110, 200, 5, 110.01F, 200, 5}, {marks(all)}, 110.0), (std::vector<std::uint8_t>{1, 0}));
}

TEST(PointsOver, PointsAreMovedAsByTransform) {
  Cloud cloud = sheet(400, 90, 2);
  cloud.point(3, 4)[1] = nan;
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix(0, 3) = 1000;
  const std::vector<std::uint8_t> all(4, 1);
  const CellMarks wide{all.data(), 2, 2, {1000, 0}, 100};
  for (const int threads : {1, 2, 5}) {
    const PointsOver found = points_over(cloud.view(), &matrix, {-1e9, -1e9}, {1e9, 1e9}, {wide}, threads);
    const std::vector<float> moved = transform(cloud.view(), matrix);
    for (std::size_t k = 0; k < cloud.view().size(); ++k) {
      EXPECT_EQ(std::isnan(found.moved[3 * k]), std::isnan(moved[3 * k]));
      if (!std::isnan(moved[3 * k])) {
        EXPECT_EQ(found.moved[3 * k], moved[3 * k]);
        EXPECT_EQ(found.on[k] != 0, wide.at(moved[3 * k], moved[3 * k + 1]));
      } else {
        EXPECT_EQ(found.on[k], 0);
      }
    }
  }
}

}  // namespace
}  // namespace debulk
