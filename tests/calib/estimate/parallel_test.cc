// Many touches are distributed over the processors; the result is the same for any number of them.

#include "calib/estimate/parallel.h"

#include <gtest/gtest.h>
#include <sched.h>

#include <atomic>
#include <stdexcept>
#include <vector>

#include "calib/identify/identify.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

TEST(Parallel, DoesEachPartOnceAndLeavesNoTouchOut) {
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, kTouchesPerPart,
                                  kTouchesPerPart + 1, 5 * kTouchesPerPart - 3}) {
    std::vector<std::atomic<int>> times(count);
    std::atomic<std::size_t> parts{0};
    by_parts(count, [&](std::size_t part, std::size_t first, std::size_t behind) {
      ++parts;
      EXPECT_EQ(first, part * kTouchesPerPart);
      for (std::size_t i = first; i < behind; ++i) ++times[i];
    });
    EXPECT_EQ(parts, parts_of(count));
    for (const std::atomic<int>& t : times) ASSERT_EQ(t, 1);
  }
}

TEST(Parallel, StartsNoMoreThreadsThanThereAreTasksOrEight) {
  EXPECT_EQ(threads_for(0), 1u);
  EXPECT_EQ(threads_for(1), 1u);
  EXPECT_LE(threads_for(1000), 8u);
}

TEST(Parallel, ThrowsOnWhatATaskThrew) {
  const auto run = [] {
    in_parallel(100, [](std::size_t i) {
      if (i == 17) throw std::runtime_error("seventeen");
    });
  };
  EXPECT_THROW(run(), std::runtime_error);
}

/// Restricted to one processor, where the system permits it.
struct OnOneProcessor {
  OnOneProcessor() {
    sched_getaffinity(0, sizeof before, &before);
    cpu_set_t one;
    CPU_ZERO(&one);
    for (std::size_t cpu = 0; cpu < CPU_SETSIZE && CPU_COUNT(&one) == 0; ++cpu)
      if (CPU_ISSET(cpu, &before)) CPU_SET(cpu, &one);
    sched_setaffinity(0, sizeof one, &one);
  }
  ~OnOneProcessor() { sched_setaffinity(0, sizeof before, &before); }
  OnOneProcessor(const OnOneProcessor&) = delete;
  OnOneProcessor& operator=(const OnOneProcessor&) = delete;
  cpu_set_t before;
};

TEST(Parallel, IdentificationHasTheSameBitsOnAnyNumberOfProcessors) {
  const Cell& cell = testing::demo_cell();
  const auto touches =
      testing::make_touches(cell, testing::plain_truth(cell, 5), {.fit = 9000, .seed = 5}).touches;
  const Calibration shared = identify(cell, touches);
  const Calibration alone = [&] {
    const OnOneProcessor one;
    EXPECT_EQ(threads_for(100), 1u);
    return identify(cell, touches);
  }();
  ASSERT_EQ(shared.parameters.size(), alone.parameters.size());
  for (std::size_t i = 0; i < shared.parameters.size(); ++i) {
    EXPECT_EQ(shared.parameters[i].correction, alone.parameters[i].correction);
    EXPECT_EQ(shared.parameters[i].sigma, alone.parameters[i].sigma);
  }
  EXPECT_EQ(shared.chi2, alone.chi2);
}

}  // namespace
}  // namespace cellcal::calib
