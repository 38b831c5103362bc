// A check of a cell with a positioner: the displaced part is named, not the tool or the arm.

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "calib/check/tcp_check.h"
#include "calib/files/calibration_json.h"
#include "calib/plan/check_plan.h"
#include "tests/calib/positioner_session.h"

namespace cellcal::calib {
namespace {

using testing::StandingCell, testing::with_knocked_tool, testing::with_moved_positioner,
    testing::with_moved_sphere, testing::with_zero_off;

constexpr double kNoiseM = 2e-5;

const testing::PositionerSession& calibrated_session() {
  static const testing::PositionerSession one(CELLCAL_POSITIONER_ROBOT, kNoiseM);
  return one;
}

const Calibration& calibrated_with_positioner() {
  static const Calibration found =
      identify(calibrated_session().cell, calibrated_session().touches);
  return found;
}

const Plan& plan_with_positioner() {
  static const Plan made = make_check_plan(calibrated_with_positioner(), {});
  return made;
}

TcpCheck checked(const StandingCell& now) {
  Random random(5);
  std::vector<Touch> made;
  for (const PlannedTouch& planned : plan_with_positioner().touches) {
    auto touch = now.contact(planned, {}, kNoiseM * random.normal());
    if (touch) made.push_back(std::move(*touch));
  }
  EXPECT_EQ(made.size(), plan_with_positioner().touches.size());
  return TcpChecker(calibrated_with_positioner(), made).judge(made);
}

const Explanation& change_of(const TcpCheck& check) {
  EXPECT_FALSE(check.holds);
  for (const std::string& line : words(check)) SCOPED_TRACE(line);
  return *check.change();
}

StandingCell unchanged_cell() { return calibrated_session().standing(); }

TEST(CheckWithPositioner, TouchesEverySphereAtOneSettingWhereTheCalibrationHasIt) {
  std::set<std::string> touched;
  for (const PlannedTouch& planned : plan_with_positioner().touches) {
    touched.insert(planned.target);
    ASSERT_EQ(planned.positioner_rad.size(), 2u);
    EXPECT_EQ(planned.positioner_rad, plan_with_positioner().touches[0].positioner_rad);
    EXPECT_TRUE(planned.wait.empty());
    const auto met = unchanged_cell().contact(planned);
    ASSERT_TRUE(met.has_value());
    const double share =
        (met->joint_rad[1] - planned.standoff[1]) / (planned.end[1] - planned.standoff[1]);
    EXPECT_NEAR(share * planned.search_m, planned.expected_m, 0.3e-3);
  }
  EXPECT_EQ(touched.size(), calibrated_session().cell.targets.size());
}

TEST(CheckWithPositioner, IsReachedFromWhereArmAndPositionerStand) {
  const Plan& plan = plan_with_positioner();
  const std::vector<double> setting = plan.touches[0].positioner_rad;
  const JointVector upright = {0.0, -1.5708, 1.5708, 0.0, 1.0472, 0.0};
  const auto touch = [&](std::size_t next, const JointVector& from, std::vector<double> stands) {
    return check_touch_from(calibrated_with_positioner(), plan, next, from, false, stands);
  };
  const std::vector<double> elsewhere = {setting[0] + 0.4, setting[1] - 1.0};
  const PlannedTouch turned = touch(0, upright, elsewhere);
  ASSERT_FALSE(turned.wait.empty());
  EXPECT_EQ(turned.wait.back(), plan.start);
  EXPECT_EQ(turned.wait_rad, elsewhere);
  EXPECT_EQ(turned.positioner_rad, setting);
  EXPECT_EQ(turned.transit.back(), turned.standoff);
  EXPECT_TRUE(touch(0, upright, setting).wait.empty());
  EXPECT_EQ(touch(1, plan.touches[0].clear, setting).transit, plan.touches[1].transit);
  const std::vector<double> nearby = {setting[0] + 0.001, setting[1]};
  const PlannedTouch as_it_stands = touch(1, plan.touches[0].clear, nearby);
  EXPECT_TRUE(as_it_stands.wait.empty());
  EXPECT_EQ(as_it_stands.positioner_rad, nearby);
}

TEST(QualificationWithPositioner, StaysAtOneSetting) {
  const std::vector<double> speeds_m_s = {0.01, 0.02};
  const Plan plan = make_qualification_plan(calibrated_session().cell, {}, "T1", 3, speeds_m_s);
  ASSERT_EQ(plan.touches.size(), 6u);
  for (const PlannedTouch& touch : plan.touches) {
    EXPECT_EQ(touch.target, "T1");
    EXPECT_EQ(touch.positioner_rad, plan.touches[0].positioner_rad);
    EXPECT_EQ(touch.positioner_rad.size(), 2u);
    EXPECT_TRUE(touch.wait.empty());
  }
}

TEST(CheckWithPositioner, OfASphereOnTheFloorAloneIsPlannedAsWithoutThePositioner) {
  Calibration with = calibrated_with_positioner();
  std::erase_if(with.targets, [](const TargetResult& known) { return known.id != "S4"; });
  with.cell.lengths.clear();
  for (Target& target : with.cell.targets) {
    if (target.carried_by == 0) continue;
    target.kind = TargetKind::kPoint;  // neither touched nor in the way
    target.has_centre = false;
    target.carried_by = 0;
  }
  Calibration without = with;
  without.cell.robot.positioner.clear();
  CheckPlanOptions few;
  few.most_touches = few.least_touches = 4;
  const Plan plan = make_check_plan(with, {}, few), plain = make_check_plan(without, {}, few);
  ASSERT_EQ(plan.touches.size(), 4u);
  ASSERT_EQ(plain.touches.size(), 4u);
  for (std::size_t k = 0; k < plan.touches.size(); ++k)
    EXPECT_EQ(plan.touches[k].normal, plain.touches[k].normal) << k;
}

TEST(CheckWithPositioner, HoldsWhereNothingChanged) {
  const TcpCheck check = checked(unchanged_cell());
  EXPECT_TRUE(check.holds) << verdict_words(check);
  EXPECT_LT(check.shift_m.norm(), 2.0 * check.u_along_m());
}

TEST(CheckWithPositioner, NamesAKnockedTool) {
  const Eigen::Vector3d by_m(0.8e-3, -0.6e-3, 0.5e-3);
  const TcpCheck check = checked(with_knocked_tool(unchanged_cell(), by_m));
  EXPECT_EQ(change_of(check).kind, ChangeKind::kTool);
  EXPECT_LT((check.shift_m - by_m).norm(), 0.15e-3);
}

TEST(CheckWithPositioner, NamesTheSphereThatMovedOnTheFloorOrOnTheTable) {
  for (const char* id : {"S4", "T2"}) {
    const PlannedTouch& touch =
        *std::ranges::find(plan_with_positioner().touches, id, &PlannedTouch::target);
    const Target& target =
        calibrated_session().cell.targets[calibrated_session().cell.target_index(id)];
    // Towards the touch, in the frame that carries the target.
    const Eigen::Vector3d towards =
        carried_at(
            calibrated_session().cell.robot,
            std::span(touch.positioner_rad).first(static_cast<std::size_t>(target.carried_by)))
            .linear()
            .transpose() *
        touch.normal;
    const TcpCheck check = checked(with_moved_sphere(unchanged_cell(), id, 1.5e-3 * towards));
    EXPECT_EQ(change_of(check).kind, ChangeKind::kSphere);
    EXPECT_EQ(change_of(check).name, id);
  }
}

TEST(CheckWithPositioner, NamesAPositionerThatMovedWithShiftAndTurn) {
  const Eigen::Vector3d by_m(2e-3, -1.5e-3, 1e-3), turn_rad(0.0, 0.0, 3e-3);
  const TcpCheck check = checked(with_moved_positioner(unchanged_cell(), by_m, turn_rad));
  const Explanation& change = change_of(check);
  EXPECT_EQ(change.kind, ChangeKind::kPositioner) << words(change);
  EXPECT_EQ(change.name, "E1");
  EXPECT_GT(change.probability, 0.9);
  EXPECT_NE(words(change).find("positioner moved by"), std::string::npos);
  EXPECT_NE(check_to_json(check).find("\"turn_deg\""), std::string::npos);
}

TEST(CheckWithPositioner, NamesTheAxisWhoseZeroIsOffByItsAngle) {
  for (const std::size_t axis : {0u, 1u}) {
    const TcpCheck check = checked(with_zero_off(unchanged_cell(), axis, 4e-3));
    const Explanation& change = change_of(check);
    EXPECT_EQ(change.kind, ChangeKind::kJoint) << words(change);
    EXPECT_EQ(change.name, calibrated_session().cell.robot.positioner[axis].name);
    EXPECT_NEAR(change.amount, 4e-3, 0.5e-3);
  }
}

}  // namespace
}  // namespace cellcal::calib
