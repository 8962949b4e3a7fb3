#include "debulk/pocket/ply_mask.hpp"

#include <algorithm>

#include <gtest/gtest.h>

namespace debulk {
namespace {

TEST(PlyMask, TakesCornersFartherOffThanAnIntHolds) {
  for (const double far : {1e5, 1e9, 1e12, 1e300}) {
    const PlyMask mask({{5.5, 5.5}, {far, 5.5}, {far, far}, {5.5, far}}, 30, 20, {0, 0}, 1.0);
    for (int j = 0; j < 20; ++j)
      for (int i = 0; i < 30; ++i) EXPECT_EQ(mask.on_ply(i, j), i > 5 && j > 5) << i << ", " << j << ", " << far;
    const PlyMask beside({{-far, -far}, {-5, -far}, {-5, -5}, {-far, -5}}, 30, 20, {0, 0}, 1.0);
    for (int j = 0; j < 20; ++j)
      for (int i = 0; i < 30; ++i) EXPECT_FALSE(beside.on_ply(i, j));
  }
}

TEST(PlyMask, ItsInnerPointsHaveNoneOffThePlyNear) {
  const Polygon notched{{1.5, 0.5}, {26.2, 3.1}, {24.8, 17.9}, {17, 18}, {14, 9.3}, {9.2, 17.5}, {2.2, 16.1}};
  const PlyMask mask(notched, 30, 20, {0, 0}, 1.0);
  for (const int cells : {0, 1, 3}) {
    const PlyMask inner(notched, 30, 20, {0, 0}, 1.0, cells);
    for (int j = 0; j < 20; ++j)
      for (int i = 0; i < 30; ++i) {
        bool all = true;
        for (int n = std::max(0, j - cells); n <= std::min(19, j + cells); ++n)
          for (int m = std::max(0, i - cells); m <= std::min(29, i + cells); ++m) all = all && mask.on_ply(m, n);
        EXPECT_EQ(inner.on_ply(i, j), all) << i << ", " << j << ", " << cells;
        EXPECT_EQ(inner.covers(j, i, i + 1), all);
      }
  }
}

}  // namespace
}  // namespace debulk
