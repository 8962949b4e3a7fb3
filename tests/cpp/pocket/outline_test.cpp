#include "debulk/pocket/outline.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "bells.hpp"
#include "debulk/pocket/components.hpp"
#include "debulk/pocket/ply_mask.hpp"

namespace debulk {
namespace {

const Polygon kHook = {{3.2, 4.1}, {33.3, 2.7}, {35.0, 21.0}, {20.5, 19.5}, {19.5, 10.25}, {12.0, 12.0}, {15.0, 27.0}, {5.0, 25.0}};

TEST(PlyMask, AgreesWithTheInsideTestAndFindsTheEdge) {
  const Grid<float> grid(90, 70, {-2, -3}, 0.5);
  const PlyMask mask(kHook, grid);
  int crossings = 0;
  for (int j = 1; j < 69; ++j)
    for (int i = 1; i < 89; ++i) {
      if (distance_to_outline(kHook, grid.position(i, j)) > 1e-9) {
        ASSERT_EQ(mask.on_ply(i, j), inside(kHook, grid.position(i, j))) << i << " " << j;
      }
      if (!mask.on_ply(i, j)) continue;
      for (const auto& [di, dj] : {std::pair{1, 0}, std::pair{-1, 0}, std::pair{0, 1}, std::pair{0, -1}}) {
        if (mask.on_ply(i + di, j + dj)) continue;
        const double t = mask.crossing(i, j, di, dj);
        EXPECT_LT(distance_to_outline(kHook, grid.position(i + t * di, j + t * dj)), 1e-9);
        ++crossings;
      }
    }
  EXPECT_GT(crossings, 200);
  EXPECT_FALSE(PlyMask().known());
  EXPECT_TRUE(PlyMask().on_ply(3, 3));
}

Grid<std::uint8_t> fill_holes(const Grid<std::uint8_t>& image) {
  RunFilling filling;
  auto out = image.like<std::uint8_t>();
  for (const Run& run : filling.run(find_runs(image, true), image.nx, image.ny))
    for (int i = run.begin; i < run.end; ++i) out.at(i, run.row) = 1;
  return out;
}

Grid<std::int32_t> connected_components(const Grid<std::uint8_t>& image, int& count) {
  RunJoining joining;
  const Components& components = joining.run(find_runs(image, true));
  count = components.count();
  auto out = image.like<std::int32_t>();
  for (int k = 0; k < count; ++k) paint(components, static_cast<std::size_t>(k), k + 1, out);
  return out;
}

TEST(Components, FillOnlyWhatCannotReachTheBorderOverFourNeighbours) {
  Grid<std::uint8_t> image(9, 5, {0, 0}, 1.0);
  const char* rows[5] = {".........",  //
                         ".###..#..",  //
                         ".#.#.#.#.",  //
                         ".###..#..",  //
                         "........."};
  for (int j = 0; j < 5; ++j)
    for (int i = 0; i < 9; ++i) image.at(i, j) = rows[j][i] == '#';
  const auto filled = fill_holes(image);
  EXPECT_EQ(filled.at(2, 2), 1);
  EXPECT_EQ(filled.at(6, 2), 1);  // four diagonal neighbours hold it in
  EXPECT_EQ(filled.at(4, 2), 0);
  int count = 0;
  const auto labels = connected_components(filled, count);
  EXPECT_EQ(count, 2);
  EXPECT_EQ(labels.at(1, 1), 1);
  EXPECT_EQ(labels.at(7, 2), 2);
  image.at(2, 0) = image.at(1, 0) = image.at(3, 0) = 1;
  image.at(2, 1) = 0;  // still closed
  EXPECT_EQ(fill_holes(image).at(2, 1), 1);
  image.at(2, 0) = 0;  // open to the border
  EXPECT_EQ(fill_holes(image).at(2, 1), 0);
}

// Random heights, unknown points and a crooked edge: every saddle and every kind of border at once.
TEST(Outlines, RunRoundEveryPointOfTheirRegionAndNoOther) {
  for (unsigned long seed = 0; seed < 6; ++seed) {
    Grid<float> heights(80, 60, {1, 2}, 0.5);
    for (std::size_t k = 0; k < heights.size(); ++k) {
      heights.values[k] = static_cast<float>(0.3 * static_cast<double>(seed) - 0.8 + noise(seed * 100000 + k));
      if (k % 11 == 3) heights.values[k] = kUnknown;
    }
    const PlyMask ply = seed % 2 ? PlyMask(kHook, heights) : PlyMask();
    auto image = heights.like<std::uint8_t>();
    for (int j = 0; j < 60; ++j)
      for (int i = 0; i < 80; ++i) {
        if (!ply.on_ply(i, j)) heights.at(i, j) = kUnknown;
        image.at(i, j) = heights.at(i, j) >= 0;
      }
    image = fill_holes(image);
    int count = 0;
    const auto labels = connected_components(image, count);
    auto filled = heights;
    for (std::size_t k = 0; k < filled.size(); ++k)
      if (image.values[k] && std::isnan(filled.values[k])) filled.values[k] = 1;
    const auto outlines = trace_outlines(labelled(labels, count), labels, filled, 0, ply);
    ASSERT_EQ(outlines.size(), static_cast<std::size_t>(count));
    for (std::size_t k = 0; k < outlines.size(); ++k) {
      const Polygon& p = outlines[k].polygon;
      ASSERT_GE(p.size(), 4u);
      ASSERT_GT(polygon_area(p), 0);
      for (std::size_t n = 0; n < p.size(); ++n) ASSERT_LE((p[(n + 1) % p.size()] - p[n]).norm(), 0.5 * std::sqrt(2.0) + 1e-9);
      const Box box = bounding_box(p);
      for (int j = 0; j < 60; ++j)
        for (int i = 0; i < 80; ++i) {
          const Eigen::Vector2d at = heights.position(i, j);
          if ((at - box.low).minCoeff() < -1 || (box.high - at).minCoeff() < -1 || distance_to_outline(p, at) < 1e-5) continue;
          ASSERT_EQ(inside(p, at), labels.at(i, j) == static_cast<int>(k) + 1) << seed << ": " << i << " " << j;
        }
    }
  }
}

}  // namespace
}  // namespace debulk
