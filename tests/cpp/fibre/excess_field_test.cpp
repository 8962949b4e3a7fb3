// The excess of lines over exact shapes, against quadrature and closed forms.

#include "debulk/fibre/excess_field.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "support/shapes.hpp"

namespace debulk {
namespace {

using Shape = std::function<double(const Eigen::Vector2d&)>;
using test::Plane;
using test::Quadric;

const Polygon kPly{{-150, -150}, {150, -150}, {150, 150}, {-150, 150}};
const Box kBox{{-150, -150}, {150, 150}};
constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

Shape bell(double x, double y, double wide, double high) {
  return [=](const Eigen::Vector2d& xy) {
    const double r = (xy - Eigen::Vector2d(x, y)).norm() / wide;
    return r < 0.5 ? high * std::pow(std::cos(M_PI * r), 2) : 0.0;
  };
}

Shape sum(Shape a, Shape b) {
  return [a = std::move(a), b = std::move(b)](const Eigen::Vector2d& xy) { return a(xy) + b(xy); };
}

// Heights of the ply's upper side above the datum, whose lower side stands as the shape says.
Grid<float> heights_of(const Shape& gap, double spacing = 1.0, double noise = 0.0) {
  const int n = static_cast<int>(320 / spacing) + 1;
  Grid<float> out(n, n, {-160, -160}, spacing);
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0, 1);
  const FibreOptions options;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const Eigen::Vector2d xy = out.position(i, j);
      out.at(i, j) = static_cast<float>(options.thickness + gap(xy) + noise * normal(random));
    }
  return out;
}

// Excess of a straight line by quadrature.
double exact(const Shape& gap, const Surface& mold, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  const int n = 200000;
  double excess = 0;
  const Eigen::Vector2d way = (to - from) / n;
  double m = mold.height(from), g = gap(from);
  for (int k = 1; k <= n; ++k) {
    const Eigen::Vector2d xy = from + k * way;
    const double m1 = mold.height(xy), g1 = gap(xy), step = way.norm();
    excess += std::hypot(step, m1 - m + g1 - g) - std::hypot(step, m1 - m);
    m = m1, g = g1;
  }
  return excess;
}

// Options that add no blur of filters before, for exact heights.
FibreOptions sharp() {
  FibreOptions options;
  options.blur_cells2 = 0;
  options.apart = 1.0;
  return options;
}

ExcessField field_of(const Grid<float>& heights, const Surface& mold, const FibreOptions& options, double degrees = 0) {
  const double angle = degrees * M_PI / 180;
  return measure_excess(straight_lines({angle, angle + M_PI / 2}, kPly, kBox, options), heights, kPly, mold, true, options);
}

// The run with the largest excess, of one family or of both.
FibreRun worst(const ExcessField& field, int family = -1) {
  FibreRun out;
  for (const FibreRun& run : field.runs)
    if ((family < 0 || run.family == family) && run.excess.mid > out.excess.mid) out = run;
  return out;
}

TEST(ExcessField, OfABellIsThatOfQuadratureAtAnyAngle) {
  const Shape gap = bell(3.3, -7.7, 60, 6);
  const double want = exact(gap, Plane(), {-100, -7.7}, {100, -7.7});
  for (const double degrees : {0.0, 37.0, 90.0}) {
    const FibreRun run = worst(field_of(heights_of(gap), Plane(), sharp(), degrees));
    EXPECT_NEAR(run.excess.mid, want, 0.01 * want) << degrees;
    EXPECT_LE(run.excess.low, want * 1.002);
    EXPECT_GE(run.excess.high, want * 0.995);
    EXPECT_NEAR((run.top - Eigen::Vector2d(3.3, -7.7)).norm(), 0, 1.5);
    EXPECT_EQ(run.ends[0], FibreEnd::held);
    EXPECT_EQ(run.ends[1], FibreEnd::held);
  }
}

