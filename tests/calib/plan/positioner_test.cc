// Plans for a cell with a positioner: touches at several of its settings.

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "calib/model/error.h"
#include "calib/model/kinematics.h"
#include "calib/plan/cell_check.h"
#include "calib/plan/clearance.h"
#include "calib/plan/online.h"
#include "calib/plan/plan.h"
#include "calib/plan/pool.h"
#include "calib/plan/positioner_plan.h"
#include "tests/calib/positioner_cell.h"

namespace cellcal::calib {
namespace {

Cell with_positioner() { return testing::positioner_cell(CELLCAL_POSITIONER_ROBOT); }

PlanOptions few_beside_it() {
  PlanOptions options;
  options.fit_touches = 24;
  options.check_touches = 4;
  return options;
}

const Plan& planned() {
  static const Plan plan = make_plan(with_positioner(), few_beside_it());
  return plan;
}

TEST(PositionerPlan, TouchesAtSeveralSettingsWithinTheLimits) {
  const Cell cell = with_positioner();
  ASSERT_EQ(planned().touches.size(), 28u);
  EXPECT_TRUE(planned().left_out.empty());
  std::set<std::vector<double>> settings;
  double least[2] = {9.0, 9.0}, most[2] = {-9.0, -9.0};
  for (const PlannedTouch& touch : planned().touches) {
    ASSERT_EQ(touch.positioner_rad.size(), 2u);
    settings.insert(touch.positioner_rad);
    for (std::size_t j = 0; j < 2; ++j) {
      EXPECT_GE(touch.positioner_rad[j], cell.robot.positioner[j].min_rad);
      EXPECT_LE(touch.positioner_rad[j], cell.robot.positioner[j].max_rad);
      least[j] = std::min(least[j], touch.positioner_rad[j]);
      most[j] = std::max(most[j], touch.positioner_rad[j]);
    }
  }
  EXPECT_GE(settings.size(), 4u);
  EXPECT_GT(most[0] - least[0], 0.8);
  EXPECT_GT(most[1] - least[1], 2.0);
}

TEST(PositionerPlan, TheTipMeetsItsSphereWhereThePositionerHasIt) {
  const Cell cell = with_positioner();
  const ArmModel arm = planning_arm(cell);
  for (const PlannedTouch& touch : planned().touches) {
    const Target& target = cell.targets[cell.target_index(touch.target)];
    const auto carriers =
        std::span(touch.positioner_rad).first(static_cast<std::size_t>(target.carried_by));
    const Eigen::Vector3d tip = arm.nominal_tip_m(touch.standoff, 0, carriers);
    EXPECT_NEAR((tip - target.centre_m).norm(), target.diameter_m / 2.0 + touch.expected_m, 1e-6);
  }
}

TEST(PositionerPlan, TheAxesStandDuringATouchAndTurnWhileTheArmWaits) {
  const Cell cell = with_positioner();
  const std::vector<double>* last = nullptr;
  JointVector at = planned().start;
  int turns = 0;
  for (const PlannedTouch& touch : planned().touches) {
    const bool turned = last != nullptr && *last != touch.positioner_rad;
    EXPECT_EQ(turned, !touch.wait.empty());
    turns += turned;
    const ArmModel arm = planning_arm(at_setting(cell, touch.positioner_rad));
    if (turned) {
      const Clearance before(at_setting(cell, *last), arm);
      for (const JointVector& next : touch.wait) {
        EXPECT_TRUE(before.clear(at, next));
        at = next;
      }
      EXPECT_EQ(at, planned().start);
    }
    const Clearance clearance(at_setting(cell, touch.positioner_rad), arm);
    for (const JointVector& next : touch.transit) {
      EXPECT_TRUE(clearance.clear(at, next));
      at = next;
    }
    at = touch.clear;
    last = &touch.positioner_rad;
  }
  EXPECT_GE(turns, 3);
}

TEST(PositionerPlan, SearchesFartherTheFartherThePositionerIsFromWhereItsSpheresWereTaught) {
  double at_zero_m = 0.0, farthest_m = 0.0;
  for (const PlannedTouch& touch : planned().touches) {
    EXPECT_NEAR(touch.expected_m, touch.search_m / 2.0, 1e-9);
    const bool zero = touch.positioner_rad == std::vector<double>{0.0, 0.0};
    (zero ? at_zero_m : farthest_m) = std::max(zero ? at_zero_m : farthest_m, touch.search_m);
  }
  EXPECT_NEAR(at_zero_m, 0.024, 1e-9);
  EXPECT_GT(farthest_m, 0.036);
  EXPECT_LT(farthest_m, 0.054);
}

TEST(PositionerPlan, IsTheSameForTheSameSeed) {
  PlanOptions options = few_beside_it();
  options.fit_touches = 12;
  options.check_touches = 0;
  const Plan one = make_plan(with_positioner(), options),
             two = make_plan(with_positioner(), options);
  ASSERT_EQ(one.touches.size(), two.touches.size());
  for (std::size_t i = 0; i < one.touches.size(); ++i) {
    EXPECT_EQ(one.touches[i].standoff, two.touches[i].standoff);
    EXPECT_EQ(one.touches[i].positioner_rad, two.touches[i].positioner_rad);
  }
}

TEST(PositionerPlan, OfOneAxisTurnsIt) {
  Cell cell = with_positioner();
  // Only the table, upright.
  cell.robot.positioner.erase(cell.robot.positioner.begin());
  cell.robot.positioner[0].frame = Eigen::Translation3d(1.05, 0.0, 0.55);
  for (Target& target : cell.targets) target.carried_by = std::min(target.carried_by, 1);
  PlanOptions options = few_beside_it();
  options.fit_touches = 15;
  options.check_touches = 0;
  const Plan plan = make_plan(cell, options);
  std::set<double> angles;
  for (const PlannedTouch& touch : plan.touches) angles.insert(touch.positioner_rad.at(0));
  EXPECT_GE(angles.size(), 3u);
}

TEST(PositionerPlan, NamesASphereThatNoSettingBringsIntoReach) {
  Cell cell = with_positioner();
  cell.targets[1].centre_m = Eigen::Vector3d(0.0, 0.0, 3.0);
  try {
    make_plan(cell, few_beside_it());
    ADD_FAILURE();
  } catch (const PlanError& error) {
    EXPECT_EQ(error.target, cell.targets[1].id);
  }
}

TEST(PositionerPlan, TheCellCheckLooksAtEverySetting) {
  Cell sound = with_positioner();
  sound.robot.positioner[1].mass_kg = 50.0;
  for (Target& target : sound.targets) target.centre_sigma_m = 0.005;
  EXPECT_TRUE(faults_of(sound).empty());
  Cell far = with_positioner();
  far.targets[1].centre_m = Eigen::Vector3d(0.0, 0.0, 3.0);
  far.lengths.clear();
  const std::vector<CellFault> faults = faults_of(far);
  ASSERT_FALSE(faults.empty());
  EXPECT_EQ(faults[0].kind, CellFaultKind::kOutOfReach);
  EXPECT_EQ(faults[0].ids.at(0), far.targets[1].id);
  Cell wrong = with_positioner();
  wrong.lengths[0].length_m *= 1.2;
  EXPECT_FALSE(faults_of(wrong).empty());
}

TEST(PositionerPlan, AtASettingAllIsInTheBase) {
  Cell cell = with_positioner();
  Obstacle plate;
  plate.id = "plate";
  plate.carried_by = 1;
  plate.frame = Eigen::Translation3d(0.0, -0.1, 0.0);
  cell.obstacles.push_back(plate);
  const Cell still = at_setting(cell, {0.5, -1.0});
  EXPECT_TRUE(still.robot.positioner.empty());
  const Eigen::Isometry3d table = carried_at(cell.robot, std::vector<double>{0.5, -1.0});
  EXPECT_LT((still.targets[0].centre_m - table * cell.targets[0].centre_m).norm(), 1e-15);
  EXPECT_LT((still.targets[0].stand_up - table.linear().col(2)).norm(), 1e-12);
  EXPECT_EQ(still.targets[3].centre_m, cell.targets[3].centre_m);
  EXPECT_TRUE(still.obstacles.back().frame.isApprox(
      carried_at(cell.robot, std::vector<double>{0.5}) * plate.frame, 1e-12));
}

/// Index of the first touch after a turn.
std::size_t first_turned() {
  std::size_t k = 0;
  while (planned().touches.at(k).wait.empty()) ++k;
  return k;
}

JointVector part_way(const JointVector& a, const JointVector& b, double share) {
  JointVector q = a;
  for (std::size_t i = 0; i < q.size(); ++i) q[i] += share * (b[i] - a[i]);
  return q;
}

TEST(PositionerPlan, ResumedInContactTheArmLeavesItAndWaitsBeforeThePositionerTurns) {
  const Cell cell = with_positioner();
  const std::size_t next = first_turned();
  const PlannedTouch& last = planned().touches[next - 1];
  const Plan resumed = resume_plan(cell, planned(), next, part_way(last.standoff, last.end, 0.55),
                                   true, last.positioner_rad);
  const PlannedTouch& touch = resumed.touches[next];
  ASSERT_GE(touch.wait.size(), 2u);
  EXPECT_EQ(touch.wait.front(), last.clear);
  EXPECT_EQ(touch.wait.back(), planned().start);
  EXPECT_EQ(touch.wait_rad, last.positioner_rad);
  EXPECT_EQ(touch.transit.back(), touch.standoff);
  const ArmModel arm = planning_arm(at_setting(cell, touch.positioner_rad));
  const auto expect_clear = [&](const std::vector<double>& setting, JointVector at,
                                const std::vector<JointVector>& way) {
    const Clearance clearance(at_setting(cell, setting), arm);
    for (const JointVector& waypoint : way) {
      EXPECT_TRUE(clearance.clear(at, waypoint));
      at = waypoint;
    }
  };
  expect_clear(last.positioner_rad, last.clear, touch.wait);
  expect_clear(touch.positioner_rad, planned().start, touch.transit);
}

TEST(PositionerPlan, ResumedBetweenTwoSettingsItTurnsOnFromThere) {
  const std::size_t next = first_turned();
  const PlannedTouch& touch = planned().touches[next];
  const std::vector<double> halfway =
      part_way(planned().touches[next - 1].positioner_rad, touch.positioner_rad, 0.5);
  const Plan resumed =
      resume_plan(with_positioner(), planned(), next, planned().start, false, halfway);
  EXPECT_EQ(resumed.touches[next].wait_rad, halfway);
  EXPECT_EQ(resumed.touches[next].wait.back(), planned().start);
  EXPECT_EQ(resumed.touches[next].positioner_rad, touch.positioner_rad);
}

TEST(PositionerPlan, ResumedAtItsSettingItStaysAsItStands) {
  const std::size_t turned = first_turned();
  std::vector<double> stands = planned().touches[0].positioner_rad;
  stands[1] += 0.002;
  const Plan resumed = resume_plan(with_positioner(), planned(), 0, planned().start, false, stands);
  EXPECT_TRUE(resumed.touches[0].wait.empty());
  for (std::size_t k = 0; k < turned; ++k) EXPECT_EQ(resumed.touches[k].positioner_rad, stands);
  EXPECT_EQ(resumed.touches[turned].wait_rad, stands);
  EXPECT_EQ(resumed.touches[turned].positioner_rad, planned().touches[turned].positioner_rad);
  stands[1] += 0.002;
  EXPECT_FALSE(resume_plan(with_positioner(), planned(), 0, planned().start, false, stands)
                   .touches[0]
                   .wait.empty());
}

/// A pin on the last axis' table, where the waiting tool is at this setting.
Cell with_pin_at(const std::vector<double>& setting, const JointVector& rest) {
  Cell cell = with_positioner();
  const ArmModel arm = planning_arm(at_setting(cell, setting));
  Obstacle pin;
  pin.id = "pin";
  pin.shape = ObstacleShape::kCylinder;
  pin.diameter_m = 0.012;
  pin.height_m = 0.04;
  pin.carried_by = 2;
  pin.frame =
      carried_at(cell.robot, setting).inverse() * Eigen::Translation3d(arm.nominal_tip_m(rest));
  cell.obstacles.push_back(pin);
  return cell;
}

TEST(PositionerPlan, APinThatTheTablesTurnTakesThroughTheWaitingToolIsSeenWhereverItPasses) {
  const JointVector rest = planned().start;
  const Cell usual = with_positioner();
  for (const double at : {0.31, 0.333, 0.345, 0.37}) {
    const Cell cell = with_pin_at({0.2, at}, rest);
    EXPECT_THROW(require_clear_turn(cell, {0.2, -1.0}, {0.2, 1.5}, rest), PlanError) << at;
    EXPECT_THROW(require_clear_turn(cell, {-0.3, at - 0.6}, {0.7, at + 0.6}, rest), PlanError);
    EXPECT_NO_THROW(require_clear_turn(cell, {0.2, at + 1.0}, {0.2, at + 1.4}, rest));
    EXPECT_NO_THROW(require_clear_turn(usual, {0.2, -1.0}, {0.2, 1.5}, rest));
  }
}

TEST(PositionerPlan, TheArmWaitsWhereNothingThatIsCarriedEverPasses) {
  const JointVector rest = waiting_posture(with_positioner());
  const Cell cell = with_pin_at({0.2, 0.333}, rest);
  const JointVector other = waiting_posture(cell);
  EXPECT_NE(other, rest);
  for (const double tilt : {-1.0, 0.0, 0.2, 1.0})
    EXPECT_NO_THROW(require_clear_turn(cell, {tilt, -3.0}, {tilt, 3.0}, other));
}

TEST(PositionerPlan, IsNotResumedWithoutThePositionersAngles) {
  EXPECT_THROW(resume_plan(with_positioner(), planned(), 0, planned().start, false), PlanError);
}

/// u95 predicted for a session, and the number of its touches.
Plan plan_to(double goal_m) {
  PlanOptions options;
  options.fit_touches = 60;
  options.check_touches = 0;
  options.goal_u95_m = goal_m;
  return make_plan(with_positioner(), options);
}

TEST(PositionerPlan, ToAGoalHasAsManyTouchesAsItTakes) {
  const Plan easy = plan_to(2e-3), missed = plan_to(1e-5);
  EXPECT_LE(easy.predicted_u95_m, 2e-3);
  EXPECT_FALSE(easy.missing);
  EXPECT_LT(easy.touches.size(), 60u);
  EXPECT_EQ(missed.touches.size(), 60u);
  EXPECT_GT(missed.predicted_u95_m, 1e-5);
  EXPECT_LT(missed.predicted_u95_m, easy.predicted_u95_m);
  EXPECT_TRUE(missed.missing.has_value());
}

TEST(PositionerPlan, NamesTheAxisThatKeepsItFromTheGoal) {
  const ArmModel arm(with_positioner());
  const std::vector<JointVector> postures(1, middle_posture(arm.robot()));
  std::vector<ParameterKey> keys;
  for (const ArmParameter& one : arm.parameters()) keys.push_back(one);
  const Eigen::MatrixXd moves = Eigen::MatrixXd::Ones(3, arm.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(arm.size(), arm.size());
  for (Eigen::Index i = 0; i < arm.size(); ++i)
    if (keys[static_cast<std::size_t>(i)].carrier == 1) covariance(i, i) = 1.0;
  const Eigen::VectorXd weight = Eigen::VectorXd::Ones(arm.size());
  const Missing missing = largest_part(arm, {postures, moves, covariance, keys, weight, 0.0});
  EXPECT_EQ(missing.source, UncertaintySource::kPlaces);
  EXPECT_EQ(missing.joint, "E2");
  EXPECT_NEAR(missing.share, 1.0, 1e-9);
  EXPECT_NE(words(phrase_of(missing)).find("place and direction of E2"), std::string::npos);
}

TEST(PositionerPlan, WhatPlansTouchByTouchRefusesIt) {
  const Cell cell = with_positioner();
  EXPECT_THROW(suggest_spheres(cell, {}, 4), PositionerError);
  EXPECT_THROW(Pool(cell, {}, 10), PositionerError);
}

}  // namespace
}  // namespace cellcal::calib
