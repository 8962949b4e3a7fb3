#include "debulk/ridge/excess_crest.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "debulk/core/error.hpp"
#include "debulk/net/fibre_net.hpp"
#include "test_nets.hpp"

namespace debulk {
namespace {

using Eigen::Vector2d;

const double kPi = std::acos(-1.0);

// A smooth hill on the plane z = 0, as wide as a along the direction `turn` and as b across, 0 beyond.
class Hill : public Surface {
 public:
  Hill(double height, double a, double b, double turn) : height_(height), a_(a), b_(b), turn_(turn) {}
  SurfaceSample sample(const Vector2d& p) const override {
    const double step = 1e-4;
    SurfaceSample s;
    s.height = height(p);
    const auto at = [&](double dx, double dy) { return height(p + step * Vector2d(dx, dy)); };
    s.gradient = Vector2d(at(1, 0) - at(-1, 0), at(0, 1) - at(0, -1)) / (2 * step);
    const double xy = (at(1, 1) - at(1, -1) - at(-1, 1) + at(-1, -1)) / 4;
    s.hessian << at(1, 0) - 2 * s.height + at(-1, 0), xy, xy, at(0, 1) - 2 * s.height + at(0, -1);
    s.hessian /= step * step;
    return s;
  }
  double height(const Vector2d& p) const override {
    const double u = (std::cos(turn_) * p.x() + std::sin(turn_) * p.y()) / a_, v = (std::cos(turn_) * p.y() - std::sin(turn_) * p.x()) / b_;
    const double r = std::min(1.0, u * u + v * v);
    return height_ * std::pow(1 - r, 3);
  }
  std::vector<Vector2d> outline() const {
    std::vector<Vector2d> out;
    for (int k = 0; k < 90; ++k) {
      const double t = 2 * kPi * k / 90, u = a_ * std::cos(t), v = b_ * std::sin(t);
      out.emplace_back(std::cos(turn_) * u - std::sin(turn_) * v, std::sin(turn_) * u + std::cos(turn_) * v);
    }
    return out;
  }

 private:
  double height_, a_, b_, turn_;
};

Net laid_on(const Hill& hill, double height) {
  PocketShape shape;
  shape.angles = {0, kPi / 2};
  shape.outline = hill.outline();
  FibreNetOptions options;
  options.spacing = 6.0;
  const PocketNet out = fibre_net(hill, test::Plane(), shape, options);
  EXPECT_TRUE(out.held_all_round()) << height;
  return out.net;
}

TEST(ExcessCrest, RunsAlongALongHillAcrossItsShortFibres) {
  const std::optional<ExcessCrest> crest = excess_crest(laid_on({5, 60, 20, 0}, 5), test::Plane());
  ASSERT_TRUE(crest.has_value());
  ASSERT_GT(crest->line.size(), 5u);
  const Vector2d way = crest->line.back() - crest->line.front();
  EXPECT_GT(std::abs(way.x()), 30);
  // The few fibres along the hill have some to spare, too, and turn it a little.
  EXPECT_LT(std::abs(way.y()), 0.4 * std::abs(way.x()));
}

TEST(ExcessCrest, TakesTheDiagonalOfTheHill) {
  for (const double sign : {1.0, -1.0}) {
    const Net net = laid_on({6, 55, 25, sign * kPi / 4}, 6);
    const std::optional<ExcessCrest> crest = excess_crest(net, test::Plane());
    ASSERT_TRUE(crest.has_value());
    EXPECT_TRUE(crest->mirrored.empty());
    const Vector2d way = crest->line.back() - crest->line.front();
    EXPECT_GT(way.x() * way.y() * sign, 0);
    EXPECT_LT(net.nodes[static_cast<std::size_t>(crest->peak)].head<2>().norm(), 8.0);
  }
}

TEST(ExcessCrest, OfARoundHillMayRunAlongEitherDiagonal) {
  const std::optional<ExcessCrest> crest = excess_crest(laid_on({6, 35, 35, 0}, 6), test::Plane());
  ASSERT_TRUE(crest.has_value());
  ASSERT_EQ(crest->mirrored.size(), crest->line.size());
  const Vector2d one = crest->line.back() - crest->line.front(), other = crest->mirrored.back() - crest->mirrored.front();
  EXPECT_NEAR(std::abs(one.normalized().dot(other.normalized())), 0.0, 0.1);
  EXPECT_NEAR(one.norm(), other.norm(), 0.05 * one.norm());
}

TEST(ExcessCrest, IsNoneWhereNothingIsToSpare) {
  EXPECT_FALSE(excess_crest(laid_on({0.0, 35, 35, 0}, 0), test::Plane()).has_value());
  Net bare = laid_on({6, 35, 35, 0}, 6);
  bare.lattice.clear();
  EXPECT_THROW(excess_crest(bare, test::Plane()), InputError);
}

}  // namespace
}  // namespace debulk
