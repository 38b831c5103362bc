// A plan is executable: limits, search lines, paths between them, counts.

#include "calib/plan/plan.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <map>

#include "calib/files/files.h"
#include "calib/plan/candidates.h"
#include "calib/plan/clearance.h"
#include "calib/plan/pool.h"
#include "calib/plan/track.h"
#include "tests/calib/plan/ways.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::along;
using testing::demo_cell;
using testing::gap_m;
using testing::nominal_arm;
using testing::smallest_gap_m;

/// Minimum clearance of the tip on a path.
constexpr double kNearestM = kMarginKept * kTipMarginM - 1e-9;

PlanOptions small() {
  PlanOptions options;
  options.fit_touches = 24;
  options.check_touches = 6;
  return options;
}

const Plan& plan() {
  static const Plan made = make_plan(demo_cell(), small());
  return made;
}

void expect_inside_limits(const Robot& robot, const JointVector& q, double margin) {
  ASSERT_EQ(q.size(), robot.joints.size());
  for (std::size_t i = 0; i < q.size(); ++i) {
    EXPECT_GE(q[i], robot.joints[i].min_rad + margin) << robot.joints[i].name;
    EXPECT_LE(q[i], robot.joints[i].max_rad - margin) << robot.joints[i].name;
  }
}

void expect_drivable(const Cell& cell, const PlanOptions& options, const Plan& made) {
  const ArmModel arm = nominal_arm(cell);
  JointVector at = made.start;
  for (std::size_t k = 0; k < made.touches.size(); ++k) {
    SCOPED_TRACE("touch " + std::to_string(k) + " of " + made.touches[k].target);
    const PlannedTouch& touch = made.touches[k];
    ASSERT_FALSE(touch.transit.empty());
    EXPECT_EQ(touch.transit.back(), touch.standoff);
    for (const JointVector& q : touch.transit)
      expect_inside_limits(cell.robot, q, options.limit_margin_rad);
    for (const JointVector* q : {&touch.end, &touch.clear})
      expect_inside_limits(cell.robot, *q, options.limit_margin_rad);
    EXPECT_GT(smallest_gap_m(cell, arm, at, touch.transit), kNearestM);
    at = touch.clear;
  }
  EXPECT_GT(smallest_gap_m(cell, arm, at, made.home), kNearestM);
}

TEST(Plan, HasTheTouchesThatWereAskedForOnEverySphere) {
  std::map<std::string, int> fit, check;
  for (const PlannedTouch& touch : plan().touches)
    ++(touch.set == TouchSet::kFit ? fit : check)[touch.target];
  int fits = 0, checks = 0;
  for (const auto& [id, count] : fit) {
    EXPECT_GE(count, 5) << id;  // fewer do not constrain a sphere
    fits += count;
  }
  for (const auto& [id, count] : check) checks += count;
  EXPECT_EQ(fit.size(), 4u);
  EXPECT_EQ(check.size(), 4u);
  EXPECT_EQ(fits, 24);
  EXPECT_EQ(checks, 6);
}

TEST(Plan, KeepsEveryAngleInsideTheLimitsAndTheTipOffEverySphere) {
  expect_drivable(demo_cell(), small(), plan());
}

