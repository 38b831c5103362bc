// Refused plans with their reasons; resumed plans.

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "calib/model/inverse.h"
#include "calib/plan/candidates.h"
#include "calib/plan/clearance.h"
#include "calib/plan/plan.h"
#include "calib/plan/pool.h"
#include "tests/calib/plan/box.h"
#include "tests/calib/plan/ways.h"
#include "tests/calib/simulate.h"
#include "tests/calib/thrown.h"

namespace cellcal::calib {
namespace {

using testing::between;
using testing::box;
using testing::demo_cell;
using testing::gap_m;
using testing::nominal_arm;
using testing::smallest_gap_m;

constexpr double kNearestResumedM = 0.005;

PlanOptions sound_options() {
  PlanOptions options;
  options.fit_touches = 20;
  options.check_touches = 4;
  return options;
}

const Plan& sound_plan() {
  static const Plan made = make_plan(demo_cell(), sound_options());
  return made;
}

PlanError refusal(const Cell& cell, const PlanOptions& options = sound_options()) {
  return testing::thrown<PlanError>([&] { (void)make_plan(cell, options); });
}

void expect_named(const PlanError& error, const char* words) {
  EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
}

TEST(PlanRefusal, NamesASphereThatIsOutOfReachAmongOthers) {
  Cell cell = demo_cell();
  cell.targets[2].centre_m = {3.0, 0.0, 0.5};
  const PlanError error = refusal(cell);
  EXPECT_EQ(error.kind, PlanError::Kind::kOutOfReach) << error.what();
  EXPECT_EQ(error.target, "S3");
}

TEST(PlanRefusal, NamesALoneSphereThatIsOutOfReach) {
  Cell cell = demo_cell();
  cell.targets.resize(1);
  cell.lengths.clear();
  cell.targets[0].centre_m = {0.0, 0.0, 5.0};
  const PlanError error = refusal(cell);
  EXPECT_EQ(error.kind, PlanError::Kind::kOutOfReach) << error.what();
  EXPECT_EQ(error.target, "S1");
}

TEST(PlanRefusal, NamesASphereWithoutAPlace) {
  Cell cell = demo_cell();
  cell.targets[1].has_centre = false;
  const PlanError error = refusal(cell);
  EXPECT_EQ(error.kind, PlanError::Kind::kCell) << error.what();
  EXPECT_EQ(error.target, "S2");
}

TEST(PlanRefusal, NeedsASphere) {
  Cell cell = demo_cell();
  for (Target& target : cell.targets) target.kind = TargetKind::kWire;
  EXPECT_EQ(refusal(cell).kind, PlanError::Kind::kCell);
}

TEST(PlanRefusal, LeavesOutWhatNoTouchesCanBePlannedOfAndSaysSo) {
  Cell cell = demo_cell();
  cell.targets.push_back({});
  cell.targets.back().id = "P";
  cell.targets.back().kind = TargetKind::kPlane;
  cell.targets.push_back({});
  cell.targets.back().id = "L";
  cell.targets.back().kind = TargetKind::kTracker;
  const Plan made = make_plan(cell, sound_options());
  EXPECT_EQ(made.left_out, (std::vector<std::string>{"P", "L"}));
  EXPECT_EQ(made.touches.size(), sound_plan().touches.size());
  for (const PlannedTouch& touch : made.touches) EXPECT_EQ(touch.target.front(), 'S');
  EXPECT_TRUE(sound_plan().left_out.empty());
}

TEST(PlanRefusal, NamesTheJointWhoseSpeedTheRobotFileDoesNotState) {
  Cell cell = demo_cell();
  cell.robot.joints[3].max_speed_rad_s = 0.0;
  for (const PlanError& error : {refusal(cell), testing::thrown<PlanError>([&] {
                                   (void)resume_plan(cell, sound_plan(), 0, sound_plan().start,
                                                     false);
                                 })}) {
    EXPECT_EQ(error.kind, PlanError::Kind::kCell) << error.what();
    EXPECT_EQ(error.joint, "A4");
    expect_named(error, "joint A4 has no max_speed_deg_s");
  }
}

TEST(PlanRefusal, OfAnArmWithFiveJointsSaysHowManyItTakes) {
  Cell cell = demo_cell();
  cell.robot.joints.pop_back();
  const PlanError error = refusal(cell);
  EXPECT_EQ(error.kind, PlanError::Kind::kCell) << error.what();
  expect_named(error, "has 5 joints; touches are planned for arms of 6 or more");
}

TEST(PlanRefusal, NeedsAFitTouchAndNoNegativeChecks) {
  PlanOptions options = sound_options();
  options.fit_touches = 0;
  EXPECT_EQ(refusal(demo_cell(), options).kind, PlanError::Kind::kRequest);
  options = sound_options();
  options.check_touches = -1;
  EXPECT_EQ(refusal(demo_cell(), options).kind, PlanError::Kind::kRequest);
}

TEST(PlanRefusal, NamesSphereDirectionAndTheObstacleThatIsInTheWay) {
  Cell cell = demo_cell();
  // A hood over S3: reachable from all directions, clear from none.
  cell.obstacles = {box("hood", cell.targets[2].centre_m, {0.2, 0.2, 0.1})};
  const PlanError error = refusal(cell);
  EXPECT_EQ(error.kind, PlanError::Kind::kInTheWay);
  EXPECT_EQ(error.target, "S3");
  for (const char* words :
       {"sphere S3", "from direction (", "obstacle hood", "Move it or the obstacle"})
    expect_named(error, words);
}

TEST(PlanRefusal, OfAToolTooStoutForItsOwnSphereAsksForAnotherTool) {
  Cell cell = demo_cell();
  cell.tool.slim_length_m = 0.01;
  const PlanError error = refusal(cell);
  EXPECT_EQ(error.kind, PlanError::Kind::kInTheWay);
  for (const char* words : {"the tool's shaft", "sphere S1", "Mount a longer or slimmer tool"})
    expect_named(error, words);
}

TEST(PlanRefusal, IsNotNeededWhereTheArmCanRestBesideWhatIsInTheWay) {
  Cell cell = demo_cell();
  const ArmModel arm = nominal_arm(cell);
  const Eigen::Vector3d tip = arm.position(arm.prepare(sound_plan().start), nullptr);
  cell.obstacles = {box("lamp", tip, {0.02, 0.02, 0.02})};
  const Plan made = make_plan(cell, sound_options());
  EXPECT_NE(made.start, sound_plan().start);
  EXPECT_TRUE(Clearance(cell, nominal_arm(cell)).clear(made.start));
}

TEST(PlanRefusal, NamesWhatStandsWhereverTheArmCouldRest) {
  Cell cell = demo_cell();
  cell.lengths.clear();
  cell.targets.resize(2);  // the low ones, under a ceiling
  cell.obstacles = {box("ceiling", {0.3, 0.0, 1.25}, {2.8, 4.0, 0.7})};
  const PlanError error = refusal(cell);
  EXPECT_EQ(error.kind, PlanError::Kind::kInTheWay);
  EXPECT_EQ(error.target, "") << "the arm cannot even rest";
  expect_named(error, "obstacle ceiling");
}

TEST(PlanRefusal, NamesWhatStandsBetweenTheArmAndASphere) {
  Cell cell = demo_cell();
  // A wall between the resting posture and S4, with room for the arm after it, and an arm that
  // cannot fold to turn past its edge.
  cell.targets[1].centre_m = {1.06, -0.05, 0.33};
  cell.obstacles = {box("fence", {1.15, 0.20, 0.5}, {1.4, 0.01, 4.0})};
  cell.robot.joints[1].min_rad = -1.6;
  cell.robot.joints[2].max_rad = 2.3;
  const PlanError error = refusal(cell);
  EXPECT_EQ(error.kind, PlanError::Kind::kInTheWay);
  EXPECT_EQ(error.target, "S4");
  expect_named(error, "obstacle fence");
}

TEST(PlanRefusal, NamesWhatTheArmStandsTooCloseToToStart) {
  const PlanError error = testing::thrown<PlanError>(
      [] { (void)make_plan(demo_cell(), sound_options(), sound_plan().touches[0].end); });
  EXPECT_EQ(error.kind, PlanError::Kind::kArmStands);
  expect_named(error, ("sphere " + sound_plan().touches[0].target).c_str());
}

TEST(Resume, FromTheClearPointOfTheLastTouchGoesOnAsPlanned) {
  const ArmModel arm = nominal_arm(demo_cell());
  for (std::size_t next = 1; next < sound_plan().touches.size(); ++next) {
    SCOPED_TRACE(next);
    const JointVector& from = sound_plan().touches[next - 1].clear;
    const Plan resumed = resume_plan(demo_cell(), sound_plan(), next, from, false);
    EXPECT_EQ(resumed.touches[next].transit.back(), sound_plan().touches[next].standoff);
    EXPECT_GT(smallest_gap_m(demo_cell(), arm, from, resumed.touches[next].transit),
              kNearestResumedM);
    // Everything else is unchanged.
    EXPECT_EQ(resumed.touches.size(), sound_plan().touches.size());
    for (std::size_t k = 0; k < sound_plan().touches.size(); ++k) {
      EXPECT_EQ(resumed.touches[k].end, sound_plan().touches[k].end);
      if (k != next) {
        EXPECT_EQ(resumed.touches[k].transit, sound_plan().touches[k].transit);
      }
    }
  }
}

TEST(Resume, FromTheSearchLineOfTheNextTouchFirstBacksOutOfIt) {
  const ArmModel arm = nominal_arm(demo_cell());
  for (const std::size_t next : {0u, 7u, 15u}) {
    const PlannedTouch& touch = sound_plan().touches[next];
    const JointVector from = between(touch.standoff, touch.end, 0.6);  // almost in contact
    ASSERT_LT(gap_m(demo_cell(), arm, from), 0.002);
    const Plan resumed = resume_plan(demo_cell(), sound_plan(), next, from, false);
    const auto& way = resumed.touches[next].transit;
    ASSERT_GE(way.size(), 2u);
    EXPECT_EQ(way.front(), touch.clear);
    EXPECT_EQ(way.back(), touch.standoff);
    // Near the sphere the distance may only increase.
    double last = gap_m(demo_cell(), arm, from);
    testing::along(arm, from, way.front(), [&](const JointVector& q) {
      EXPECT_GE(gap_m(demo_cell(), arm, q), last - 1e-6);
      last = gap_m(demo_cell(), arm, q);
    });
    EXPECT_GT(smallest_gap_m(demo_cell(), arm, way.front(), {way.begin() + 1, way.end()}),
              kNearestResumedM);
  }
}

TEST(Resume, FromTheSearchLineOfTheTouchJustMadeFirstBacksOutOfIt) {
  for (const std::size_t next : {1u, 8u, 16u}) {
    const PlannedTouch& made = sound_plan().touches[next - 1];
    const Plan resumed =
        resume_plan(demo_cell(), sound_plan(), next, between(made.standoff, made.end, 0.55), false);
    EXPECT_EQ(resumed.touches[next].transit.front(), made.clear);
    EXPECT_EQ(resumed.touches[next].transit.back(), sound_plan().touches[next].standoff);
  }
}

TEST(Resume, FromAForeignPostureNearASphereIsRefused) {
  // On the search line of an earlier touch, neither this one nor the last.
  const PlannedTouch& foreign = sound_plan().touches[10];
  const JointVector from = between(foreign.standoff, foreign.end, 0.5);
  const PlanError error = testing::thrown<PlanError>(
      [&] { (void)resume_plan(demo_cell(), sound_plan(), 20, from, false); });
  EXPECT_EQ(error.kind, PlanError::Kind::kArmStands) << error.what();
}

/// The tip of the touch beside its sphere, 3 mm from it, 45 deg from the normal; empty: out of reach.
std::optional<JointVector> beside(const ArmModel& arm, const PlannedTouch& touch,
                                  double azimuth_rad) {
  const Target& sphere = demo_cell().targets[demo_cell().target_index(touch.target)];
  Eigen::Isometry3d pose = arm.nominal_tcp(touch.end);
  const Eigen::Vector3d across =
      Eigen::AngleAxisd(azimuth_rad, touch.normal) * touch.normal.unitOrthogonal();
  pose.translation() = sphere.centre_m +
                       (sphere.diameter_m / 2.0 + 0.003) * std::sqrt(0.5) * (touch.normal + across);
  return inverse(arm, pose, touch.end, 0.0);
}

/// Largest distance of a joint from the search at its nearest place.
double off_search_rad(const PlannedTouch& touch, const JointVector& at) {
  double least = 1.0;
  for (double share = 0.0; share <= 1.0; share += 0.05) {
    const JointVector on = between(touch.standoff, touch.end, share);
    double most = 0.0;
    for (std::size_t i = 0; i < at.size(); ++i) most = std::max(most, std::abs(at[i] - on[i]));
    least = std::min(least, most);
  }
  return least;
}

TEST(Resume, FromBesideTheSearchLineIsRefusedAndNotMovedAcrossTheSphere) {
  const ArmModel arm = planning_arm(demo_cell());
  int refused = 0;
  for (std::size_t next = 0; next < sound_plan().touches.size(); ++next)
    for (double azimuth = 0.0; azimuth < 6.0; azimuth += 1.0) {
      const PlannedTouch& touch = sound_plan().touches[next];
      const auto from = beside(arm, touch, azimuth);
      if (!from || off_search_rad(touch, *from) > 0.02) continue;
      const PlanError error = testing::thrown<PlanError>(
          [&] { (void)resume_plan(demo_cell(), sound_plan(), next, *from, false); });
      EXPECT_EQ(error.kind, PlanError::Kind::kArmStands) << error.what();
      ++refused;
    }
  EXPECT_GT(refused, 4);
}

TEST(Resume, FromASearchLineThatAnObstacleHasMovedBesideIsRefused) {
  const PlannedTouch& touch = sound_plan().touches[7];
  Cell cell = demo_cell();
  const ArmModel arm = planning_arm(cell);
  const Eigen::Isometry3d pose = arm.nominal_tcp(touch.end);
  const Eigen::Vector3d flange = pose.translation() - pose.linear() * cell.tool.tcp.translation();
  cell.obstacles.push_back(box("fence", flange, {0.05, 0.05, 0.05}));
  const PlanError error = testing::thrown<PlanError>([&] {
    (void)resume_plan(cell, sound_plan(), 7, between(touch.standoff, touch.end, 0.55), false);
  });
  EXPECT_EQ(error.kind, PlanError::Kind::kArmStands) << error.what();
}

TEST(Resume, InContactLeadsOutOfASearchAndIsRefusedElsewhere) {
  const PlannedTouch& touch = sound_plan().touches[7];
  const Plan resumed =
      resume_plan(demo_cell(), sound_plan(), 7, between(touch.standoff, touch.end, 0.6), true);
  EXPECT_EQ(resumed.touches[7].transit.front(), touch.clear);
  // Free by the cell file, and on the way to the stand-off: the contact is with what no file states.
  const JointVector& last = sound_plan().touches[6].clear;
  for (const JointVector& from : {between(last, touch.transit.front(), 0.5), sound_plan().start}) {
    const PlanError error = testing::thrown<PlanError>(
        [&] { (void)resume_plan(demo_cell(), sound_plan(), 7, from, true); });
    EXPECT_EQ(error.kind, PlanError::Kind::kArmStands);
    expect_named(error, "no clear way leads back along a search line. Jog it free");
  }
}

TEST(Resume, FromAFreePostureFarOffFindsAWay) {
  const ArmModel arm = nominal_arm(demo_cell());
  JointVector from = sound_plan().start;
  from[0] -= 0.3;
  const Plan resumed = resume_plan(demo_cell(), sound_plan(), 12, from, false);
  EXPECT_GT(smallest_gap_m(demo_cell(), arm, from, resumed.touches[12].transit), kNearestResumedM);
}

TEST(Resume, BeyondTheLastTouchLeavesThePlanAsItIs) {
  const Plan resumed = resume_plan(demo_cell(), sound_plan(), sound_plan().touches.size(),
                                   sound_plan().start, false);
  EXPECT_EQ(resumed.touches.size(), sound_plan().touches.size());
}

}  // namespace
}  // namespace cellcal::calib
