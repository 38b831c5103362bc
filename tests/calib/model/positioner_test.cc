// An arm in the frame of a positioner: explicit chain, derivatives, parameters.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "calib/model/error.h"
#include "calib/model/kinematics.h"
#include "calib/model/touch.h"
#include "tests/calib/model/random_arm.h"

namespace cellcal::calib {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Translation3d;
using Eigen::Vector3d;

constexpr int kDrawn = 20;

testing::RandomArm beside_positioner(Random& random) {
  testing::RandomArm drawn = testing::random_arm(random);
  for (const char* name : {"E1", "E2"}) {
    PositionerAxis axis;
    axis.name = name;
    axis.frame = testing::random_pose(random, 1.5);
    axis.sign = random.uniform() < 0.5 ? -1 : 1;
    axis.min_rad = -2.0;
    axis.max_rad = 2.0;
    axis.place_sigma_m = 2e-3;
    axis.direction_sigma_rad = 2e-3;
    axis.scale_sigma = 1e-4;
    axis.mass_kg = random.uniform(50.0, 400.0);
    axis.com_m = testing::random_pose(random, 0.3).translation();
    axis.compliance_sigma_rad_per_nm = 2e-6;
    axis.bearing_sigma_rad_per_nm = 1e-6;
    drawn.robot.positioner.push_back(axis);
  }
  return drawn;
}

std::vector<double> random_angles(Random& random) {
  return {random.uniform(-2.0, 2.0), random.uniform(-2.0, 2.0)};
}

double value_of(const ArmModel& arm, const Eigen::VectorXd& x, std::size_t axis, AxisError error) {
  for (int p = 0; p < arm.size(); ++p)
    if (arm.parameters()[static_cast<std::size_t>(p)] == positioner_parameter(axis, error))
      return x[p];
  return 0.0;
}

/// Work of gravity on the load of the axis as its frame rotates about `about`, by differences.
double moment_nm(const Robot& robot, std::size_t axis, const Vector3d& about,
                 const std::vector<double>& angles) {
  const auto fall_nm = [&](double turn) {
    Isometry3d place = Isometry3d::Identity();
    double sum = 0.0;
    for (std::size_t j = 0; j < robot.positioner.size(); ++j) {
      const PositionerAxis& one = robot.positioner[j];
      place = place * one.frame;
      if (j == axis) place.rotate(AngleAxisd(turn, about));
      place.rotate(AngleAxisd(one.sign * angles[j], Vector3d::UnitZ()));
      if (j >= axis) sum += one.mass_kg * robot.gravity_m_s2.dot(place * one.com_m);
    }
    return sum;
  };
  constexpr double kStep = 1e-3;
  return (fall_nm(kStep) - fall_nm(-kStep)) / (2.0 * std::sin(kStep));
}

/// (1c), factor by factor. `all`: angles of all axes, which load those that carry.
Isometry3d carried(const ArmModel& arm, const Eigen::VectorXd& x, const std::vector<double>& angles,
                   std::vector<double> all) {
  all.resize(arm.robot().positioner.size());
  Isometry3d place = Isometry3d::Identity();
  for (std::size_t j = 0; j < angles.size(); ++j) {
    const PositionerAxis& axis = arm.robot().positioner[j];
    const auto error = [&](AxisError one) { return value_of(arm, x, j, one); };
    const auto gives = [&](AxisError one, const Vector3d& about) {
      return error(one) * moment_nm(arm.robot(), j, about, all);
    };
    place = place * axis.frame * Translation3d(error(AxisError::kX), error(AxisError::kY), 0.0) *
            AngleAxisd(error(AxisError::kTurnX) + gives(AxisError::kBearingX, Vector3d::UnitX()),
                       Vector3d::UnitX()) *
            AngleAxisd(error(AxisError::kTurnY) + gives(AxisError::kBearingY, Vector3d::UnitY()),
                       Vector3d::UnitY()) *
            AngleAxisd(axis.sign * angles[j] * (1.0 + error(AxisError::kScale)) +
                           gives(AxisError::kCompliance, Vector3d::UnitZ()),
                       Vector3d::UnitZ());
  }
  return place;
}

TEST(Positioner, ATipIsSeenFromTheFrameThatItCarries) {
  Random random(1);
  for (int k = 0; k < kDrawn; ++k) {
    const auto drawn = beside_positioner(random);
    const ArmModel arm(drawn.robot, drawn.tool);
    const JointVector q = testing::random_joints(drawn.robot, random);
    const std::vector<double> all = random_angles(random);
    const Eigen::VectorXd x = testing::random_errors(arm, random, 3.0);
    const PreparedPose in_base = arm.prepare(q);
    const Vector3d tip = arm.position(in_base, x.data());
    ArmChain chain;
    const ArmErrors at = arm.errors(x.data());
    arm.walk(in_base, at, chain);
    const Eigen::Matrix3d turned = arm.rotation(in_base, at, chain);
    for (const std::size_t axes : {1u, 2u}) {
      const std::vector<double> angles(all.begin(),
                                       all.begin() + static_cast<std::ptrdiff_t>(axes));
      for (const bool outer_known : {true, false}) {
        const auto outer = std::span(all).subspan(axes);
        const Isometry3d place = carried(arm, x, angles, outer_known ? all : angles);
        const PreparedPose pose =
            arm.prepare(q, 0, nullptr, angles, outer_known ? outer : std::span<const double>{});
        // Bending and compliance included: gravity rotates with the base.
        EXPECT_LT((place * arm.position(pose, x.data()) - tip).norm(), 1e-10) << "arm " << k;
        arm.walk(pose, at, chain);
        EXPECT_LT((place.linear() * arm.rotation(pose, at, chain) - turned).norm(), 1e-10);
      }
    }
    const Isometry3d nominal = carried_at(drawn.robot, all);
    EXPECT_TRUE((nominal * arm.nominal_tcp(q, 0, all)).isApprox(arm.nominal_tcp(q), 1e-12));
  }
}

TEST(Positioner, GivesOnlyUnderALoad) {
  Random random(6);
  auto drawn = beside_positioner(random);
  const std::vector<double> angles = random_angles(random);
  const auto moment = carried_moment_nm(drawn.robot, angles);
  for (std::size_t j = 0; j < 2; ++j)
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(moment[j][k], moment_nm(drawn.robot, j, Vector3d::Unit(k), angles), 1e-6);
  const auto gives = [&](std::size_t axis) {
    const ArmModel arm(drawn.robot, drawn.tool);
    return std::ranges::count_if(arm.parameters(), [&](const ArmParameter& one) {
      return one.carrier == static_cast<int>(axis) && one.axis >= int(AxisError::kCompliance);
    });
  };
  EXPECT_EQ(gives(0), 3);
  EXPECT_EQ(gives(1), 3);
  drawn.robot.positioner[0].mass_kg = 0.0;
  EXPECT_EQ(gives(0), 3) << "the second axis loads the first";
  drawn.robot.positioner[1].mass_kg = 0.0;
  EXPECT_EQ(gives(0) + gives(1), 0);
}

TEST(Positioner, DerivativesOfTipAndRotationAgreeWithDifferences) {
  Random random(2);
  for (int k = 0; k < kDrawn; ++k) {
    const auto drawn = beside_positioner(random);
    const ArmModel arm(drawn.robot, drawn.tool);
    const JointVector q = testing::random_joints(drawn.robot, random);
    const std::vector<double> all = random_angles(random);
    const PreparedPose pose =
        arm.prepare(q, 0, nullptr, std::span(all).first(static_cast<std::size_t>(random.below(3))));
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

TEST(Positioner, DoesNotMoveTheArmInItsBase) {
  Random random(3);
  const auto drawn = beside_positioner(random);
  Robot alone = drawn.robot;
  alone.positioner.clear();
  const ArmModel arm(drawn.robot, drawn.tool), bare(alone, drawn.tool);
  ASSERT_EQ(arm.size(), bare.size() + 2 * kAxisErrors);
  const Eigen::VectorXd x = testing::random_errors(arm, random, 3.0);
  const JointVector q = testing::random_joints(drawn.robot, random);
  Eigen::Matrix3Xd with(3, arm.size()), without(3, bare.size());
  EXPECT_EQ(arm.position(arm.prepare(q), x.data(), with),
            bare.position(bare.prepare(q), x.data(), without));
  EXPECT_EQ(with.leftCols(bare.size()), without);
  EXPECT_TRUE(with.rightCols(2 * kAxisErrors).isZero(0.0));
}

TEST(Positioner, HasAParameterWhereAPriorIsStated) {
  Random random(4);
  auto drawn = beside_positioner(random);
  drawn.robot.positioner[0].scale_sigma = 0.0;
  drawn.robot.positioner[1].place_sigma_m = 0.0;
  drawn.robot.positioner[0].compliance_sigma_rad_per_nm = 0.0;
  drawn.robot.positioner[1].bearing_sigma_rad_per_nm = 0.0;
  Cell cell;
  cell.robot = drawn.robot;
  const ArmModel arm(drawn.robot, drawn.tool);
  std::vector<std::string> names;
  for (const ArmParameter& parameter : arm.parameters()) {
    if (parameter.kind != ParameterKind::kPositioner) continue;
    names.push_back(parameter_name(cell, parameter));
    EXPECT_EQ(parameter_key(cell, names.back()), static_cast<const ParameterKey&>(parameter));
  }
  EXPECT_EQ(names, (std::vector<std::string>{"E1.x", "E1.y", "E1.rx", "E1.ry", "E1.bearing_x",
                                             "E1.bearing_y", "E2.rx", "E2.ry", "E2.scale",
                                             "E2.compliance"}));
  EXPECT_FALSE(parameter_key(cell, "E3.x"));
  EXPECT_FALSE(parameter_key(cell, "E1.z"));
}

TEST(Positioner, RefusesAnglesOfAxesThatAreAbsent) {
  Random random(5);
  auto drawn = beside_positioner(random);
  const JointVector q = testing::random_joints(drawn.robot, random);
  const std::vector<double> three(3, 0.0);
  EXPECT_THROW(ArmModel(drawn.robot, drawn.tool).prepare(q, 0, nullptr, three),
               std::invalid_argument);
  Touch touch;
  Target target;
  EXPECT_TRUE(carrier_rad(touch, target).empty());
  target.carried_by = 1;
  EXPECT_THROW(carrier_rad(touch, target), std::invalid_argument);
  touch.positioner_rad = {0.3, 0.4};
  ASSERT_EQ(carrier_rad(touch, target).size(), 1u);
  EXPECT_EQ(carrier_rad(touch, target)[0], 0.3);
  drawn.robot.positioner.resize(3, drawn.robot.positioner[0]);
  EXPECT_THROW(ArmModel(drawn.robot, drawn.tool), std::invalid_argument);
}

TEST(Positioner, WhatIsNotPossibleWithItIsRefusedByName) {
  Robot robot;
  EXPECT_NO_THROW(refuse_external_axes(robot, "a check", "Do without."));
  robot.positioner.resize(1);
  robot.positioner[0].name = "E1";
  try {
    refuse_external_axes(robot, "a check", "Do without.");
    ADD_FAILURE();
  } catch (const PositionerError& error) {
    EXPECT_STREQ(error.what(),
                 "a check is not possible yet for an arm with a positioner (E1). Do without.");
  }
}

}  // namespace
}  // namespace cellcal::calib
