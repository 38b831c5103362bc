// Touches of a qualification.

#include <gtest/gtest.h>

#include <set>

#include "calib/model/kinematics.h"
#include "calib/plan/check_plan.h"
#include "calib/plan/pool.h"
#include "tests/calib/simulate.h"
#include "tests/calib/thrown.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;

constexpr double kSpeeds[] = {0.010, 0.005, 0.010};

PlanOptions options() { return {}; }

TEST(QualificationPlans, VisitsFewPlacesOfOneSphereAtEachSpeedInTurn) {
  const Plan plan = make_qualification_plan(demo_cell(), options(), "S3", 6, kSpeeds);
  ASSERT_EQ(plan.touches.size(), 18u);
  std::set<JointVector> places;
  for (std::size_t i = 0; i < plan.touches.size(); ++i) {
    const PlannedTouch& touch = plan.touches[i];
    EXPECT_EQ(touch.target, "S3");
    EXPECT_EQ(touch.set, TouchSet::kFit);
    EXPECT_DOUBLE_EQ(touch.search_m_s, kSpeeds[i % 3]);
    places.insert(touch.end);
    if (i % 3 == 0) continue;
    EXPECT_EQ(touch.end, plan.touches[i - 1].end);
    EXPECT_EQ(touch.transit, std::vector<JointVector>{touch.standoff}) << "back on the same line";
    EXPECT_TRUE(touch.corners.empty());
  }
  EXPECT_EQ(places.size(), 6u);
  EXPECT_FALSE(plan.home.empty());
}

TEST(QualificationPlans, IsAllAroundTheSphere) {
  const Plan plan = make_qualification_plan(demo_cell(), options(), "S1", 6, kSpeeds);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const PlannedTouch& touch : plan.touches) sum += touch.normal;
  EXPECT_LT(sum.norm() / static_cast<double>(plan.touches.size()), 0.8);
}

TEST(QualificationPlans, KeepsClearOfTheSpheresThatItDoesNotTouch) {
  const Cell& cell = demo_cell();
  const Plan plan = make_qualification_plan(cell, options(), "S1", 6, kSpeeds);
  const ArmModel arm = planning_arm(cell);
  const Clearance clearance(cell, arm);
  JointVector at = plan.start;
  for (const PlannedTouch& touch : plan.touches) {
    for (const JointVector& waypoint : touch.transit) {
      EXPECT_FALSE(clearance.hit(at, waypoint)) << touch.target;
      at = waypoint;
    }
    at = touch.clear;
  }
}

TEST(QualificationPlans, TakesTheFirstSphereWhereNoneIsNamedAndNamesThoseThatThereAre) {
  EXPECT_EQ(qualification_target(demo_cell(), ""), demo_cell().targets.front().id);
  const auto error =
      testing::thrown<PlanError>([] { (void)qualification_target(demo_cell(), "S9"); });
  EXPECT_EQ(error.kind, PlanError::Kind::kRequest);
  EXPECT_EQ(error.target, "S9");
  EXPECT_STREQ(error.what(),
               "target S9: no sphere with centre_mm of that name. There are: S1, S2, S3, S4");
  Cell unknown = demo_cell();
  for (Target& target : unknown.targets) target.has_centre = false;
  EXPECT_EQ(testing::thrown<PlanError>([&] { (void)qualification_target(unknown, ""); }).kind,
            PlanError::Kind::kCell);
}

}  // namespace
}  // namespace cellcal::calib
