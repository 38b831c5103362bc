// Checks, updates and plans based on a calibration with learnt functions of the joints' angles.

#include <gtest/gtest.h>

#include <algorithm>

#include "calib/check/tcp_check.h"
#include "calib/files/calibration_json.h"
#include "calib/identify/identify.h"
#include "calib/identify/update.h"
#include "calib/model/units.h"
#include "calib/plan/check_plan.h"
#include "calib/plan/design.h"
#include "calib/plan/plan.h"
#include "tests/calib/findings.h"
#include "tests/calib/identify/judged.h"
#include "tests/calib/plan/meet.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell, testing::has_functions, testing::off, testing::Off;

const sim::Truth& waved_arm() {
  static const sim::Truth drawn = testing::truth_with_waves();
  return drawn;
}

/// As read from its file.
const Calibration& with_functions() {
  static const Calibration read = calibration_from_json(
      calibration_to_json(identify(
          demo_cell(),
          testing::make_touches(demo_cell(), waved_arm(), {.fit = 250, .seed = 3}).touches)),
      "in_use.json");
  return read;
}

sim::Truth waved_after_knock(const Eigen::Vector3d& shift_m) {
  sim::Truth after = waved_arm();
  Tool tool = after.arm.tool();
  tool.tcp.translation() += shift_m;
  after.arm = ArmModel(after.arm.robot(), tool);
  return after;
}

/// Touches of a plan by that arm, with their indices in the plan.
struct MetTouches {
  std::vector<Touch> touches;
  std::vector<std::size_t> planned;
};
MetTouches met_by(const Plan& plan, const sim::Truth& arm, std::uint64_t seed = 1) {
  Random random(seed);
  MetTouches all;
  for (std::size_t i = 0; i < plan.touches.size(); ++i)
    if (auto one = testing::meet(demo_cell(), arm, plan.touches[i], random)) {
      all.touches.push_back(std::move(one->touch));
      all.planned.push_back(i);
    }
  return all;
}

TcpCheck checked_by(const sim::Truth& arm, std::uint64_t seed) {
  static const Plan plan = make_check_plan(with_functions(), {});
  const MetTouches made = met_by(plan, arm, seed);
  return check_tcp(with_functions(), made.touches, made.planned, {}, {});
}

TEST(FunctionsInUse, ACheckHoldsWhereNothingChanged) {
  ASSERT_TRUE(has_functions(with_functions()));
  for (const std::uint64_t seed : {1, 2, 3, 4, 5})
    EXPECT_TRUE(checked_by(waved_arm(), seed).holds) << seed;
}

TEST(FunctionsInUse, ACheckNamesTheToolThatWasKnocked) {
  const Eigen::Vector3d shift_m(0.4e-3, -0.3e-3, 0.2e-3);
  for (const std::uint64_t seed : {1, 2, 3}) {
    const TcpCheck check = checked_by(waved_after_knock(shift_m), seed);
    EXPECT_FALSE(check.holds);
    ASSERT_NE(check.change(), nullptr);
    EXPECT_EQ(check.change()->kind, ChangeKind::kTool);
    EXPECT_LT((check.shift_m - shift_m).norm(), 2.0 * check.u_along_m());
  }
}

const UpdateFacts kNextMonth{"session 3 of 2026-11-20", 1.0, {}, 60};

/// The touches of a check, then the most informative ones.
Calibration updated_by(const sim::Truth& arm) {
  const Plan first = make_check_plan(with_functions(), {}, first_update_touches());
  std::vector<Touch> touches = met_by(first, arm).touches;
  const Calibration so_far = update(with_functions(), touches, kNextMonth);
  const Plan more =
      make_update_plan(so_far, {}, further_update_touches(static_cast<int>(touches.size()), 15.0),
                       first.touches.back().clear);
  for (Touch& touch : met_by(more, arm, 2).touches) touches.push_back(std::move(touch));
  return update(with_functions(), touches, kNextMonth);
}

TEST(FunctionsInUse, AnUpdateKeepsTheFunctionsAndItsBoundsHold) {
  const sim::Truth arm = waved_after_knock({1.5e-3, 1e-3, -1e-3});
  const Calibration c = updated_by(arm);
  EXPECT_TRUE(c.verdict.publish()) << testing::words_of(c);
  ASSERT_TRUE(c.update.has_value());
  EXPECT_EQ(c.update->outcome, UpdateOutcome::kUpdated);
  EXPECT_EQ(c.update->explanations.front().kind, ChangeKind::kTool);
  ASSERT_TRUE(has_functions(c));
  EXPECT_EQ(joint_functions(c).size(), joint_functions(with_functions()).size());
  const Off before = off(with_functions(), waved_arm()), after = off(c, arm);
  EXPECT_GT(off(with_functions(), arm).mean_m, 1e-3);
  EXPECT_LT(after.mean_m, kUpdateGoal * before.mean_m);
  EXPECT_GT(after.inside, 0.9);
  EXPECT_LT(after.u95_m, 1.3 * before.u95_m);
  // Also when read from its file.
  const Calibration read = calibration_from_json(calibration_to_json(c), "updated.json");
  EXPECT_NEAR(off(read, arm).u95_m, after.u95_m, 1e-6 * after.u95_m);
}

TEST(FunctionsInUse, AnUpdateWhereNothingChangedIsNotNeeded) {
  const Plan first = make_check_plan(with_functions(), {}, first_update_touches());
  const Calibration c = update(with_functions(), met_by(first, waved_arm()).touches, kNextMonth);
  EXPECT_EQ(c.update->outcome, UpdateOutcome::kNothingChanged);
}

TEST(FunctionsInUse, ThePlanOfTheNextSessionKnowsThem) {
  const Cell known = with_functions_of(with_functions().cell.robot, demo_cell());
  for (std::size_t i = 0; i < known.robot.joints.size(); ++i) {
    const Joint &joint = known.robot.joints[i], &learnt = with_functions().cell.robot.joints[i];
    EXPECT_EQ(joint.function_sigma_rad, learnt.function_sigma_rad);
    EXPECT_EQ(joint.function_reach_rad, learnt.function_reach_rad);
    EXPECT_EQ(joint.function_min_rad, joint.function_max_rad) << "touches go to all angles";
  }
  PlanOptions options;
  options.fit_touches = 30;
  options.check_touches = 0;
  const Plan plain = make_plan(demo_cell(), options), knowing = make_plan(known, options);
  EXPECT_GT(knowing.predicted_u95_m, plain.predicted_u95_m);
  // A function stated in the file is kept; a joint with another name has none.
  Cell stated = demo_cell();
  stated.robot.joints[1].function_sigma_rad = 1e-5;
  stated.robot.joints[2].name = "J3";
  const Cell mixed = with_functions_of(with_functions().cell.robot, stated);
  EXPECT_EQ(mixed.robot.joints[1].function_sigma_rad, 1e-5);
  EXPECT_EQ(mixed.robot.joints[2].function_sigma_rad, 0.0);
}

}  // namespace
}  // namespace cellcal::calib
