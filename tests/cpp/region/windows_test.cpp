// The coarse pass misses nothing that its mesh rules out, parts of a job are the whole's, and a raised stop ends each stage
// before its work.

#include "debulk/region/windows.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "debulk/core/error.hpp"
#include "debulk/pocket/outline_search.hpp"
#include "debulk/region/region_front.hpp"
#include "looking_down.hpp"

namespace debulk {
namespace {

constexpr int kWidth = 400, kHeight = 320;

std::shared_ptr<Reference> plane() {
  return std::make_shared<Reference>(Grid<double>(61, 49, {-120, -96}, 4.0, 0.0));
}

// The scan of a surface that is high (5 mm) at some pixels and 0 elsewhere.
std::vector<float> scan_of(const std::vector<std::uint8_t>& high) {
  const View view = looking_down(kWidth, kHeight);
  std::vector<float> points;
  for (int j = 0; j < kHeight; ++j)
    for (int i = 0; i < kWidth; ++i) {
      const double z = high[static_cast<std::size_t>(j * kWidth + i)] ? 495 : 500;
      for (const double v : {view.camera.u(i) * z, view.camera.v(j) * z, z}) points.push_back(static_cast<float>(v));
    }
  return points;
}

TEST(Mesh, IsAsWideAsTheAreaAllows) {
  const View view = looking_down(kWidth, kHeight);
  const RayBase base = ray_base(*plane(), view);
  const Mesh mesh = choose_mesh(base, view, 200, nullptr);
  EXPECT_NEAR(mesh.pixel_mm, 0.5, 1e-3);
  EXPECT_NEAR(mesh.pixel_mm2, 0.25, 1e-3);
  EXPECT_EQ(mesh.row_step, 4);
  EXPECT_EQ(mesh.column_step, 64);
  EXPECT_LE(mesh.eye_mm2(), 100);
  EXPECT_FALSE(choose_mesh(base, view, 0, nullptr).exists());
  EXPECT_EQ(choose_mesh(base, view, 2 * 16 * 0.26, nullptr).row_step, 1);
}

// Connected regions of any shape, two pixels thick, with more pixels than an eye holds: a walk at random, or straight along
// a row between two rows of the mesh.
TEST(MeshPass, SeesEveryRegionThatIsLargerThanAnEye) {
  const View view = looking_down(kWidth, kHeight);
  const RayBase base = ray_base(*plane(), view);
  const Mesh mesh = choose_mesh(base, view, 200, nullptr);
  MeshOptions options;
  MeshPass pass;
  std::mt19937 random(7);
  for (int trial = 0; trial < 60; ++trial) {
    std::vector<std::uint8_t> high(kWidth * kHeight, 0);
    int i = 40 + static_cast<int>(random() % 200), j = 40 + static_cast<int>(random() % 200), count = 0;
    const int wanted = mesh.row_step * mesh.column_step;
    const bool straight = trial % 3 == 0;
    for (long step = 0; count < wanted && step < 1000000; ++step) {
      for (int dj = 0; dj < 2; ++dj)
        for (int di = 0; di < 2; ++di) {
          std::uint8_t& pixel = high[static_cast<std::size_t>((j + dj) * kWidth + i + di)];
          count += !pixel;
          pixel = 1;
        }
      const int turn = straight ? 0 : static_cast<int>(random() % 4);
      const int next_i = i + (turn == 0) - (turn == 1), next_j = j + (turn == 2) - (turn == 3);
      if (next_i > 2 && next_i < kWidth - 4) i = next_i;
      if (next_j > 2 && next_j < kHeight - 4) j = next_j;
    }
    if (count < wanted) continue;
    const std::vector<float> points = scan_of(high);
    pass.run({points.data(), kWidth, kHeight}, nullptr, view, mesh, base, options, nullptr, {}, 1, Stop());
    bool seen = false;
    for (const std::uint8_t tile : pass.tile_high()) seen |= tile != 0;
    EXPECT_TRUE(seen) << "trial " << trial;
    EXPECT_EQ(pass.strays(), 0);
  }
}

TEST(MeshPass, SingleFlyingPixelsAreNothingHigh) {
  const View view = looking_down(kWidth, kHeight);
  const RayBase base = ray_base(*plane(), view);
  std::vector<std::uint8_t> high(kWidth * kHeight, 0);
  for (int j = 2; j < kHeight; j += 8)
    for (int i = 3; i + 6 < kWidth; i += 20)
      for (int k = 0; k < 1 + i % 6; ++k) high[static_cast<std::size_t>(j * kWidth + i + k)] = 1;
  const std::vector<float> points = scan_of(high);
  MeshPass pass;
  pass.run({points.data(), kWidth, kHeight}, nullptr, view, choose_mesh(base, view, 200, nullptr), base, {}, nullptr, {}, 2, Stop());
  for (const std::uint8_t tile : pass.tile_high()) EXPECT_EQ(tile, 0);
}

TEST(MeshPass, ReadsTheSameInItsSpansAndNothingElse) {
  const View view = looking_down(kWidth, kHeight);
  const RayBase base = ray_base(*plane(), view);
  const Mesh mesh = choose_mesh(base, view, 200, nullptr);
  std::vector<std::uint8_t> high(kWidth * kHeight, 0);
  for (int j = 20; j < 300; ++j)
    for (int i = 30; i < 380; ++i) high[static_cast<std::size_t>(j * kWidth + i)] = (i / 25 + j / 25) % 2 == 0;
  std::vector<float> points = scan_of(high);
  MeshPass whole, part;
  whole.run({points.data(), kWidth, kHeight}, nullptr, view, mesh, base, {}, nullptr, {}, 1, Stop());
  std::vector<TileSpan> spans;
  for (int j = 0; j < whole.tiles_y(); ++j) spans.push_back({j % 5, j % 7 == 3 ? 0 : whole.tiles_x() - j % 4});
  const auto read = [&](int i, int j) {
    const TileSpan& s = spans[static_cast<std::size_t>(j)];
    return i >= s.begin && i < s.end;
  };
  for (int j = 0; j < kHeight; ++j)  // what is not to be read is no image of the camera
    for (int i = 0; i < kWidth; ++i)
      if (!read(i / MeshPass::tile_side, j / MeshPass::tile_side)) points[static_cast<std::size_t>(3 * (j * kWidth + i))] += 50;
  part.run({points.data(), kWidth, kHeight}, nullptr, view, mesh, base, {}, nullptr, spans, 2, Stop());
  EXPECT_EQ(part.strays(), 0);
  EXPECT_LT(part.read(), whole.read());
  const auto same = [](float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); };
  for (int j = 0; j < whole.tiles_y(); ++j)
    for (int i = 0; i < whole.tiles_x(); ++i) {
      const auto k = static_cast<std::size_t>(j * whole.tiles_x() + i);
      EXPECT_EQ(part.tile_high()[k], read(i, j) ? whole.tile_high()[k] : 0);
      EXPECT_TRUE(read(i, j) ? same(part.tile_height()[k], whole.tile_height()[k]) : std::isnan(part.tile_height()[k])) << i << " " << j;
    }
  for (int j = 0; j < whole.cells_y(); ++j)
    for (int i = 0; i < whole.cells_x(); ++i) {
      const auto k = static_cast<std::size_t>(j * whole.cell_pitch() + i);
      const bool seen = read(i * MeshPass::cell_columns / MeshPass::tile_side, j * mesh.row_step / MeshPass::tile_side);
      EXPECT_TRUE(seen ? same(part.cell_height()[k], whole.cell_height()[k]) : std::isnan(part.cell_height()[k])) << i << " " << j;
    }
}

TEST(Windows, MergeUntilNoneOverlaps) {
  const std::vector<Window> out = merged({{0, 0, 16, 16}, {64, 0, 80, 16}, {8, 8, 32, 32}, {24, 24, 70, 48}});
  ASSERT_EQ(out.size(), 1U);
  EXPECT_EQ(out[0], (Window{0, 0, 80, 48}));
  EXPECT_EQ(merged({{0, 16, 16, 32}, {0, 0, 16, 16}}).size(), 2U);
}

TEST(Windows, RectanglesCoverTheWantedBlocksOnce) {
  const Grid<float> frame(700, 500, {0, 0}, 0.5);
  Blocks blocks(frame);
  blocks.add({40, 50, 130, 300}, 3);
  blocks.add({400, 280, 690, 480}, 5);
  Grid<int> covered(700, 500, {0, 0}, 0.5, 0);
  for (const Window& strip : blocks.rectangles({0, 0, 700, 500}, 12))
    for (int j = strip.j0; j < strip.j1; ++j)
      for (int i = strip.i0; i < strip.i1; ++i) ++covered.at(i, j);
  for (int j = 0; j < 500; ++j)
    for (int i = 0; i < 700; ++i) {
      EXPECT_LE(covered.at(i, j), 1);
      if (blocks.wanted(i / 16, j / 16)) {
        EXPECT_EQ(covered.at(i, j), 1) << i << " " << j;
      }
    }
}

TEST(OutlineSearch, TellsThePolygonsOwnBits) {
  Polygon outline;
  std::mt19937 random(3);
  const auto uniform = [&](double low, double high) { return low + (high - low) * static_cast<double>(random()) / 4294967295.0; };
  for (int k = 0; k < 500; ++k) {
    const double angle = 2 * std::acos(-1.0) * k / 500, r = uniform(60, 100);
    outline.emplace_back(r * std::cos(angle), r * std::sin(angle));
  }
  const OutlineSearch search(outline);
  for (int k = 0; k < 2000; ++k) {
    const Eigen::Vector2d p(uniform(-120, 120), uniform(-120, 120));
    EXPECT_EQ(search.inside(p), inside(outline, p));
    EXPECT_EQ(search.distance(p), distance_to_outline(outline, p));
    EXPECT_EQ((search.nearest_point(p) - p).norm(), search.distance(p));
    EXPECT_NEAR(distance_to_outline(outline, search.nearest_point(p)), 0, 1e-12);
    for (const double reach : {0.0, 5.0, distance_to_outline(outline, p)})
      EXPECT_EQ(search.within(p, reach), distance_to_outline(outline, p) <= reach);
    // Straight on from inside: what lies before the way out is inside, what lies behind it is not.
    const double turn = uniform(0, 6.3), way = search.way_out(p, {std::cos(turn), std::sin(turn)});
    const auto on = [&](double along) { return Eigen::Vector2d(p + along * Eigen::Vector2d(std::cos(turn), std::sin(turn))); };
    if (!inside(outline, p)) {
      EXPECT_EQ(way, 0);
      continue;
    }
    EXPECT_FALSE(inside(outline, on(way + 1e-6)));
    for (int part = 0; part < 20; ++part) EXPECT_TRUE(inside(outline, on((way - 1e-6) * part / 20)));
  }
  EXPECT_TRUE(std::isinf(OutlineSearch().distance({0, 0})));
}

TEST(Reference, HeightsOnAGridAreItsHeights) {
  Grid<double> heights(20, 15, {-3, 4}, 4.0);
  std::mt19937 random(5);
  for (double& h : heights.values) h = static_cast<double>(random() % 1000) / 100;
  const Reference reference(heights);
  Grid<double> out(60, 50, {-20, -10}, 1.7);  // past all sides
  reference.heights_on(out, 2);
  for (int j = 0; j < out.ny; ++j)
    for (int i = 0; i < out.nx; ++i) EXPECT_EQ(out.at(i, j), reference.height(out.position(i, j)));
}

TEST(RegionFront, ARaisedStopEndsItBeforeItsWork) {
  RegionOptions options;
  options.front.outliers = {4, 1.0, 2.0};
  const Eigen::Vector2d far = Eigen::Vector2d::Constant(1e9);
  RegionFront front(plane(), -far, far, looking_down(kWidth, kHeight), options, 2);
  std::vector<std::uint8_t> high(kWidth * kHeight, 0);
  for (int j = 100; j < 200; ++j)
    for (int i = 100; i < 200; ++i) high[static_cast<std::size_t>(j * kWidth + i)] = 1;
  const std::vector<float> points = scan_of(high);
  const CloudView scan{points.data(), kWidth, kHeight};
  ASSERT_TRUE(front.run(scan, nullptr));
  EXPECT_EQ(front.regions().size(), 1U);
  const Foot first = front.regions()[0]->feet.feet.at(0);
  Stop stop;
  stop.cancel();
  EXPECT_THROW(front.run(scan, nullptr, stop), Stopped);
  EXPECT_THROW(front.run(scan, nullptr, Stop(-1)), Stopped);
  for (int tenths = 1; tenths < 60; tenths += 2) {  // within, wherever that is
    try {
      front.run(scan, nullptr, Stop(1e-4 * tenths));
    } catch (const Stopped&) {
    }
    if (tenths % 10 != 1) continue;
    ASSERT_TRUE(front.run(scan, nullptr)) << "usable again";
    ASSERT_EQ(front.regions().size(), 1U);
    EXPECT_EQ(front.regions()[0]->feet.feet.at(0).outline, first.outline);
  }
  const RayBase base = ray_base(*plane(), looking_down(kWidth, kHeight));
  MeshPass pass;
  EXPECT_THROW(pass.run(scan, nullptr, looking_down(kWidth, kHeight), front.mesh(), base, {}, nullptr, {}, 1, stop), Stopped);
  EXPECT_THROW(ThresholdSampler().run(scan, nullptr, looking_down(kWidth, kHeight).camera, options.front.outliers, 1, stop), Stopped);
}

TEST(RegionFront, LeavesResultsThatAreHeldAndUsesTheMemoryOfOthers) {
  RegionOptions options;
  options.front.outliers = {4, 1.0, 2.0};
  const Eigen::Vector2d far = Eigen::Vector2d::Constant(1e9);
  RegionFront front(plane(), -far, far, looking_down(kWidth, kHeight), options, 2);
  const auto block_at = [](int left) {
    std::vector<std::uint8_t> high(kWidth * kHeight, 0);
    for (int j = 100; j < 200; ++j)
      for (int i = left; i < left + 100; ++i) high[static_cast<std::size_t>(j * kWidth + i)] = 1;
    return scan_of(high);
  };
  const std::vector<float> one = block_at(100), other = block_at(200);
  ASSERT_TRUE(front.run({one.data(), kWidth, kHeight}, nullptr));
  std::shared_ptr<const Region> held = front.regions().at(0);
  const Region copy = *held;
  ASSERT_TRUE(front.run({other.data(), kWidth, kHeight}, nullptr));
  EXPECT_NE(front.regions().at(0), held);
  EXPECT_EQ(held->segmentation.labels.values, copy.segmentation.labels.values);
  EXPECT_EQ(held->segmentation.pockets.at(0).outline, copy.segmentation.pockets.at(0).outline);
  EXPECT_EQ(held->feet.labels.values, copy.feet.labels.values);
  held.reset();
  const Region* before = front.regions().at(0).get();
  const float* heights = before->segmentation.heights.values.data();
  ASSERT_TRUE(front.run({other.data(), kWidth, kHeight}, nullptr));
  EXPECT_EQ(front.regions().at(0).get(), before);
  EXPECT_EQ(front.regions().at(0)->segmentation.heights.values.data(), heights);
}

TEST(RegionFront, SaysWhyItTakesNoScans) {
  const Eigen::Vector2d far = Eigen::Vector2d::Constant(1e9);
  const auto reason = [&](double area, int neighbours) {
    RegionOptions options;
    options.front.outliers = {neighbours, 1.0, 2.0};
    options.segment.area_tol_mm2 = area;
    const RegionFront front(plane(), -far, far, looking_down(kWidth, kHeight), options, 1);
    EXPECT_EQ(front.usable(), front.reason().empty());
    return front.reason();
  };
  EXPECT_EQ(reason(200, 4), "");
  EXPECT_NE(reason(0, 4).find("area tolerance of 0"), std::string::npos);
  EXPECT_NE(reason(0.01, 4).find("no mesh"), std::string::npos);
  EXPECT_NE(reason(200, 5).find("four neighbours"), std::string::npos);
}

}  // namespace
}  // namespace debulk
