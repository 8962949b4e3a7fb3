#include "debulk/pocket/ply_mask.hpp"

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

}  // namespace
}  // namespace debulk