TEST(ExcessField, OfNarrowBellsLiesInTheRange) {
  for (const double wide : {12.0, 16.0, 20.0, 30.0}) {
    const Shape gap = bell(0.2, 0.4, wide, 3);
    const double want = exact(gap, Plane(), {-40, 0.4}, {40, 0.4});
    const FibreRun run = worst(field_of(heights_of(gap), Plane(), sharp()));
    EXPECT_GE(run.excess.high, 0.97 * want) << wide;
    EXPECT_LE(run.excess.low, want) << wide;
    EXPECT_NEAR(run.excess.mid, want, wide < 16 ? 0.3 * want : 0.1 * want) << wide;
  }
}

TEST(ExcessField, ItsRangeHoldsBellsAnywhereBetweenLinesAndCells) {
  FibreOptions options = sharp();
  options.apart = 2.0;
  for (const double wide : {20.0, 28.0, 40.0, 70.0})
    for (const double off : {0.0, 0.3, 0.7, 1.0}) {
      const Shape gap = bell(off, 0.7 * off, wide, 2 * std::sqrt(0.86 * wide) / M_PI);  // an excess of about 0.86 mm
      const double want = exact(gap, Plane(), {-60, 0.7 * off}, {60, 0.7 * off});
      const ExcessField field = field_of(heights_of(gap), Plane(), options);
      double least = 0, most = 0;
      for (const FibreRun& run : field.runs)
        least = std::max(least, run.excess.low - run.uncertainty), most = std::max(most, run.excess.high + run.uncertainty);
      EXPECT_LE(least, want) << wide << " " << off;
      EXPECT_GE(most, want) << wide << " " << off;
      EXPECT_LE(most - least, wide < 40 ? 0.2 : 0.04) << wide << " " << off;  // 0.04 is 0.01 mm of a ridge to either side
    }
}

TEST(ExcessField, OfALongWaveIsItsClosedForm) {
  // One period of a raised cosine across x: the excess of small slopes is (h pi / wide)^2 wide / 4.
  const double high = 0.8, wide = 80;
  const Shape gap = [=](const Eigen::Vector2d& xy) {
    return std::abs(xy.x()) < wide / 2 ? high / 2 * (1 + std::cos(2 * M_PI * xy.x() / wide)) : 0.0;
  };
  const double small = std::pow(M_PI * high / wide, 2) * wide / 4;
  EXPECT_NEAR(worst(field_of(heights_of(gap), Plane(), sharp())).excess.mid, small, 0.01 * small);
}

TEST(ExcessField, OfAConeIsThatOfItsSides) {
  const double radius = 40, high = 5;
  const Shape gap = [=](const Eigen::Vector2d& xy) { return std::max(0.0, high * (1 - xy.norm() / radius)); };
  const double want = 2 * (std::hypot(radius, high) - radius);
  // Its tip is not rounded by nature, and a mean rounds it.
  EXPECT_NEAR(worst(field_of(heights_of(gap), Plane(), sharp())).excess.mid, want, 0.05 * want);
}

TEST(ExcessField, OnACylinderCountsTheMoldsSlope) {
  const Quadric mold(1 / 600.0, 0, 0);  // a trough of radius 300 mm
  const Shape gap = bell(30, 0, 60, 5);
  const double want = exact(gap, mold, {-60, 0}, {120, 0});
  EXPECT_NEAR(worst(field_of(heights_of(gap), mold, sharp()), 0).excess.mid, want, 0.02 * want);
}

TEST(ExcessField, OnASteepSlopeCountsTheMoldsSlope) {
  const Plane mold(1.5, 0);  // 56 degrees
  const Shape gap = bell(0, 0, 60, 5);
  const double want = exact(gap, mold, {0, -60}, {0, 60});
  EXPECT_NEAR(worst(field_of(heights_of(gap), mold, sharp()), 1).excess.mid, want, 0.02 * want);
}

