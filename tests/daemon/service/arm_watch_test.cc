// What is said of the arm is what the newest packet shows, and no more.

#include <gtest/gtest.h>

#include "daemon/service/status.h"

namespace cellcal::daemon {
namespace {

using namespace std::chrono_literals;
using drivers::RobotLink;

struct arm_watch : ::testing::Test {
  ArmWatch watch;
  drivers::TimePoint now{1h};
  drivers::RobotState robot;
  arm_watch() {
    robot.link = RobotLink::kReady;
    robot.actual_rad = {0.1, 0.2};
  }
  /// The link goes on for so long, a look every 200 ms.
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

TEST_F(arm_watch, says_nothing_before_the_first_packet) {
  robot.link = RobotLink::kDown;
  watch.update(robot, now);
  EXPECT_EQ(watch.seen(now).motion, ArmMotion::kUnknown);
  EXPECT_FALSE(watch.seen(now).packet_age_s);
}

TEST_F(arm_watch, calls_an_arm_at_rest_only_while_packets_show_it) {
  EXPECT_EQ(after(1).motion, ArmMotion::kUnknown) << "one packet shows no motion and no rest";
  EXPECT_EQ(after(2).motion, ArmMotion::kAtRest);
  now += 300ms;
  watch.update(robot, now);  // no packet since: the cable is pulled, the driver's limit not reached
  EXPECT_NEAR(*watch.seen(now).packet_age_s, 0.3, 1e-9);
  now += 5s;
  EXPECT_EQ(watch.seen(now).motion, ArmMotion::kUnknown);
  EXPECT_NEAR(*watch.seen(now).packet_age_s, 5.3, 1e-9);
}

TEST_F(arm_watch, knows_nothing_of_an_arm_whose_link_is_lost_from_the_first_look_on) {
  ASSERT_EQ(after(3).motion, ArmMotion::kAtRest);
  robot.link = RobotLink::kLost;
  watch.update(robot, now += 20ms);
  EXPECT_EQ(watch.seen(now).motion, ArmMotion::kUnknown);
  EXPECT_NEAR(*watch.seen(now).packet_age_s, 0.02, 1e-9);
}

TEST_F(arm_watch, calls_an_arm_moving_that_another_hand_moves) {
  EXPECT_EQ(after(3, 0.01).motion, ArmMotion::kMoving);
  EXPECT_EQ(after(1).motion, ArmMotion::kAtRest);
}

TEST_F(arm_watch, takes_the_word_of_a_driver_that_has_seen_the_arm_come_to_rest) {
  robot.moving = true;
  ASSERT_EQ(after(2, 0.01).motion, ArmMotion::kMoving);
  robot.moving = false;
  robot.packets += 1;
  watch.update(robot, now += 4ms);
  EXPECT_EQ(watch.seen(now).motion, ArmMotion::kAtRest);
}

TEST_F(arm_watch, needs_new_packets_after_a_link_was_lost) {
  after(3);
  robot.link = RobotLink::kLost;
  watch.update(robot, now += 20ms);
  robot.link = RobotLink::kNotReferenced;
  EXPECT_EQ(after(1).motion, ArmMotion::kUnknown);
  EXPECT_EQ(after(1).motion, ArmMotion::kAtRest);
}

}  // namespace
}  // namespace cellcal::daemon
