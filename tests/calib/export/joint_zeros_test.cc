// Zeros and senses of one arm with two descriptions.

#include <gtest/gtest.h>

#include <cmath>

#include "calib/export/machine_data.h"
#include "calib/export/rigid_arm.h"
#include "calib/files/files.h"
#include "calib/files/robot_file.h"
#include "calib/model/linear.h"
#include "calib/model/units.h"

namespace cellcal::calib::testing {
namespace {

JointFrames shipped_frames(const std::string& file) {
  for (const NamedRobot& one : shipped_robots())
    if (one.file == file) return joint_frames({one.robot, {}});
  throw std::runtime_error(file);
}

/// The arm with joint angles derived from the given one's: sense * q + zero.
JointFrames counted_so(JointFrames arm, const std::vector<JointZero>& zeros) {
  for (std::size_t i = 0; i < arm.joints.size(); ++i) {
    PlacedJoint& joint = arm.joints[i];
    joint.origin =
        joint.origin * Eigen::AngleAxisd(-zeros[i].zero_rad, zeros[i].sense * joint.axis);
    joint.axis *= zeros[i].sense;
  }
  return arm;
}

TEST(JointZeros, OfTheSameArmAreTheSame) {
  for (const NamedRobot& one : shipped_robots()) {
    const JointFrames arm = joint_frames({one.robot, {}});
    const auto found = compare_zeros(arm, arm);
    ASSERT_TRUE(found) << one.file;
    EXPECT_TRUE(found->same()) << one.file;
    EXPECT_NEAR(found->aside_m, 0.0, 1e-9) << one.file;
  }
}

TEST(JointZeros, OfAnyOneJointAreFound) {
  const JointFrames arm = shipped_frames("kr16_r1610_2");
  for (std::size_t i = 0; i < 6; ++i)
    for (const JointZero one :
         {JointZero{1, 0.02}, JointZero{1, -M_PI / 2}, JointZero{-1, 0.0}, JointZero{-1, 0.3}}) {
      std::vector<JointZero> zeros(6);
      zeros[i] = one;
      const auto found = compare_zeros(arm, counted_so(arm, zeros));
      ASSERT_TRUE(found) << i;
      for (std::size_t k = 0; k < 6; ++k) {
        EXPECT_EQ(found->joints[k].sense, zeros[k].sense) << i << " " << k;
        EXPECT_NEAR(found->joints[k].zero_rad, zeros[k].zero_rad, 1e-6) << i << " " << k;
      }
      EXPECT_FALSE(found->same());
    }
}

/// The result brings both arms' flanges to the same place.
TEST(JointZeros, OfAllJointsBringTheFlangesTogether) {
  const JointFrames arm = shipped_frames("kr5_r1400");
  Random random(3);
  for (int k = 0; k < 200; ++k) {
    std::vector<JointZero> zeros(6);
    for (JointZero& one : zeros)
      one = {random.uniform(0.0, 1.0) < 0.5 ? -1 : 1, random.uniform(-3.0, 3.0)};
    const JointFrames other = counted_so(arm, zeros);
    const auto found = compare_zeros(arm, other);
    ASSERT_TRUE(found);
    std::vector<double> q, to;
    for (std::size_t i = 0; i < 6; ++i) {
      q.push_back(random.uniform(-2.0, 2.0));
      to.push_back(found->joints[i].sense * q[i] + found->joints[i].zero_rad);
    }
    EXPECT_TRUE(flange_of(arm, q).isApprox(flange_of(other, to), 1e-6)) << k;
  }
}

TEST(JointZeros, AreNotSoughtBetweenOtherAxes) {
  JointFrames arm = shipped_frames("kr5_r1400"), other = arm;
  other.joints[3].origin =
      other.joints[3].origin * Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitX());
  EXPECT_FALSE(compare_zeros(arm, other) && compare_zeros(arm, other)->same());
  other = arm;
  other.joints.pop_back();
  EXPECT_FALSE(compare_zeros(arm, other));
  EXPECT_FALSE(compare_zeros({}, {}));
}

TEST(JointZeros, NameAFlangeThatIsTurned) {
  JointFrames arm = shipped_frames("kr5_r1400"), other = arm;
  other.flange = other.flange * Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitY());
  const auto found = compare_zeros(arm, other);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->flange_rad, M_PI / 2, 1e-6);
  for (const JointZero& one : found->joints) EXPECT_TRUE(one.same());
}

TEST(JointZeros, OfAnArmOfOtherLengthsAreTheControllers) {
  MachineData data;
  for (const NamedRobot& one : shipped_robots()) {
    if (one.robot.joints.size() != 6 || one.robot.joints[0].name != "A1") continue;
    const auto zeros = controllers_zeros(data, one.robot);
    EXPECT_TRUE(!zeros || zeros->same()) << one.file;
  }
  Robot turned = load_named_robot("kr5_r1400");
  data.base = FrameMmDeg{{0, 0, 400}, {}};
  data.length_a_m = 0.180;
  data.length_b_m = 0.600;
  data.wrist = FrameMmDeg{{620, 0, 40}, {0, 90, 0}};
  data.flange = FrameMmDeg{{0, 0, 80}, {}};
  turned.joints[2].offset_rad += 0.1;
  const auto zeros = controllers_zeros(data, turned);
  ASSERT_TRUE(zeros);
  EXPECT_NEAR(zeros->joints[2].zero_rad, turned.joints[2].sign * 0.1, 1e-6);
}

}  // namespace
}  // namespace cellcal::calib::testing
