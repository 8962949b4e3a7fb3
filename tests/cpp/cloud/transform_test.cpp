#include "debulk/cloud/transform.hpp"

#include <gtest/gtest.h>

#include <string>

#include <Eigen/Geometry>

#include "clouds.hpp"
#include "debulk/core/error.hpp"

namespace debulk {
namespace {

using namespace testing;

Eigen::Matrix4d pose() {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.rotate(Eigen::AngleAxisd(2.9, Eigen::Vector3d(1, 0.2, -0.1).normalized()));
  motion.pretranslate(Eigen::Vector3d(100, -20, 2400));
  return motion.matrix();
}

std::string complaint(const Eigen::Matrix4d& matrix) {
  try {
    const Cloud cloud = sheet(2, 2, 1);
    transform(cloud.view(), matrix);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Transform, MovesEveryPointAndKeepsTheMissingMissing) {
  Cloud cloud = sheet(40, 30, 2);
  cloud.point(3, 4)[1] = std::numeric_limits<float>::infinity();
  const Eigen::Matrix4d matrix = pose();
  const std::vector<float> moved = transform(cloud.view(), matrix, 2);
  EXPECT_TRUE(std::isnan(moved[3 * (4 * 40 + 3)]));
  for (std::size_t i = 0; i < cloud.view().size(); ++i) {
    const float* p = cloud.view().point(i);
    if (!cloud.view().seen(i)) {
      for (std::size_t a = 0; a < 3; ++a) EXPECT_TRUE(std::isnan(moved[3 * i + a]));
      continue;
    }
    const Eigen::Vector4d q = matrix * Eigen::Vector4d(p[0], p[1], p[2], 1);
    for (int a = 0; a < 3; ++a) EXPECT_EQ(moved[3 * i + static_cast<std::size_t>(a)], static_cast<float>(q[a]));
  }
}

TEST(Transform, MovesWhatIsKeptInPlace) {
  Cloud cloud = sheet(40, 30, 2);
  cloud.point(3, 4)[1] = nan;
  const std::vector<float> moved = transform(cloud.view(), pose(), 2);
  std::vector<std::uint8_t> keep(cloud.view().size(), 1);
  for (std::size_t i = 0; i < keep.size(); i += 7) keep[i] = 0;
  const std::size_t count = cloud.view().size();
  move_kept(cloud.point(0, 0), cloud.point(0, 0), keep.data(), count, pose(), 3);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t a = 0; a < 3; ++a)
      if (keep[i] != 0 && !std::isnan(moved[3 * i])) {
        EXPECT_EQ(cloud.view().point(i)[a], moved[3 * i + a]);
      } else {
        EXPECT_TRUE(std::isnan(cloud.view().point(i)[a]));
      }
}

TEST(Transform, RefusesWhatIsNotRigid) {
  EXPECT_EQ(complaint(pose()), "");
  Eigen::Matrix4d scaled = pose(), transposed = pose().transpose(), mirror = pose(), broken = pose();
  scaled.topLeftCorner<3, 3>() *= 1.001;
  mirror.col(0) *= -1;
  broken(1, 3) = nan;
  EXPECT_NE(complaint(scaled).find("orthonormal"), std::string::npos);
  EXPECT_NE(complaint(transposed).find("bottom row"), std::string::npos);
  EXPECT_NE(complaint(mirror).find("mirror"), std::string::npos);
  EXPECT_NE(complaint(broken).find("finite"), std::string::npos);
}

TEST(Bounds, AreThoseOfThePointsThatWereSeen) {
  for (const int width : {1, 15, 16, 37, 300}) {
    Cloud cloud = sheet(width, 3, 7);
    cloud.point(width - 1, 2)[1] = 1e9f, cloud.point(width - 1, 2)[0] = nan;
    const CloudBounds box = bounds(cloud.view(), 2);
    Eigen::Vector3d low = Eigen::Vector3d::Constant(1e30), high = -low;
    long seen = 0;
    for (std::size_t k = 0; k < cloud.view().size(); ++k) {
      if (!cloud.view().seen(k)) continue;
      const Eigen::Vector3d p = Eigen::Map<const Eigen::Vector3f>(cloud.view().point(k)).cast<double>();
      low = low.cwiseMin(p), high = high.cwiseMax(p), ++seen;
    }
    EXPECT_EQ(box.seen, seen);
    EXPECT_EQ(box.low, low);
    EXPECT_EQ(box.high, high);
  }
  EXPECT_EQ(bounds(CloudView{}).seen, 0);
}

}  // namespace
}  // namespace debulk
