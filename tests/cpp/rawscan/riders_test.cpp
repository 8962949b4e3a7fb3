// A narrow bump on a pocket is found in the points that its filtered heights do not show; noise, flying points and highlights are none.

#include "debulk/rawscan/riders.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

namespace debulk {
namespace {

using Shape = std::function<double(double x, double y)>;
const double kPi = std::acos(-1.0);
constexpr double kPitch = 0.8;  // mm
constexpr int kSide = 150;      // points

struct Sloping : Surface {
  SurfaceSample sample(const Eigen::Vector2d& xy) const override {
    SurfaceSample s;
    s.gradient = {0.3, -0.1};
    s.height = 7 + s.gradient.dot(xy);
    return s;
  }
};

double wide(double x, double y) {
  return 0.3 + 6 * std::exp(-(x * x + y * y) / 1800);
}

Shape bell(double x0, double y0, double w, double h) {
  return [=](double x, double y) {
    const double r = std::hypot(x - x0, y - y0) / w;
    return r < 0.5 ? h * std::pow(std::cos(kPi * r), 2) : 0.0;
  };
}

// Every point of a square; its middle, 100 mm wide, is the foot.
struct Scene {
  FootMap feet;
  std::vector<float> points;

  // kept: the share of the rider that the filters have left in the heights.
  explicit Scene(const Shape& rider, double noise = 0.02, double kept = 0) {
    feet.heights = Grid<float>(221, 221, {-55, -55}, 0.5);
    feet.labels = Grid<std::int32_t>(221, 221, {-55, -55}, 0.5);
    for (int j = 0; j < 221; ++j)
      for (int i = 0; i < 221; ++i) {
        const Eigen::Vector2d xy = feet.heights.position(i, j);
        feet.heights.at(i, j) = static_cast<float>(wide(xy.x(), xy.y()) + kept * rider(xy.x(), xy.y()));
        feet.labels.at(i, j) = xy.norm() < 50;
      }
    feet.feet.emplace_back();
    feet.feet[0].label = 1;
    std::mt19937 random(5);
    std::normal_distribution<double> off(0.0, noise);
    for (int j = 0; j < kSide; ++j)
      for (int i = 0; i < kSide; ++i) {
        const double x = kPitch * (i - kSide / 2), y = kPitch * (j - kSide / 2);
        const double z = Sloping().height({x, y}) + wide(x, y) + rider(x, y) + off(random);
        for (const double c : {x, y, z}) points.push_back(static_cast<float>(c));
      }
  }
  float& z(int i, int j) { return points[3 * static_cast<std::size_t>(j * kSide + i) + 2]; }
  CloudView view() const { return {points.data(), kSide, kSide}; }
  std::vector<Rider> found(const Stop& stop = Stop()) const { return riders(view(), kPitch, feet, feet.feet[0], Sloping(), {}, stop); }
};

TEST(Riders, AreFoundWhereTheyStandWithTheirHeightAndWidth) {
  for (const double kept : {0.0, 0.4, 0.6})  // what they keep of it takes nothing from its height
    for (const double w : {7.0, 9.0, 12.0})
      for (const double h : {1.5, 3.0}) {
        SCOPED_TRACE(testing::Message() << w << " mm wide, " << h << " mm high, kept " << kept);
        const auto found = Scene(bell(16, -23.2, w, h), 0.02, kept).found();
        ASSERT_EQ(found.size(), 1u);
        EXPECT_LT((found[0].top - Eigen::Vector2d(16, -23.2)).norm(), kPitch);
        EXPECT_NEAR(found[0].height, h, 0.15 * h);  // of the highest point but one, a pitch beside the top
        EXPECT_LE(found[0].height, h + 0.1);
        EXPECT_NEAR(found[0].wide, w, 2 * kPitch);
      }
}

TEST(Riders, ComeHighestFirstAndApart) {
  const Shape one = bell(20, 0, 8, 1.5), other = bell(-20, 10, 8, 3);
  const auto found = Scene([&](double x, double y) { return one(x, y) + other(x, y); }).found();
  ASSERT_EQ(found.size(), 2u);
  EXPECT_NEAR(found[0].top.x(), -20, kPitch);
  EXPECT_NEAR(found[1].top.x(), 20, kPitch);
}

TEST(Riders, AreNotNoiseFlyingPointsHighlightsOrBesideTheFoot) {
  const Shape none = [](double, double) { return 0.0; };
  for (const double noise : {0.02, 0.1, 0.5}) EXPECT_TRUE(Scene(none, noise).found().empty()) << noise;
  EXPECT_TRUE(Scene(bell(53, 0, 7, 3)).found().empty());
  Scene wild(none);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> share(0, 1);
  std::normal_distribution<double> off(0, 2);
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i) {
      if (share(random) < 5e-3) wild.z(i, j) += static_cast<float>(6 * share(random));
      if (std::hypot(i - 75, j - 60) < 12) wild.z(i, j) += static_cast<float>(off(random));  // a highlight
    }
  EXPECT_TRUE(wild.found().empty());
}

TEST(Riders, PassWhatIsNotKnown) {
  const float unknown = std::numeric_limits<float>::quiet_NaN();
  Scene scene(bell(16, -23.2, 9, 2));
  for (int i = 0; i < kSide; ++i) scene.z(i, 75) = unknown;
  EXPECT_EQ(scene.found().size(), 1u);
  std::fill(scene.points.begin(), scene.points.end(), unknown);
  EXPECT_TRUE(scene.found().empty());
  Scene lost(bell(16, -23.2, 9, 2));
  std::fill(lost.feet.heights.values.begin(), lost.feet.heights.values.end(), unknown);
  EXPECT_TRUE(lost.found().empty());
  EXPECT_TRUE(riders(CloudView(), kPitch, lost.feet, lost.feet.feet[0], Sloping()).empty());
}

TEST(Riders, EndWithTheStop) {
  const Stop stop;
  stop.cancel();
  EXPECT_THROW(Scene(bell(16, -23.2, 9, 2)).found(stop), Stopped);
}

}  // namespace
}  // namespace debulk
