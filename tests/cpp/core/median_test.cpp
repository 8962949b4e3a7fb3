#include <algorithm>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "debulk/core/median.hpp"

namespace debulk {
namespace {

TEST(Median, IsTheUpperOneOfFewAndOfMany) {
  std::mt19937 rng(3);
  for (const int size : {1, 2, 5, 6, 100'000, 100'001, 250'000})
    for (const int kinds : {1, 3, 1'000'000}) {  // with many of a kind the sample does not narrow it down
      std::vector<float> values;
      for (int k = 0; k < size; ++k) values.push_back(static_cast<float>(static_cast<int>(rng() % static_cast<unsigned>(kinds)) - 5));
      std::vector<float> sorted = values;
      std::sort(sorted.begin(), sorted.end());
      EXPECT_EQ(upper_median(values), sorted[sorted.size() / 2]) << size << ' ' << kinds;
    }
  std::vector<double> none;
  EXPECT_EQ(upper_median(none), 0);
}

TEST(Median, IsFoundWhereTheSampleMisleads) {
  std::vector<float> values(200'000, 1.0f);
  for (std::size_t k = 0; k < values.size(); k += 64) values[k] = 9.0f;  // exactly those that are sampled
  EXPECT_EQ(upper_median(values), 1.0f);
}

}  // namespace
}  // namespace debulk