TEST(ExcessField, JoinsTwoBellsOverAsMuchFlatPlyAsAFoldDraws) {
  const double one = exact(bell(0, 0, 50, 4), Plane(), {-60, 0}, {60, 0});
  for (const double flat : {5.0, 20.0, 60.0}) {
    const Shape gap = sum(bell(-25 - flat / 2, 0, 50, 4), bell(25 + flat / 2, 0, 50, 4));
    const FibreRun run = worst(field_of(heights_of(gap), Plane(), sharp()));
    const bool joined = flat <= 20;
    EXPECT_EQ(run.spans, joined ? 2 : 1) << flat;
    EXPECT_NEAR(run.excess.mid, joined ? 2 * one : one, 0.03 * one) << flat;
    EXPECT_NEAR(run.flat, joined ? flat : 0.0, 2.0);
  }
  FibreOptions weak = sharp();
  weak.draw = 10;
  const Shape gap = sum(bell(-36, 0, 50, 4), bell(36, 0, 50, 4));  // 22 mm
  EXPECT_EQ(worst(field_of(heights_of(gap), Plane(), weak)).spans, 1);
}

TEST(ExcessField, OfARingIsTwiceThatOfItsWall) {
  const Shape ring = [](const Eigen::Vector2d& xy) {
    const double off = std::abs(xy.norm() - 25) / 30;
    return off < 0.5 ? 3 * std::pow(std::cos(M_PI * off), 2) : 0.0;
  };
  const double want = exact(ring, Plane(), {-80, 0}, {80, 0});
  EXPECT_NEAR(worst(field_of(heights_of(ring), Plane(), sharp())).excess.mid, want, 0.03 * want);
}

TEST(ExcessField, OfAPlyTooShortIsNegative) {
  // A flat ply over a dish: the mold below is longer.
  const Quadric dish(1 / 400.0, 0, 1 / 400.0);
  const Shape gap = [](const Eigen::Vector2d& xy) { return std::max(0.0, (40 * 40 - xy.squaredNorm()) / 400); };
  const double want = exact(gap, dish, {-60, 0}, {60, 0});
  double least = 0;
  for (const FibreRun& run : field_of(heights_of(gap), dish, sharp()).runs) least = std::min(least, run.excess.mid);
  EXPECT_LT(want, 0);
  EXPECT_NEAR(least, want, 0.05 * std::abs(want));
}

TEST(ExcessField, HasTheNoisesShareTakenOut) {
  const Shape gap = bell(0, 0, 60, 6);
  const double want = exact(gap, Plane(), {-60, 0}, {60, 0});
  FibreOptions options = sharp();
  const ExcessField field = field_of(heights_of(gap, 1.0, 0.05), Plane(), options);
  const FibreRun run = worst(field);
  EXPECT_GT(run.uncertainty, 0);
  EXPECT_NEAR(run.excess.low, want, 3 * run.uncertainty);
  // White noise of 0.05 mm, averaged over 3 by 3 cells, a step of one cell: neighbouring means share two of three columns.
  const double variance = 2 * 3 * 0.05 * 0.05 / 81;  // of the difference of neighbouring means
  EXPECT_NEAR(field.noise.fine_per_mm(), variance / 2, 0.1 * variance);
  EXPECT_GT(field.noise.length, 1000);
}

TEST(ExcessField, SaysWhatHoldsItsEnds) {
  const Grid<float> at_edge = heights_of(bell(120, 0, 60, 5));
  const FibreRun run = worst(field_of(at_edge, Plane(), sharp()), 0);
  EXPECT_EQ(run.ends[0], FibreEnd::held);
  EXPECT_EQ(run.ends[1], FibreEnd::free);
  Grid<float> holed = heights_of(bell(0, 0, 60, 5));
  for (int j = 0; j < holed.ny; ++j)
    for (int i = 0; i < holed.nx; ++i)
      if ((holed.position(i, j) - Eigen::Vector2d(40, 0)).norm() < 6) holed.at(i, j) = kUnknown;
  const ExcessField field = field_of(holed, Plane(), sharp());
  bool unknown = false;
  for (const FibreRun& one : field.runs)
    if (one.family == 0 && std::abs(one.from.y()) < 2) unknown = unknown || one.ends[1] == FibreEnd::unknown;
  EXPECT_TRUE(unknown);
  // A line that leaves the ply at a grazing angle stands off along the edge: that ply does not hold it.
  const Grid<float> along = heights_of(bell(147, 0, 60, 5));
  int grazing = 0;
  for (const FibreRun& one : field_of(along, Plane(), sharp(), 87).runs)
    if (one.family == 0 && one.gap > 4 && one.from.x() > 144) grazing += one.ends[0] == FibreEnd::free || one.ends[1] == FibreEnd::free;
  EXPECT_GE(grazing, 2);
}

