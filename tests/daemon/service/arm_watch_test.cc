// The reported state of the arm is that of the newest packet.

#include <gtest/gtest.h>

#include "daemon/service/status.h"

namespace cellcal::daemon {
namespace {

using namespace std::chrono_literals;
using drivers::RobotLink;

struct ArmWatchTest : ::testing::Test {
  ArmWatch watch;
  drivers::TimePoint now{1h};
  drivers::RobotState robot;
  ArmWatchTest() {
    robot.link = RobotLink::kReady;
    robot.actual_rad = {0.1, 0.2};
  }
  /// The link continues for this many samples, one every 200 ms.
  ArmSeen after(int samples, double step_rad = 0.0) {
    for (int i = 0; i < samples; ++i) {
      now += 200ms;
      robot.packets += 50;
      robot.actual_rad[1] += step_rad;
      watch.update(robot, now);
    }
    return watch.seen(now);
  }
};

TEST_F(ArmWatchTest, SaysNothingBeforeTheFirstPacket) {
  robot.link = RobotLink::kDown;
  watch.update(robot, now);
  EXPECT_EQ(watch.seen(now).motion, ArmMotion::kUnknown);
  EXPECT_FALSE(watch.seen(now).packet_age_s);
}

TEST_F(ArmWatchTest, CallsAnArmAtRestOnlyWhilePacketsShowIt) {
  EXPECT_EQ(after(1).motion, ArmMotion::kUnknown) << "one packet shows no motion and no rest";
  EXPECT_EQ(after(2).motion, ArmMotion::kAtRest);
  now += 300ms;
  watch.update(robot, now);  // no packet since: the cable is pulled, the driver's limit not reached
  EXPECT_NEAR(*watch.seen(now).packet_age_s, 0.3, 1e-9);
  now += 5s;
  EXPECT_EQ(watch.seen(now).motion, ArmMotion::kUnknown);
  EXPECT_NEAR(*watch.seen(now).packet_age_s, 5.3, 1e-9);
}

TEST_F(ArmWatchTest, KnowsNothingOfAnArmWhoseLinkIsLostFromTheFirstLookOn) {
  ASSERT_EQ(after(3).motion, ArmMotion::kAtRest);
  robot.link = RobotLink::kLost;
  watch.update(robot, now += 20ms);
  EXPECT_EQ(watch.seen(now).motion, ArmMotion::kUnknown);
  EXPECT_NEAR(*watch.seen(now).packet_age_s, 0.02, 1e-9);
}

TEST_F(ArmWatchTest, CallsAnArmMovingThatAnotherHandMoves) {
  EXPECT_EQ(after(3, 0.01).motion, ArmMotion::kMoving);
  EXPECT_EQ(after(1).motion, ArmMotion::kAtRest);
}

TEST_F(ArmWatchTest, TakesTheWordOfADriverThatHasSeenTheArmComeToRest) {
  robot.moving = true;
  ASSERT_EQ(after(2, 0.01).motion, ArmMotion::kMoving);
  robot.moving = false;
  robot.packets += 1;
  watch.update(robot, now += 4ms);
  EXPECT_EQ(watch.seen(now).motion, ArmMotion::kAtRest);
}

TEST_F(ArmWatchTest, NeedsNewPacketsAfterALinkWasLost) {
  after(3);
  robot.link = RobotLink::kLost;
  watch.update(robot, now += 20ms);
  robot.link = RobotLink::kNotReferenced;
  EXPECT_EQ(after(1).motion, ArmMotion::kUnknown);
  EXPECT_EQ(after(1).motion, ArmMotion::kAtRest);
}

}  // namespace
}  // namespace cellcal::daemon
