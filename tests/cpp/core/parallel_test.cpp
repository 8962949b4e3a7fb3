#include "debulk/core/parallel.hpp"

#include <gtest/gtest.h>
#include <pthread.h>

#include <numeric>
#include <stdexcept>
#include <system_error>
#include <thread>
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

// Where a thread's stack does not fit into the address space, the system gives none.
TEST(ParallelFor, DoesAllOnAMachineThatGivesNoThreads) {
  pthread_attr_t before, huge;
  ASSERT_EQ(pthread_getattr_default_np(&before), 0);
  pthread_attr_init(&huge);
  pthread_attr_setstacksize(&huge, std::size_t{1} << 47);
  ASSERT_EQ(pthread_setattr_default_np(&huge), 0);
  EXPECT_THROW(std::thread([] {}).join(), std::system_error);
  long visits = 0;  // by this thread alone
  parallel_for(100, 10, 4, [&](long begin, long end) { visits += end - begin; });
  pthread_setattr_default_np(&before);
  EXPECT_EQ(visits, 100);
}

TEST(ParallelFor, RefusesAnImpossibleChunk) {
  EXPECT_THROW(parallel_for(1, 0, 1, [](long, long) {}), InputError);
  EXPECT_THROW(parallel_for(1, 1, -1, [](long, long) {}), InputError);
}

}  // namespace
}  // namespace debulk