TEST(ExcessField, TakesNothingFromHeightsThatArePartlyTheMolds) {
  // A long wave from edge to edge: beside the edges every other row has more of the mold's height than of the ply's.
  const Shape wave = [](const Eigen::Vector2d& xy) {
    return std::abs(xy.y()) < 60 ? 3.5 * std::pow(std::cos(M_PI * xy.y() / 120), 2) : 0.0;
  };
  const double want = exact(wave, Plane(), {0, -70}, {0, 70});
  Grid<float> heights = heights_of(wave);
  for (int j = 0; j < heights.ny; ++j)
    for (int i = 0; i < heights.nx; ++i)
      if (const double x = std::abs(heights.position(i, j).x()); x > 148)
        heights.at(i, j) *= x > 150 ? 0.0F : 0.4F + 0.4F * static_cast<float>(j % 2);
  int along = 0;
  for (const FibreRun& run : field_of(heights, Plane(), sharp(), 0).runs) {
    EXPECT_LT(run.excess.high, 1.05 * want);
    if (run.family == 1) along += run.excess.low > 0.95 * want ? 1 : 0;
  }
  EXPECT_GT(along, 280);
}

TEST(ExcessField, ItsRangeHoldsABellWhoseCrestLiesAtTheEdge) {
  for (const double wide : {24.0, 40.0, 70.0})
    for (const double off : {0.0, 0.4, 0.8}) {
      const Shape gap = bell(150 - off, 0, wide, 2 * std::sqrt(0.86 * wide) / M_PI);
      const double want = exact(gap, Plane(), {150 - off, -60}, {150 - off, 60});
      double most = 0;
      for (const FibreRun& run : field_of(heights_of(gap), Plane(), sharp()).runs) most = std::max(most, run.excess.high);
      EXPECT_GE(most, 0.99 * want) << wide << " " << off;
      EXPECT_LE(most, 1.6 * want) << wide << " " << off;
    }
}

TEST(ExcessField, IsTheSameOnAnyNumberOfThreadsAndWithAnyInstructions) {
  Grid<float> heights = heights_of(sum(bell(-60, 20, 50, 4), bell(50, -30, 40, 3)), 1.0, 0.03);
  for (int j = 150; j < 170; ++j) heights.at(110, j) = kUnknown;
  const Quadric mold(1e-4, 2e-4, 3e-4);
  FibreOptions options = sharp();
  options.threads = 1, options.isa = Isa::base;
  const ExcessField first = field_of(heights, mold, options, 20);
  ASSERT_GT(first.runs.size(), 50U);
  for (const Isa isa : {Isa::base, Isa::v3, Isa::v4})
    for (const int threads : {1, 2, 3}) {
      if (isa > best_isa()) continue;
      options.threads = threads, options.isa = isa;
      const ExcessField again = field_of(heights, mold, options, 20);
      ASSERT_EQ(first.runs.size(), again.runs.size());
      for (std::size_t k = 0; k < first.runs.size(); ++k) {
        EXPECT_EQ(first.runs[k].excess.low, again.runs[k].excess.low);
        EXPECT_EQ(first.runs[k].excess.high, again.runs[k].excess.high);
        EXPECT_EQ(first.runs[k].uncertainty, again.runs[k].uncertainty);
        EXPECT_EQ(first.runs[k].turn, again.runs[k].turn);
      }
      EXPECT_EQ(first.largest.values, again.largest.values);
      EXPECT_EQ(first.noise.fine, again.noise.fine);
    }
}

