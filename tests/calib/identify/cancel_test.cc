// A cancelled identification ends at the next poll; an uncancelled one is unchanged.

#include <gtest/gtest.h>

#include "calib/files/robot_file.h"
#include "calib/identify/identify.h"
#include "calib/model/long_work.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;

/// The result, and the number of polls.
struct Watched {
  Calibration calibration;
  long polls = 0;
};
constexpr long kNever = 1L << 60;

Watched identified(const Cell& cell, const std::vector<Touch>& touches, long called_off_at) {
  Watched result;
  const Watch watch([&] { return ++result.polls >= called_off_at; });
  result.calibration = identify(cell, touches, {}, shipped_robots);
  return result;
}

void expect_called_off_anywhere(const Cell& cell, const std::vector<Touch>& touches) {
  const Calibration alone = identify(cell, touches, {}, shipped_robots);
  const Watched whole = identified(cell, touches, kNever);
  EXPECT_EQ(whole.calibration.after.mean_m, alone.after.mean_m);
  EXPECT_EQ(whole.calibration.verdict.publish(), alone.verdict.publish());
  ASSERT_GT(whole.polls, 20) << "it polls in its loops";
  for (const long place :
       {1L, 2L, 3L, whole.polls / 4, whole.polls / 2, whole.polls - 1, whole.polls})
    EXPECT_THROW(identified(cell, touches, place), Cancelled) << place << " of " << whole.polls;
}

TEST(AnIdentification, IsCalledOffAtAnyPoll) {
  const Cell cell = demo_cell();
  expect_called_off_anywhere(
      cell,
      testing::make_touches(cell, testing::plain_truth(cell, 5), {.fit = 50, .check = 8}).touches);
}

TEST(TheSearchForAMistake, IsCalledOffAtAnyPoll) {
  Cell cell = demo_cell();
  const auto touches =
      testing::make_touches(cell, testing::plain_truth(cell, 5), {.fit = 50, .check = 8}).touches;
  cell.robot.joints[1].sign *= -1;
  expect_called_off_anywhere(cell, touches);
}

}  // namespace
}  // namespace cellcal::calib
