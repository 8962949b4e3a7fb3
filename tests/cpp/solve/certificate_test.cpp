#include "debulk/solve/certificate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

namespace debulk {
namespace {

// At each limit it holds, just beyond it fails for that reason alone, and what is not a number never holds.
TEST(Certificate, FailsBeyondEachLimitAndSaysWhich) {
  using Field = double Certificate::*;
  const std::pair<Field, std::pair<double, const char*>> limits[] = {
      {&Certificate::kkt_error, {Certificate::kkt_limit, "first-order residual"}},
      {&Certificate::length_error, {Certificate::compliant_length_limit, "length error"}},
      {&Certificate::penetration_mm, {Certificate::penetration_limit_mm, "penetration"}},
      {&Certificate::energy_gain_mj, {0.0, "energy"}},
      {&Certificate::curvature, {Certificate::curvature_limit, "curvature"}},
  };
  ASSERT_TRUE(Certificate().certified());
  for (const auto& [field, limit] : limits) {
    Certificate at;
    at.*field = limit.first;
    EXPECT_TRUE(at.certified()) << limit.second;
    at.*field = limit.first == 0 ? 1e-12 : limit.first * (1 + 1e-9);
    EXPECT_EQ(at.failure().find(limit.second), 0u) << at.failure();
    at.*field = std::nan("");
    EXPECT_EQ(at.failure().find(limit.second), 0u) << at.failure();
  }
  Certificate rises;
  rises.energy_gain_mj = 2;
  EXPECT_EQ(rises.failure(), "energy 2 mJ above the start's, not 0");
  Certificate two;
  two.length_error = two.kkt_error = 1;
  EXPECT_EQ(two.failure(), "length error 1 above 0.001, first-order residual 1 above 0.0001");
}

}  // namespace
}  // namespace debulk
