#include "debulk/surface/front_end.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

#include "debulk/core/error.hpp"
#include "debulk/surface/median.hpp"
#include "scene.hpp"
#include "support/taken_memory.hpp"

namespace debulk::front_end_test {
namespace {

using namespace testing;

constexpr int width = 640, height = 480;
const Pinhole camera{1500, 320.4, 241.7};

// A tilted camera 600 mm over a curved mold, which fills the image: 0.4 mm a pixel.
View tilted_view() {
  View view;
  view.camera = camera, view.width = width, view.height = height;
  const double tilt = 0.2;
  view.mold_from_scanner << 1, 0, 0, 5,                           //
      0, -std::cos(tilt), std::sin(tilt), -600 * std::sin(tilt),  //
      0, -std::sin(tilt), -std::cos(tilt), 600 * std::cos(tilt),  //
      0, 0, 0, 1;
  return view;
}

double ply(double x, double y) {
  return mold(x, y) + bell(x - 10, y + 5, 6, 60) + bell(x + 55, y - 30, 3.5, 25);
}

// What it sees, in the scanner's frame; flying pixels (alone and in runs), single drop-outs and discs if spoiled.
std::vector<float> look(const Height& f, double sigma, bool spoiled, std::uint64_t seed) {
  const View view = tilted_view();
  Noise noise(seed);
  std::vector<float> xyz(3 * static_cast<std::size_t>(width) * height);
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column) {
      const Eigen::Vector3d ray(camera.u(column), camera.v(row), 1), d = view.rotation() * ray;
      double z = 600;
      for (int k = 0; k < 20; ++k) {  // a contraction
        const Eigen::Vector3d p = view.centre() + z * d;
        z -= (p.z() - f(p.x(), p.y())) / d.z();
      }
      z += sigma * noise.normal();
      const Eigen::Vector3f p = (z * ray).cast<float>();
      std::copy_n(p.data(), 3, &xyz[3 * (static_cast<std::size_t>(row) * width + static_cast<std::size_t>(column))]);
    }
  const auto below = [&](int n) { return static_cast<int>(noise.uniform() * n); };
  for (int k = 0; spoiled && k < 1500; ++k) {
    const int row = below(height), first = below(width - 6), run = k % 2 ? 1 : 1 + below(5);
    const double lift = k % 5 == 0 ? nanf : (noise.uniform() < 0.5 ? -1 : 1) * (0.05 + 12 * noise.uniform() * noise.uniform());
    for (int i = first; i < first + run; ++i)
      for (std::size_t a = 0; a < 3; ++a) {
        float& v = xyz[3 * (static_cast<std::size_t>(row) * width + static_cast<std::size_t>(i)) + a];
        v = static_cast<float>(v * (1 + lift / 600));
      }
  }
  for (int k = 0; spoiled && k < 25; ++k) {
    const int ci = below(width), cj = below(height), radius = 2 + below(10);
    for (int j = std::max(0, cj - radius); j < std::min(height, cj + radius); ++j)
      for (int i = std::max(0, ci - radius); i < std::min(width, ci + radius); ++i)
        if (std::hypot(i - ci, j - cj) < radius) xyz[3 * (static_cast<std::size_t>(j) * width + static_cast<std::size_t>(i))] = nanf;
  }
  return xyz;
}

CloudView cloud(const std::vector<float>& xyz) {
  return {xyz.data(), width, height};
}

std::shared_ptr<const Reference> reference() {
  Grid<double> nodes(91, 71, {-180, -140}, 4.0);
  for (int j = 0; j < nodes.ny; ++j)
    for (int i = 0; i < nodes.nx; ++i) nodes.at(i, j) = mold(nodes.position(i, j).x(), nodes.position(i, j).y());
  return std::make_shared<Reference>(nodes);
}

FrontEnd front_end(bool pinhole, const FrontEndOptions& options, int threads = 0) {
  return FrontEnd(reference(), {-100, -70}, {100, 70}, tilted_view(), pinhole, options, threads);
}

bool same(const Grid<float>& a, const Grid<float>& b) {
  return a.nx == b.nx && a.ny == b.ny &&
         std::equal(a.values.begin(), a.values.end(), b.values.begin(), [](float x, float y) { return x == y || (x != x && y != y); });
}

TEST(FrontEnd, GivesTheHeightsAndHeedsTheGeneralWaysDecisions) {
  const std::vector<float> seen = look(ply, 0.02, true, 1);
  FrontEndOptions options;
  options.spike = 0.5;
  FrontEnd fast = front_end(true, options), general = front_end(false, options);
  const HeightMap& map = fast.run(cloud(seen));
  ASSERT_TRUE(fast.fast());
  const HeightMap& other = general.run(cloud(seen));
  ASSERT_FALSE(general.fast());
  EXPECT_NEAR(fast.outliers().threshold / general.outliers().threshold, 1, 1e-7);
  const std::vector<float> distances = mean_neighbour_distances(cloud(seen), 4);
  long removed = 0, wrong = 0;
  for (std::size_t k = 0; k < distances.size(); ++k) {
    removed += general.keep()[k] == 0;
    wrong += fast.keep()[k] != general.keep()[k] && !(std::abs(distances[k] / general.outliers().threshold - 1) < 1e-6);
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(removed, 1000);

  ASSERT_EQ(map.heights.nx, other.heights.nx);
  double squares = 0, worst = 0;
  long count = 0;
  for (int j = 0; j < map.heights.ny; ++j)
    for (int i = 0; i < map.heights.nx; ++i) {
      const Eigen::Vector2d at = map.heights.position(i, j);
      if (std::isnan(map.heights.at(i, j))) continue;
      const double error = std::abs(map.heights.at(i, j) - (ply(at.x(), at.y()) - mold(at.x(), at.y())));
      worst = std::max(worst, error), squares += error * error, ++count;
    }
  EXPECT_GT(count, 0.99 * static_cast<double>(map.heights.size()));
  EXPECT_LT(std::sqrt(squares / static_cast<double>(count)), 0.02);
  EXPECT_LT(worst, 0.4);
}

TEST(FrontEnd, GivesTheSameBitsOnAnyNumberOfThreadsAndAfterAnyOtherScan) {
  const std::vector<float> seen = look(ply, 0.05, true, 2), before = look(mold, 0.01, false, 3);
  FrontEndOptions options;
  options.spike = 0.5;
  FrontEnd first = front_end(true, options, 1);
  const HeightMap& map = first.run(cloud(seen));
  ASSERT_TRUE(first.fast());
  for (const int threads : {2, 3}) {
    FrontEnd other = front_end(true, options, threads);
    other.run(cloud(before));
    const HeightMap& again = other.run(cloud(seen));
    EXPECT_TRUE(same(again.heights, map.heights)) << threads;
    EXPECT_EQ(again.measured.values, map.measured.values);
    EXPECT_EQ(other.keep(), first.keep());
  }
}

TEST(FrontEnd, TakesOutSpikesBeforeTheMedian) {
  const std::vector<float> seen = look(ply, 0.05, true, 4);
  FrontEndOptions options;
  options.median = 1;
  Grid<float> expected, filtered;
  FrontEnd plain = front_end(true, options);
  without_spikes(plain.run(cloud(seen)).heights, 0.5, filtered, 2);
  median(filtered, 3, expected, 2);
  options.spike = 0.5, options.median = 3;
  FrontEnd front = front_end(true, options);
  EXPECT_TRUE(same(front.run(cloud(seen)).heights, expected));
  EXPECT_FALSE(same(filtered, plain.run(cloud(seen)).heights));
}

TEST(FrontEnd, TakesTheGeneralWayForOtherClouds) {
  const std::vector<float> good = look(ply, 0.02, true, 5);
  FrontEnd front = front_end(true, {});
  std::vector<float> bad = good;
  bad[3 * (100 * width + 100)] += 1.0f;  // one point off its ray
  EXPECT_TRUE(front.run(cloud(good)).heights.size() > 0 && front.fast());
  front.run(cloud(bad));
  EXPECT_FALSE(front.fast());
  EXPECT_EQ(front.keep(), remove_outliers(cloud(bad)).keep);
  front.run({good.data(), width * height, 1});  // unorganised
  EXPECT_FALSE(front.fast());
  EXPECT_EQ(front.keep(), remove_outliers({good.data(), width * height, 1}).keep);
  bad = good;
  for (int k = 0; k < 50 * width; ++k)
    std::copy_n(&good[3 * 70 * width], 3, &bad[static_cast<std::size_t>(3 * (80 * width + k))]);  // copies
  front.run(cloud(bad));
  EXPECT_FALSE(front.fast());
  EXPECT_EQ(front.keep(), remove_outliers(cloud(bad)).keep);
}

TEST(FrontEnd, StopsWhenToldAndGoesOnAfterwards) {
  const std::vector<float> seen = look(ply, 0.02, true, 6);
  FrontEnd front = front_end(true, {}), fresh = front_end(true, {});
  Stop stop;
  stop.cancel();
  EXPECT_THROW(front.run(cloud(seen), stop), Stopped);
  for (int k = 0; k < 20; ++k) {  // at any moment: either it ends or it throws
    Stop later;
    std::thread other([&] {
      std::this_thread::sleep_for(std::chrono::microseconds(300 * k));
      later.cancel();
    });
    try {
      front.run(cloud(seen), later);
    } catch (const Stopped&) {
    }
    other.join();
  }
  EXPECT_TRUE(same(front.run(cloud(seen)).heights, fresh.run(cloud(seen)).heights));
  EXPECT_EQ(front.keep(), fresh.keep());
}

TEST(FrontEnd, TakesNoMemoryForTheSecondScan) {
  const std::vector<float> seen = look(ply, 0.02, true, 7);
  FrontEndOptions options;
  options.spike = 0.5;
  FrontEnd front = front_end(true, options, 2);
  long taken = bytes_taken;
  front.run(cloud(seen));
  const long first = bytes_taken - taken;
  taken = bytes_taken, largest_taken = 0;
  front.run(cloud(seen));
  EXPECT_LT(bytes_taken - taken, 20000) << "threads, chunks, stops; the first took " << first;
  EXPECT_LT(largest_taken, 3000);
}

TEST(FrontEnd, NamesWhatIsWrong) {
  FrontEndOptions options;
  options.spike = -1;
  EXPECT_THROW(front_end(true, options), InputError);
  options.spike = 0, options.median = 4;
  EXPECT_THROW(front_end(true, options), InputError);
}

}  // namespace
}  // namespace debulk::front_end_test
