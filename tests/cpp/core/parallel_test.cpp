#include "debulk/core/parallel.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <stdexcept>
#include <vector>

#include "debulk/core/error.hpp"

namespace debulk {
namespace {

TEST(ParallelFor, VisitsEveryItemOnceOnAnyNumberOfThreads) {
  for (const int threads : {1, 2, 4, 0})
    for (const long count : {0L, 1L, 7L, 1000L}) {
      std::vector<int> visits(static_cast<std::size_t>(count), 0);
      parallel_for(count, 3, threads, [&](long begin, long end) {
        for (long i = begin; i < end; ++i) ++visits[static_cast<std::size_t>(i)];
      });
      EXPECT_EQ(std::accumulate(visits.begin(), visits.end(), 0L), count);
      for (const int v : visits) EXPECT_EQ(v, 1);
    }
}

TEST(ParallelFor, HandsOnTheFirstFailureInOrderOfChunks) {
  try {
    parallel_for(100, 10, 1, [](long begin, long) {
      if (begin >= 30) throw std::runtime_error(std::to_string(begin));
    });
    FAIL() << "nothing was thrown";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "30");
  }
  EXPECT_THROW(parallel_for(100, 10, 4, [](long, long) { throw std::runtime_error("any"); }), std::runtime_error);
}

TEST(ParallelFor, RefusesAnImpossibleChunk) {
  EXPECT_THROW(parallel_for(1, 0, 1, [](long, long) {}), InputError);
  EXPECT_THROW(parallel_for(1, 1, -1, [](long, long) {}), InputError);
}

}  // namespace
}  // namespace debulk