TEST(ExcessField, FollowsAFieldThatTurnsAlongThePly) {
  // A ridge along rings about a far centre: fibres along the rays cross it, those along the rings do not.
  const Eigen::Vector2d centre(-300, 0);
  const Shape gap = [=](const Eigen::Vector2d& xy) {
    const double off = std::abs((xy - centre).norm() - 300) / 50;
    return off < 0.5 ? 4 * std::pow(std::cos(M_PI * off), 2) : 0.0;
  };
  AngleField field(61, 61, {-150, -150}, 5, Eigen::Vector2d::Zero());
  for (int j = 0; j < field.ny; ++j)
    for (int i = 0; i < field.nx; ++i) {
      const Eigen::Vector2d ray = field.position(i, j) - centre;
      field.at(i, j) = {std::atan2(ray.y(), ray.x()), std::atan2(ray.y(), ray.x()) + M_PI / 2};
    }
  const FibreOptions options = sharp();
  const Grid<float> heights = heights_of(gap);
  FibreMemory memory;
  const ExcessField out = measure_excess(field_lines(field, kPly, kBox, options), heights, kPly, Plane(), true, options, memory);
  const double want = exact(gap, Plane(), {-60, 0}, {60, 0});
  int crossing = 0;
  for (const FibreRun& run : out.runs) {
    if (run.family == 1) {
      EXPECT_LT(run.excess.mid, 0.1 * want);
    }
    if (run.family != 0 || run.length < 30 || run.ends[0] != FibreEnd::held || run.ends[1] != FibreEnd::held) continue;
    EXPECT_NEAR(run.excess.mid, want, 0.05 * want);
    ++crossing;
  }
  EXPECT_GT(crossing, 100);
}

TEST(ExcessField, IsTheSameWithTheMemoryOfOtherScans) {
  const auto lines = straight_lines({0.3, 0.3 + M_PI / 2}, kPly, kBox, FibreOptions());
  const Plane mold(0.1, -0.05);
  Grid<float> moved = heights_of(bell(-20, 10, 50, 4));
  moved.origin += Eigen::Vector2d(0.3, 0.7);
  FibreOptions wider;
  wider.edge_cells += 3;
  FibreMemory memory;
  for (const auto& [heights, options] : {std::pair(heights_of(bell(0, 0, 60, 5)), FibreOptions()),
                                         std::pair(heights_of(bell(30, -20, 40, 3)), FibreOptions()),  // on other tiles
                                         std::pair(moved, FibreOptions()), std::pair(heights_of(bell(0, 0, 60, 5)), wider)})
    for (const bool whole : {true, false}) {
      const ExcessField want = measure_excess(lines, heights, kPly, mold, whole, options);
      const ExcessField got = measure_excess(lines, heights, kPly, mold, whole, options, memory);
      ASSERT_FALSE(want.runs.empty());
      ASSERT_EQ(got.runs.size(), want.runs.size());
      for (std::size_t k = 0; k < got.runs.size(); ++k) {
        EXPECT_EQ(got.runs[k].excess.mid, want.runs[k].excess.mid);
        EXPECT_EQ(got.runs[k].length, want.runs[k].length);
      }
      EXPECT_EQ(got.noise.fine, want.noise.fine);
    }
  EXPECT_FALSE(memory.tiles.mold.empty());
}

TEST(ExcessField, StopsWhenAsked) {
  const Grid<float> heights = heights_of(bell(0, 0, 60, 5));
  const FibreOptions options;
  Stop stop;
  stop.cancel();
  FibreMemory memory;
  const auto lines = straight_lines({0, M_PI / 2}, kPly, kBox, options);
  EXPECT_THROW(measure_excess(lines, heights, kPly, Plane(), true, options, memory, stop), Stopped);
}

}  // namespace
}  // namespace debulk
