// The means of the tiles, against sums point by point.

#include "debulk/fibre/gap_tiles.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "support/shapes.hpp"

namespace debulk {
namespace {

using test::Plane;

// Heights that stand off everywhere, with points that are not known in the second row of tiles.
Grid<float> raised_heights() {
  Grid<float> out(101, 130, {-20, 5}, 0.7);
  std::mt19937 random(3);
  std::normal_distribution<float> normal(2, 0.5F);
  for (float& h : out.values) h = normal(random);
  for (int j = 40; j < 44; ++j)
    for (int i = 30; i < 50; ++i) out.at(i, j) = std::numeric_limits<float>::quiet_NaN();
  return out;
}

double mean_round(const Grid<float>& heights, const PlyMask& ply, int i0, int j0, int half) {
  double sum = 0;
  int count = 0;
  for (int j = j0 - half; j <= j0 + half; ++j)
    for (int i = i0 - half; i <= i0 + half; ++i)
      if (heights.contains(i, j) && ply.on_ply(i, j) && !std::isnan(heights.at(i, j)))
        sum += static_cast<double>(heights.at(i, j)), ++count;
  return sum / count;
}

TEST(GapTiles, HaveTheMeansOfWhatIsKnownInSquares) {
  const Grid<float> heights = raised_heights();
  const Plane mold(0.1, -0.2);
  const Polygon corner_cut{{-30, 0}, {40, 0}, {40, 60}, {0, 110}, {-30, 110}};
  for (const double fine_mm : {2.0, 5.0, 12.0})
    for (const Polygon& outline : {Polygon(), corner_cut})
      for (const Isa isa : {Isa::base, Isa::v3, Isa::v4}) {
        if (isa > best_isa()) continue;
        FibreOptions options;
        options.fine_mm = fine_mm, options.isa = isa;
        const GapTiles tiles(heights, outline, options, Stop());
        const PlyMask ply = outline.empty() ? PlyMask() : PlyMask(outline, heights, options.edge_cells);
        ASSERT_EQ(tiles.raised().size(), 4U * 5U);
        GapTiles::Maker maker(tiles, mold);
        for (std::size_t n = 0; n < tiles.raised().size(); ++n) {
          maker.make(n);
          for (int j = 0; j < kTileSide; j += 4)
            for (int i = 0; i < kTileSide; i += 4) {
              const int at_i = tiles.raised()[n][0] * kTile + i, at_j = tiles.raised()[n][1] * kTile + j;
              if (!heights.contains(at_i, at_j)) continue;
              const std::size_t k = static_cast<std::size_t>(j) * kTileStride + i;
              if (std::isnan(heights.at(at_i, at_j)) || !ply.on_ply(at_i, at_j)) {
                EXPECT_TRUE(std::isnan(maker.fine[k]) && std::isnan(maker.coarse[k]));
                continue;
              }
              const int cells = tiles.fine_cells();
              EXPECT_NEAR(maker.fine[k], mean_round(heights, ply, at_i, at_j, cells / 2) - options.thickness, 2e-6);
              EXPECT_NEAR(maker.coarse[k], mean_round(heights, ply, at_i, at_j, cells) - options.thickness, 2e-6);
              EXPECT_NEAR(maker.mold[k], mold.height(heights.position(at_i, at_j)), 1e-5);
            }
        }
      }
}

TEST(GapTiles, AreMadeOnlyWhereThePlyStandsOffAndNextToIt) {
  Grid<float> heights(32 * 7, 32 * 5, {0, 0}, 1.0, 0.3F);
  heights.at(100, 70) = 0.41F;  // in column 3, row 2
  heights.at(220, 10) = std::numeric_limits<float>::quiet_NaN();
  const GapTiles tiles(heights, {}, FibreOptions(), Stop());
  ASSERT_EQ(tiles.raised().size(), 9U);
  EXPECT_EQ(tiles.raised().front(), (std::array<int, 2>{2, 1}));
  EXPECT_EQ(tiles.raised().back(), (std::array<int, 2>{4, 3}));
  EXPECT_EQ(tiles.numbers()[6], GapTiles::kGaps);
  EXPECT_EQ(tiles.numbers()[0], GapTiles::kFlat);
}

}  // namespace
}  // namespace debulk
