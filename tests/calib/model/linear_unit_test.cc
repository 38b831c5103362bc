// An arm on a linear unit: explicit chain, derivatives, inverse.

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "calib/model/error.h"
#include "calib/model/inverse.h"
#include "calib/model/kinematics.h"
#include "calib/model/nominal_arm.h"
#include "tests/calib/model/random_arm.h"

namespace cellcal::calib {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Translation3d;
using Eigen::Vector3d;

constexpr int kUnits = 20;

Joint random_unit(Random& random) {
  Joint unit;
  unit.name = "E1";
  unit.min_rad = random.uniform(-2.0, 0.0);
  unit.max_rad = unit.min_rad + random.uniform(0.5, 6.0);
  unit.max_speed_rad_s = 1.5;
  unit.guide = LinearGuide{testing::random_direction(random), 5e-4, 3e-3, 3e-4, 5e-4, 3e-4};
  return unit;
}

testing::RandomArm on_a_unit(testing::RandomArm arm, Random& random) {
  arm.robot.joints.insert(arm.robot.joints.begin(), random_unit(random));
  return arm;
}

testing::RandomArm without_unit(testing::RandomArm arm) {
  arm.robot.joints.erase(arm.robot.joints.begin());
  return arm;
}

/// The carriage at this position with these errors, from its six motions one by one.
Isometry3d carriage(const ArmModel& arm, const Eigen::VectorXd& x, double position_m) {
  const Joint& unit = arm.robot().joints[0];
  double motion[kGuideMotions] = {position_m};
  for (int p = 0; p < arm.size(); ++p) {
    const ArmParameter& parameter = arm.parameters()[static_cast<std::size_t>(p)];
    if (parameter.kind != ParameterKind::kGuide) continue;
    const double share = (position_m - unit.min_rad) / (unit.max_rad - unit.min_rad);
    const double basis = parameter.harmonic == 0
                             ? position_m - 0.5 * (unit.min_rad + unit.max_rad)
                             : std::cos(std::numbers::pi * parameter.harmonic * share);
    motion[parameter.axis] += x[p] * basis;
  }
  const Vector3d along = unit.guide->along;
  const Vector3d up = std::abs(along.z()) < 0.9 ? Vector3d::UnitZ() : Vector3d::UnitX();
  const Vector3d above = (up - up.dot(along) * along).normalized(), across = above.cross(along);
  const Isometry3d shifted(
      Translation3d(motion[0] * along + motion[1] * across + motion[2] * above));
  // About axes that rotate with the carriage.
  return shifted * AngleAxisd(motion[3], along) * AngleAxisd(motion[4], across) *
         AngleAxisd(motion[5], above);
}

TEST(LinearUnit, CarriesTheArmByItsSixMotions) {
  Random random(1);
  for (int k = 0; k < kUnits; ++k) {
    const auto drawn = on_a_unit(testing::random_arm(random), random);
    const auto alone = without_unit(drawn);
    const ArmModel arm(drawn.robot, drawn.tool);
    const JointVector q = testing::random_joints(drawn.robot, random);
    Eigen::VectorXd x = testing::random_errors(arm, random, 10.0);
    // The arm itself is exact: its torques are those of the nominal carriage.
    for (int p = 0; p < arm.size(); ++p)
      if (arm.parameters()[static_cast<std::size_t>(p)].kind != ParameterKind::kGuide) x[p] = 0.0;
    const Isometry3d base = drawn.robot.base_fixed;
    const Isometry3d moved = base * carriage(arm, x, q[0]) * base.inverse();
    const ArmModel foot(alone.robot, alone.tool);
    const Vector3d tip = moved * foot.nominal_tip_m(JointVector(q.begin() + 1, q.end()));
    EXPECT_LT((arm.position(arm.prepare(q), x.data()) - tip).norm(), 1e-12) << "arm " << k;
  }
}

TEST(LinearUnit, AtRestIsTheArmAlone) {
  Random random(2);
  const auto drawn = on_a_unit(testing::random_arm(random), random);
  const auto alone = without_unit(drawn);
  const ArmModel arm(drawn.robot, drawn.tool), foot(alone.robot, alone.tool);
  JointVector q = testing::random_joints(drawn.robot, random);
  q[0] = 0.0;
  const JointVector rest(q.begin() + 1, q.end());
  EXPECT_LT((arm.nominal_tip_m(q) - foot.nominal_tip_m(rest)).norm(), 1e-15);
  EXPECT_TRUE(arm.nominal_tcp(q).isApprox(foot.nominal_tcp(rest), 1e-14));
}

TEST(LinearUnit, DerivativesOfTipAndRotationAgreeWithDifferences) {
  Random random(3);
  for (int k = 0; k < kUnits; ++k) {
    const auto drawn = on_a_unit(testing::random_arm(random), random);
    const ArmModel arm(drawn.robot, drawn.tool);
    const PreparedPose pose = arm.prepare(testing::random_joints(drawn.robot, random));
    const Eigen::VectorXd x = testing::random_errors(arm, random, 3.0);
    ArmChain chain;
    const ArmErrors at = arm.errors(x.data());
    arm.walk(pose, at, chain);
    Eigen::Matrix3Xd tip(3, arm.size()), turn(3, arm.size());
    arm.derivative(pose, at, chain, tip);
    arm.turn_derivative(pose, at, chain, turn);
    for (int p = 0; p < arm.size(); ++p) {
      const double factor = std::max(1.0, std::abs(pose.factor[p])), step = 1e-4 / factor;
      Eigen::VectorXd up = x, down = x;
      up[p] += step;
      down[p] -= step;
      const Vector3d moved =
          (arm.position(pose, up.data()) - arm.position(pose, down.data())) / (2.0 * step);
      EXPECT_LT((tip.col(p) - moved).norm(), 1e-7 * factor) << "arm " << k << " parameter " << p;
      const auto rotation = [&](const Eigen::VectorXd& errors) {
        ArmChain there;
        const ArmErrors of = arm.errors(errors.data());
        arm.walk(pose, of, there);
        return arm.rotation(pose, of, there);
      };
      const AngleAxisd turned(rotation(up) * rotation(down).transpose());
      const Vector3d angular = turned.axis() * turned.angle() / (2.0 * step);
      EXPECT_LT((turn.col(p) - angular).norm(), 1e-7 * factor) << "arm " << k << " parameter " << p;
    }
  }
}

TEST(LinearUnit, MovesTheNominalTipAlongItsDirection) {
  Random random(4);
  const auto drawn = on_a_unit(testing::random_arm(random), random);
  const ArmModel arm(drawn.robot, drawn.tool);
  const JointVector q = testing::random_joints(drawn.robot, random);
  const Eigen::Matrix<double, 6, 1> column = arm.nominal_jacobian(q).col(0);
  const Vector3d along = drawn.robot.base_fixed.linear() * drawn.robot.joints[0].guide->along;
  EXPECT_LT((column.head<3>() - along).norm(), 1e-14);
  EXPECT_EQ(column.tail<3>(), Vector3d::Zero());
}

TEST(LinearUnit, TheArmOfTheCycleAgreesWithTheModel) {
  Random random(5);
  for (int k = 0; k < kUnits; ++k) {
    const auto drawn = on_a_unit(testing::random_arm(random), random);
    const ArmModel arm(drawn.robot, drawn.tool);
    const NominalArm fast(drawn.robot, drawn.tool.tcp);
    const JointVector q = testing::random_joints(drawn.robot, random);
    EXPECT_TRUE(fast.tcp(q).isApprox(arm.nominal_tcp(q), 1e-12)) << "arm " << k;
  }
}

TEST(LinearUnit, StaysWhereTheInverseIsAskedFor) {
  Random random(6);
  int reached = 0;
  for (int k = 0; k < kUnits; ++k) {
    const auto drawn = on_a_unit(testing::random_six_axis_arm(random), random);
    const ArmModel arm(drawn.robot, drawn.tool);
    const Configurations ways(arm, 0.0);
    ASSERT_TRUE(ways.closed_form());
    const JointVector q = testing::random_joints(drawn.robot, random);
    const Isometry3d tcp = arm.nominal_tcp(q);
    for (const JointVector& way : ways.reach(tcp, q[0])) {
      ++reached;
      ASSERT_EQ(way.size(), q.size());
      EXPECT_EQ(way[0], q[0]);
      EXPECT_LT((arm.nominal_tip_m(way) - tcp.translation()).norm(), 1e-8);
    }
    const auto same = ways.in_posture(tcp, ways.posture_of(q), q[0]);
    ASSERT_TRUE(same);
    EXPECT_LT((arm.nominal_tip_m(*same) - tcp.translation()).norm(), 1e-8);
    JointVector seed = q;
    for (std::size_t i = 1; i < seed.size(); ++i) seed[i] += 0.01;
    const auto near = inverse(arm, tcp, seed, 0.0);
    if (near) {
      EXPECT_EQ((*near)[0], q[0]);
    }
  }
  EXPECT_GT(reached, kUnits);
}

TEST(LinearUnit, HasASlopeAndWavesOfSixMotionsByName) {
  Random random(7);
  Cell cell;
  const auto drawn = on_a_unit(testing::random_six_axis_arm(random), random);
  cell.robot = drawn.robot;
  cell.robot.joints[0].min_rad = 0.0;
  cell.robot.joints[0].max_rad = 3.0;
  cell.tool = drawn.tool;
  const ArmModel arm(cell);
  std::map<std::string, ArmParameter> guide;
  for (const ArmParameter& parameter : arm.parameters()) {
    const std::string name = parameter_name(cell, parameter);
    EXPECT_EQ(parameter_key(cell, name), static_cast<const ParameterKey&>(parameter)) << name;
    if (parameter.kind == ParameterKind::kGuide) guide.emplace(name, parameter);
  }
  EXPECT_EQ(guide.size(), 6u * static_cast<std::size_t>(1 + guide_orders(3.0)));
  EXPECT_EQ(guide.at("E1.along_slope").unit, "mm/m");
  EXPECT_EQ(guide.at("E1.pitch_slope").unit, "mrad/m");
  EXPECT_EQ(guide.at("E1.above1").unit, "mm");
  EXPECT_EQ(guide.at("E1.yaw6").unit, "mrad");
  double variance = 0.0;  // over the stroke a cosine has half of its square
  for (int order = 1; order <= guide_orders(3.0); ++order)
    variance += std::pow(guide.at("E1.across" + std::to_string(order)).sigma, 2) / 2.0;
  EXPECT_NEAR(std::sqrt(variance), 3e-4, 1e-12);
}

TEST(LinearUnit, WithoutSigmasIsExact) {
  Random random(8);
  auto drawn = on_a_unit(testing::random_arm(random), random);
  drawn.robot.joints[0].guide = LinearGuide{Vector3d::UnitY()};
  const ArmModel arm(drawn.robot, drawn.tool);
  for (const ArmParameter& parameter : arm.parameters())
    EXPECT_NE(parameter.kind, ParameterKind::kGuide);
}

TEST(LinearUnit, IsRefusedByNameWithWhatToDo) {
  Random random(9);
  const auto drawn = on_a_unit(testing::random_arm(random), random);
  EXPECT_NO_THROW(refuse_linear_unit(without_unit(drawn).robot, "a check", "Do without."));
  try {
    refuse_linear_unit(drawn.robot, "a check", "Do without.");
    FAIL();
  } catch (const LinearUnitError& e) {
    EXPECT_STREQ(e.what(),
                 "a check is not possible yet for an arm on a linear unit (E1). Do without.");
  }
}

}  // namespace
}  // namespace cellcal::calib
