// Plans for an arm on a linear unit, which is an axis of motion within its limits.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "calib/model/error.h"
#include "calib/model/kinematics.h"
#include "calib/model/linear.h"
#include "calib/plan/bodies.h"
#include "calib/plan/clearance.h"
#include "calib/plan/plan.h"
#include "calib/plan/pool.h"
#include "calib/plan/track.h"
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

TEST(LinearUnitPlan, LeavesAContactWhereTheUnitStandsAndTravelsAfterwards) {
  const Cell cell = track_cell();
  PlanOptions options;
  options.fit_touches = 4;
  options.check_touches = 0;
  const Plan plan = make_plan(cell, options);
  const PlannedTouch& near = plan.touches[1];
  // The unit was moved by something else while the tip was in contact.
  JointVector from = near.standoff;
  for (std::size_t i = 0; i < from.size(); ++i) from[i] += 0.55 * (near.end[i] - near.standoff[i]);
  from[0] += 0.002;
  const PlannedTouch resumed = resume_plan(cell, plan, 2, from, false).touches[2];
  ASSERT_GE(resumed.transit.size(), 2u);
  JointVector out = near.clear;
  out[0] = from[0];
  EXPECT_EQ(resumed.transit.front(), out);
  EXPECT_EQ(resumed.transit.back(), plan.touches[2].standoff);
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
    // Searches are made by the arm: the unit is stationary.
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
      EXPECT_TRUE(clearance.clear(*at, next));
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
  EXPECT_TRUE(clearance.clear(q));
  EXPECT_TRUE(clearance.clear(beyond));
  const auto hit = clearance.hit(q, beyond);
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

TEST(LinearUnitPlan, SearchesFartherTheFartherTheCarriageIsFromThePlace) {
  const Cell cell = track_cell();
  PlanOptions options;
  options.fit_touches = 24;
  options.check_touches = 0;
  const TrackOff unit(cell.robot);
  double longest = 0.0, shortest = 1.0;
  for (const PlannedTouch& touch : make_plan(cell, options).touches) {
    const Eigen::Vector3d& centre = cell.targets[cell.target_index(touch.target)].centre_m;
    // The track extends along y from the origin of the base frame.
    const double way = touch.end[0] - std::clamp(centre.y(), 0.0, 3.0);
    const double lever = (centre - Eigen::Vector3d(0.0, touch.end[0], 0.0)).norm();
    const LinearGuide& guide = *cell.robot.joints[0].guide;
    const double off = 3.0 * std::sqrt(std::pow(way * guide.direction_sigma_rad, 2) +
                                       std::pow(way * guide.turn_sigma_rad_m * lever, 2) +
                                       2.0 * std::pow(guide.straightness_sigma_m, 2) +
                                       2.0 * std::pow(guide.turn_sigma_rad * lever, 2));
    EXPECT_NEAR(touch.expected_m, std::hypot(options.standoff_m, off), 1e-9);
    EXPECT_NEAR(touch.search_m, 2.0 * touch.expected_m, 1e-9);
    longest = std::max(longest, touch.expected_m);
    shortest = std::min(shortest, touch.expected_m);
  }
  EXPECT_GT(longest, 1.1 * shortest);
  EXPECT_LT(longest, 0.030);
}

TEST(LinearUnitPlan, AnArmOnItsFootKeepsTheUsualDistances) {
  Robot robot = track_cell().robot;
  robot.joints.erase(robot.joints.begin());
  const TrackOff none(robot);
  EXPECT_FALSE(none.any());
  EXPECT_EQ(none.widened_m(0.012, {1.0, 2.0, 0.5}, JointVector(6, 0.3)), 0.012);
}

TEST(LinearUnitPlan, WhatMarginsWidenByIsConvexAlongTheTrack) {
  const TrackOff unit(track_cell().robot);
  Random random(5);
  for (int k = 0; k < 300; ++k) {
    const auto place = unit.place(
        {random.uniform(-1.5, 1.5), random.uniform(-1.0, 4.0), random.uniform(-0.5, 1.5)});
    const double a = random.uniform(0.0, 3.0), b = random.uniform(0.0, 3.0);
    const auto margin = [&](double at) { return std::hypot(0.011, unit.off_m(place, at)); };
    EXPECT_LE(margin((a + b) / 2.0), (margin(a) + margin(b)) / 2.0 + 1e-12);
  }
}

TEST(LinearUnitPlan, TheTipKeepsFartherFromASphereThatTheCarriageIsFarFrom) {
  Cell cell = track_cell();
  cell.targets.resize(1);
  cell.lengths.clear();
  const ArmModel arm = planning_arm(cell);
  // The sphere 13 mm before the tip of a posture.
  JointVector q = middle_posture(cell.robot);
  const auto is_clear = [&](double carriage_m, bool known) {
    q[0] = carriage_m;
    const Eigen::Isometry3d tcp = arm.nominal_tcp(q), flange = tcp * cell.tool.tcp.inverse();
    Cell there = cell;
    if (known) there.robot.joints[0].guide = LinearGuide{cell.robot.joints[0].guide->along};
    there.targets[0].centre_m =
        tcp.translation() +
        (0.013 + 0.03) * (tcp.translation() - flange.translation()).normalized();
    there.targets[0].has_stand = false;
    return Clearance(there, arm).clear(q);
  };
  EXPECT_TRUE(is_clear(1.5, true));
  EXPECT_TRUE(is_clear(1.5, false)) << "the arm reaches forward: the carriage is opposite";
  q[1] = 0.8;  // turned aside
  EXPECT_TRUE(is_clear(1.5, true));
  EXPECT_FALSE(is_clear(1.5, false));
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
  EXPECT_THROW(suggest_spheres(cell, {}, 4), LinearUnitError);
}

}  // namespace
}  // namespace cellcal::calib
