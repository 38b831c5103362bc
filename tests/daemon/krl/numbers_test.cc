#include <gtest/gtest.h>

#include "calib/files/robot_file.h"
#include "daemon/krl/krl_numbers.h"
#include "daemon/krl/point_value.h"
#include "tests/daemon/krl/fixture.h"

namespace cellcal::daemon::testing {
namespace {

using krl::nearest_turns;
using krl::rewritten;

TEST(ANumber, KeepsItsDecimalsAndGetsAsManyAsItNeeds) {
  EXPECT_EQ(rewritten("107.147003", 108.0, 4), "108.000000");
  EXPECT_EQ(rewritten("12.5", 12.56789, 4), "12.5679");
  EXPECT_EQ(rewritten("35", 51.0, 0), "51");
  EXPECT_EQ(rewritten("6.19999992E-05", 0.25, 4), "0.250000000");
  EXPECT_EQ(rewritten("-0.5", 0.0, 4), "0.0000");
  EXPECT_EQ(rewritten("0.5", -0.00000001, 4), "0.0000");
}

TEST(ANumber, KeepsTheBlanksBehindItsSign) {
  EXPECT_EQ(rewritten("-  393.4", -393.41239, 4), "-  393.4124");
  EXPECT_EQ(rewritten("-\t0.5", 0.25, 4), "\t0.2500");
  EXPECT_EQ(rewritten("+ 0.5", -0.25, 4), "- 0.2500");
  EXPECT_EQ(rewritten("+0.5", 0.25, 4), "+0.2500");
}

TEST(ANumber, ThatStaysTheSameKeepsItsText) {
  EXPECT_EQ(rewritten("6.19999992E-05", 6.19999992e-5, 4), "6.19999992E-05");
  EXPECT_EQ(rewritten("-90.0", -90.000001, 5), "-90.0");
  EXPECT_EQ(rewritten("+ 3", 3.0, 4), "+ 3");
}

TEST(ThreeTurns, StayNearThoseThatWereTaught) {
  for (const calib::FrameMmDeg near :
       {calib::FrameMmDeg{{}, {180.0, 0.0, 180.0}}, calib::FrameMmDeg{{}, {-180.0, 0.0, -180.0}},
        calib::FrameMmDeg{{}, {170.0, 100.0, -350.0}}, calib::FrameMmDeg{{}, {30.0, 90.0, 40.0}},
        calib::FrameMmDeg{{}, {30.0, -90.0, 40.0}}}) {
    const auto found = nearest_turns(calib::to_isometry(near), near);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(found.abc_deg[i], near.abc_deg[i], 1e-6);
  }
}

/// For every shipped six-axis KUKA arm.
TEST(StatusAndTurn, AreKukasAndLeadBackToTheJoints) {
  int arms = 0;
  for (const calib::NamedRobot& named : calib::shipped_robots()) {
    const calib::Robot& robot = named.robot;
    const calib::ArmModel arm(robot, cell().tool);
    const calib::Configurations ways(arm, 0.0);
    if (!ways.closed_form() || robot.joints[0].name != "A1") continue;
    SCOPED_TRACE(robot.name);
    ++arms;
    calib::Random random(5);
    for (int k = 0; k < 12; ++k) {
      calib::JointVector q;
      for (const calib::Joint& joint : robot.joints)
        q.push_back(random.uniform(joint.min_rad + 0.05, joint.max_rad - 0.05));
      const krl::StatusTurn found = krl::status_turn_of(ways, q);
      const StatusAndTurn stated = status_and_turn(robot, q);
      const auto j = arm.nominal_jacobian(q);
      if (std::abs((j * j.transpose()).determinant()) < 1e-4) continue;
      EXPECT_EQ(found.status, stated.status);
      EXPECT_EQ(found.turn, stated.turn);
      const auto back = krl::joints_of(ways, robot, arm.nominal_tcp(q), found);
      ASSERT_TRUE(back);
      for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR((*back)[i], q[i], 1e-6);
    }
  }
  EXPECT_GT(arms, 40);
}

}  // namespace
}  // namespace cellcal::daemon::testing
