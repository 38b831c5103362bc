// Plans for an arm on a linear unit: it is an axis of motion within its limits.

#include <gtest/gtest.h>

#include <algorithm>

#include "calib/model/error.h"
#include "calib/model/kinematics.h"
#include "calib/model/linear.h"
#include "calib/plan/bodies.h"
#include "calib/plan/clearance.h"
#include "calib/plan/finder.h"
#include "calib/plan/plan.h"
#include "calib/plan/pool.h"
#include "calib/plan/suggest_spheres.h"
#include "tests/calib/track_cell.h"

namespace cellcal::calib {
namespace {

Cell track_cell() { return testing::track_cell(CELLCAL_TRACK_ROBOT); }

std::vector<JointVector> postures_of(const Plan& plan) {
  std::vector<JointVector> all = {plan.start};
  for (const PlannedTouch& touch : plan.touches) {
    all.insert(all.end(), touch.transit.begin(), touch.transit.end());
    all.insert(all.end(), {touch.standoff, touch.end, touch.clear});
  }
  all.insert(all.end(), plan.home.begin(), plan.home.end());
  return all;
}

TEST(LinearUnitPlan, MovesTheUnitWithinItsLimitsAndOverMostOfItsStroke) {
  Cell cell = track_cell();
  cell.robot.joints[0].min_rad = 0.4;
  cell.robot.joints[0].max_rad = 2.5;
  PlanOptions options;
  options.fit_touches = 24;
  options.check_touches = 4;
  const Plan plan = make_plan(cell, options);
  ASSERT_EQ(plan.touches.size(), 28u);
  for (const JointVector& q : postures_of(plan)) {
    ASSERT_EQ(q.size(), 7u);
    for (std::size_t i = 0; i < q.size(); ++i) {
      EXPECT_GE(q[i], cell.robot.joints[i].min_rad);
      EXPECT_LE(q[i], cell.robot.joints[i].max_rad);
    }
  }
  double least = 3.0, most = 0.0;
  for (const PlannedTouch& touch : plan.touches) {
    least = std::min(least, touch.standoff[0]);
    most = std::max(most, touch.standoff[0]);
    // A search is the arm's: the unit stands still.
    EXPECT_EQ(touch.standoff[0], touch.end[0]);
    EXPECT_EQ(touch.standoff[0], touch.clear[0]);
  }
  EXPECT_GT(most - least, 1.2);
}

TEST(LinearUnitPlan, EveryMoveIsClearWithTheArmWhereTheCarriageIs) {
  const Cell cell = track_cell();
  PlanOptions options;
  options.fit_touches = 16;
  options.check_touches = 0;
  const Plan plan = make_plan(cell, options);
  const ArmModel arm = planning_arm(cell);
  const Clearance clearance(cell, arm);
  const JointVector* at = &plan.start;
  for (const PlannedTouch& touch : plan.touches) {
    for (const JointVector& next : touch.transit) {
      EXPECT_TRUE(clearance.clear(*at, next, 0.009));
      at = &next;
    }
    at = &touch.clear;
  }
}

TEST(LinearUnitPlan, ReachesWhatTheArmAloneDoesNot) {
  Cell cell = track_cell();
  PlanOptions options;
  options.fit_touches = 12;
  options.check_touches = 0;
  EXPECT_NO_THROW(make_plan(cell, options));
  cell.robot.joints[0].max_rad = 0.1;
  EXPECT_THROW(make_plan(cell, options), PlanError);
}

TEST(LinearUnitPlan, TheColumnThatTheUnitMovesKeepsClearOfTheCell) {
  Cell cell = track_cell();
  Obstacle post;
  post.id = "post";
  post.frame.translation() = Eigen::Vector3d(0.0, 1.5, 0.4);
  post.size_m = Eigen::Vector3d(0.1, 0.1, 0.8);
  cell.obstacles.push_back(post);
  const ArmModel arm = planning_arm(cell);
  const Clearance clearance(cell, arm);
  JointVector q = middle_posture(cell.robot);
  q[0] = 0.2;
  JointVector beyond = q;
  beyond[0] = 2.8;
  EXPECT_TRUE(clearance.clear(q, 0.0));
  EXPECT_TRUE(clearance.clear(beyond, 0.0));
  const auto hit = clearance.hit(q, beyond, 0.0);
  ASSERT_TRUE(hit);
  EXPECT_NE(words(*hit).find("post"), std::string::npos);
}

TEST(LinearUnitPlan, NoBodyMovesFartherThanItsLeversSay) {
  const Cell cell = track_cell();
  const ArmModel arm = planning_arm(cell);
  const Bodies bodies(arm);
  Random random(1);
  std::vector<Segment> before, after;
  for (int k = 0; k < 200; ++k) {
    JointVector q;
    for (const Joint& joint : cell.robot.joints)
      q.push_back(random.uniform(joint.min_rad, joint.max_rad));
    JointVector to = q;
    for (double& value : to) value += random.uniform(-0.05, 0.05);
    bodies.place(q, before);
    bodies.place(to, after);
    for (std::size_t b = 0; b < before.size(); ++b) {
      double bound = 0.0;
      for (std::size_t i = 0; i < q.size(); ++i)
        bound += std::abs(to[i] - q[i]) * bodies.list()[b].lever[i];
      EXPECT_LE((after[b].a - before[b].a).norm(), bound + 1e-12) << bodies.list()[b].words;
      EXPECT_LE((after[b].b - before[b].b).norm(), bound + 1e-12) << bodies.list()[b].words;
    }
  }
}

TEST(LinearUnitPlan, NeedsItsSpeed) {
  Cell cell = track_cell();
  cell.robot.joints[0].max_speed_rad_s = 0.0;
  try {
    make_plan(cell, {});
    FAIL();
  } catch (const PlanError& e) {
    EXPECT_EQ(e.joint, "E1");
    EXPECT_NE(std::string(e.what()).find("max_speed_mm_s"), std::string::npos) << e.what();
  }
}

TEST(LinearUnitPlan, WhatCannotMoveItYetRefusesIt) {
  const Cell cell = track_cell();
  EXPECT_THROW(Finder(cell, {}, false, {}), LinearUnitError);
  EXPECT_THROW(suggest_spheres(cell, {}, 4), LinearUnitError);
}

}  // namespace
}  // namespace cellcal::calib