TEST(Plan, StartsClearSearchesInwardAlongTheNormalAndEndsBeyondTheSurface) {
  const ArmModel arm = nominal_arm(demo_cell());
  const PlanOptions options = small();
  for (const PlannedTouch& touch : plan().touches) {
    SCOPED_TRACE(touch.target);
    const Target& target = demo_cell().targets[demo_cell().target_index(touch.target)];
    const auto tip = [&](const JointVector& q) -> Eigen::Vector3d {
      return arm.position(arm.prepare(q), nullptr) - target.centre_m;
    };
    const double radius = target.diameter_m / 2.0;
    EXPECT_NEAR(touch.normal.norm(), 1.0, 1e-12);
    EXPECT_NEAR(gap_m(demo_cell(), arm, touch.standoff), options.standoff_m, 1e-8);
    EXPECT_NEAR(gap_m(demo_cell(), arm, touch.end), -options.beyond_m, 1e-8);
    EXPECT_NEAR(gap_m(demo_cell(), arm, touch.clear), options.clear_m, 1e-8);
    EXPECT_LT((tip(touch.standoff) - (radius + options.standoff_m) * touch.normal).norm(), 1e-8);
    EXPECT_NEAR(touch.search_m, options.standoff_m + options.beyond_m, 1e-12);
    EXPECT_NEAR(touch.expected_m, options.standoff_m, 1e-12);
    // Inward throughout, and on the line: a joint-space move of a few degrees bends little.
    double last = options.standoff_m + 1e-9, off = 0.0;
    along(arm, touch.standoff, touch.end, [&](const JointVector& q) {
      const double gap = gap_m(demo_cell(), arm, q);
      EXPECT_LT(gap, last + 1e-9);
      last = gap;
      const Eigen::Vector3d t = tip(q);
      off = std::max(off, (t - t.dot(touch.normal) * touch.normal).norm());
    });
    EXPECT_LT(off, 1e-3);
  }
}

TEST(Plan, LeavesTheSurfaceStraightAway) {
  const ArmModel arm = nominal_arm(demo_cell());
  for (const PlannedTouch& touch : plan().touches) {
    double last = -1.0;
    along(arm, touch.end, touch.clear, [&](const JointVector& q) {
      const double gap = gap_m(demo_cell(), arm, q);
      EXPECT_GT(gap, last - 1e-9);
      last = gap;
    });
  }
}

/// How far an arm with errors drawn within their tolerances is off along the touches' normals, at most, with the
/// spheres where it met them in the middle posture.
double most_off_m(const Plan& made, const ArmModel& arm, const Robot& robot, Random& random) {
  std::vector<double> x;
  for (const ArmParameter& error : arm.parameters())
    x.push_back(error.kind <= ParameterKind::kBeta ? error.sigma * random.normal() : 0.0);
  const auto off = [&](const JointVector& q) -> Eigen::Vector3d {
    const PreparedPose pose = arm.prepare(q);
    return arm.position(pose, x.data()) - arm.position(pose, nullptr);
  };
  const Eigen::Vector3d taught = off(middle_posture(robot));
  double most_m = 0.0;
  for (const PlannedTouch& touch : made.touches)
    most_m = std::max(most_m, std::abs(touch.normal.dot(off(touch.standoff) - taught)));
  return most_m;
}

TEST(Plan, SearchesOfALargeArmAllowForHowFarOffItsTolerancesPutIt) {
  Cell large = demo_cell();
  for (Joint& joint : large.robot.joints) joint.tolerance_length_m *= 1.7;
  const double off_m = with_tolerances({}, large).arm_off_m;
  EXPECT_GT(off_m, 0.015);
  EXPECT_EQ(with_tolerances({}, demo_cell()).arm_off_m, 0.0);
  const PlanOptions options = small();
  const Plan made = make_plan(large, options);
  for (const PlannedTouch& touch : made.touches) {
    EXPECT_NEAR(touch.expected_m, std::hypot(options.standoff_m, off_m), 1e-12);
    EXPECT_NEAR(touch.search_m, 2.0 * touch.expected_m, 1e-12);
  }
  const ArmModel arm(large);
  Random random(3);
  int beyond_usual = 0;
  for (int n = 0; n < 200; ++n) {
    const double most_m = most_off_m(made, arm, large.robot, random);
    EXPECT_LT(most_m, made.touches.front().expected_m);
    beyond_usual += most_m > options.standoff_m;
  }
  EXPECT_GT(beyond_usual, 4);

  for (Joint& joint : large.robot.joints) joint.tolerance_length_m = 1.0;
  EXPECT_EQ(with_tolerances({}, large).arm_off_m, 0.025);
}

TEST(Plan, TouchesFromManySidesButNotThroughTheStand) {
  std::map<std::string, Eigen::Matrix3d> spread;
  std::map<std::string, int> count;
  for (const PlannedTouch& touch : plan().touches) {
    EXPECT_GT(touch.normal.z(), -0.35);
    if (!spread.contains(touch.target)) spread[touch.target].setZero();
    spread[touch.target] += touch.normal * touch.normal.transpose();
    ++count[touch.target];
  }
  for (auto& [id, matrix] : spread) {
    matrix /= count[id];
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(matrix).eigenvalues()[0], 0.03) << id;
  }
}

TEST(Candidates, AreAboveTheStandsWithoutGravityToo) {
  Cell weightless = demo_cell();
  weightless.robot.gravity_m_s2.setZero();
  const auto normals = [](const Cell& cell) {
    std::vector<Eigen::Vector3d> all;
    for (const Candidate& c : find_candidates(cell, planning_arm(cell), Clearance::blind(), {}, 8))
      all.push_back(c.normal);
    return all;
  };
  const std::vector<Eigen::Vector3d> all = normals(weightless);
  EXPECT_GT(all.size(), 16u);
  for (const Eigen::Vector3d& normal : all) EXPECT_GT(normal.z(), std::sin(-0.35) - 1e-12);
  EXPECT_EQ(all, normals(demo_cell()));
}

TEST(Plan, IsTheSameForTheSameSeedAndAnotherForAnother) {
  const auto joints = [](const Plan& made) {
    std::vector<JointVector> all = {made.start};
    for (const PlannedTouch& touch : made.touches) {
      all.insert(all.end(), touch.transit.begin(), touch.transit.end());
      all.push_back(touch.end);
    }
    return all;
  };
  EXPECT_EQ(joints(make_plan(demo_cell(), small())), joints(plan()));
  PlanOptions other = small();
  other.seed = 2;
  EXPECT_NE(joints(make_plan(demo_cell(), other)), joints(plan()));
}

TEST(Plan, PredictsBetterAccuracyForMoreTouches) {
  PlanOptions more = small();
  more.fit_touches = 60;
  EXPECT_LT(make_plan(demo_cell(), more).predicted_mean_m, 0.9 * plan().predicted_mean_m);
}

TEST(Plan, StartsWhereTheArmStands) {
  JointVector from = plan().start;
  from[0] += 0.2;
  const Plan made = make_plan(demo_cell(), small(), from);
  EXPECT_EQ(made.start, from);
  const ArmModel arm = nominal_arm(demo_cell());
  EXPECT_GT(smallest_gap_m(demo_cell(), arm, from, made.touches[0].transit), kNearestM);
  EXPECT_EQ(made.home.empty() ? from : made.home.back(), from);
}

TEST(Plan, WorksForASevenJointArm) {
  Cell cell;
  cell.robot = load_robot(CELLCAL_ROBOTS_FOLDER "/iiwa14.toml");
  cell.tool.tcp.translation() = Eigen::Vector3d(0.0, 0.0, 0.15);
  cell.tool.length_m = 0.15;
  cell.touch_sigma_m = 3e-5;
  cell.radius_offset_sigma_m = 3e-4;
  for (int i = 0; i < 2; ++i) {
    Target target;
    target.id = "S" + std::to_string(i + 1);
    target.diameter_m = 0.0381;
    target.diameter_sigma_m = 2e-6;
    target.has_centre = true;
    target.centre_m = Eigen::Vector3d(0.55, i == 0 ? -0.25 : 0.25, 0.35);
    target.centre_sigma_m = 0.01;
    cell.targets.push_back(target);
  }
  PlanOptions options;
  options.fit_touches = 16;
  options.check_touches = 4;
  const Plan made = make_plan(cell, options);
  EXPECT_EQ(made.touches.size(), 20u);
  expect_drivable(cell, options, made);
}

TEST(Plan, HangsFromTheCeilingToo) {
  Cell cell = demo_cell();
  cell.robot.gravity_m_s2 = -cell.robot.gravity_m_s2;
  for (const PlannedTouch& touch : make_plan(cell, small()).touches)
    EXPECT_LT(touch.normal.z(), 0.35);  // the stands are then above
}

}  // namespace
}  // namespace cellcal::calib
