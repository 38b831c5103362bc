// Given-up touches of a check: a loose sphere is never omitted from the verdict.

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "calib/check/mastered.h"
#include "calib/identify/identify.h"
#include "calib/model/error.h"
#include "calib/model/units.h"
#include "daemon/service/kind.h"
#include "daemon/tasks/planned_round.h"
#include "tests/calib/plan/meet.h"
#include "tests/calib/simulate.h"
#include "tests/calib/thrown.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

using calib::testing::demo_cell;

const sim::Truth& truth() {
  static const sim::Truth drawn = calib::testing::plain_truth(demo_cell(), 5);
  return drawn;
}

std::shared_ptr<const calib::Calibration> calibration() {
  static const auto found = std::make_shared<const calib::Calibration>(calib::identify(
      demo_cell(),
      calib::testing::make_touches(demo_cell(), truth(), {.fit = 60, .seed = 5}).touches));
  return found;
}

/// The result of a check whose second touch is given up this many times. `notes`: its log.
nlohmann::json checked(int given_up, const std::vector<std::string>& mastered = {},
                       const sim::Truth& arm = truth(), std::string* notes = nullptr) {
  const TemporaryDirectory dir;
  TaskInputs inputs;
  inputs.cell = demo_cell();
  inputs.options.mastered = mastered;
  inputs.against =
      std::make_shared<const calib::Calibration>(calib::as_mastered(*calibration(), mastered));
  inputs.results_dir = dir.path();
  inputs.note = [notes](const std::string& words) {
    if (notes != nullptr) *notes += words + "\n";
  };
  const Tasks tasks = check_kind().tasks(std::make_shared<const TaskInputs>(std::move(inputs)));
  tasks.plan();
  calib::Random random(7);
  std::vector<calib::Touch> made;
  ChooseTouch how;
  calib::JointVector from = demo_cell().robot.joints.empty()
                                ? calib::JointVector{}
                                : calib::JointVector{0.0, -1.57, 1.57, 0.0, 0.5, 0.0};
  for (int offered = 0; offered < 30; ++offered) {
    const Tasks::Chosen next = tasks.choose(how, made, from);
    if (next.plan.touches.empty()) break;
    const calib::PlannedTouch& touch = next.plan.touches.front();
    how.failed.reset();
    if (made.size() == 1 && given_up > 0) {
      --given_up;
      how.failed = calib::NotMade::kFailed;
    } else {
      made.push_back(calib::testing::meet(demo_cell(), arm, touch, random).value().touch);
    }
    from = touch.clear;
  }
  tasks.report(tasks.identify(made), made);
  std::ifstream file(dir / "check.json");
  return nlohmann::json::parse(file);
}

TEST(APlannedRound, OffersNothingOfWhatTheControllersSessionDoesNotReach) {
  TaskInputs inputs;
  inputs.cell = demo_cell();
  inputs.axis_reach_rad = 1.9;
  PlannedRound round(std::make_shared<const TaskInputs>(inputs), *calibration());
  calib::PlannedTouch near;
  near.target = "S1";
  near.standoff = near.end = near.clear = calib::JointVector{0.0, -1.57, 1.57, 0.0, 0.5, 0.0};
  calib::Plan first;
  first.start = near.clear;
  first.touches = {near};
  round.add(first);
  // The start of the session is known once the first touch is offered; it is not made in this test.
  try {
    round.offer(first.start, false);
  } catch (
      const calib::PlanError&) {  // a touch of nowhere has no path: only the session start matters
  }
  calib::Plan far = first;
  far.touches[0].standoff = far.touches[0].end = far.touches[0].clear =
      calib::JointVector{2.0, -1.57, 1.57, 0.0, 0.5, 0.0};
  EXPECT_EQ(calib::testing::thrown<calib::PlanError>([&] { round.add(far); }).kind,
            calib::PlanError::Kind::kOutOfReach);
  EXPECT_EQ(round.plan().touches.size(), 1U);
  EXPECT_EQ(round.progress().checks_left, 1);
}

TEST(ACheck, MakesATouchThatWasGivenUpOnceMore) {
  const auto result = checked(1);
  EXPECT_EQ(result["holds"], true) << result;
  EXPECT_TRUE(result["unsteady"].empty());
  EXPECT_GE(result["touches"], 6);
}

TEST(ACheck, DoesNotHoldWhereATouchWasGivenUpTwice) {
  const auto result = checked(2);
  EXPECT_EQ(result["holds"], false) << result;
  ASSERT_EQ(result["unsteady"].size(), 1U);
  EXPECT_EQ(result["unsteady"][0]["touch"], 2);
  EXPECT_NE(result["words"].dump().find("did not agree, twice"), std::string::npos) << result;
}

/// A2 mastered by the calibration's zero, with this error.
sim::Truth mastered_arm(double off_deg) {
  sim::Truth arm = truth();
  calib::Robot robot = arm.arm.robot();
  calib::Joint& joint = robot.joints[1];
  joint.offset_rad -=
      find(*calibration(), calib::joint_parameter(calib::ParameterKind::kTheta, 1))->correction;
  joint.offset_rad += joint.sign * off_deg * calib::kRadPerDeg;
  arm.arm = calib::ArmModel(robot, arm.arm.tool());
  return arm;
}

TEST(ACheck, AfterMasteringNamesTheJointThatIsOffWithItsSize) {
  std::string notes;
  const auto result = checked(0, {"A2"}, mastered_arm(0.03), &notes);
  EXPECT_EQ(result["holds"], false) << result;
  ASSERT_EQ(result["mastered"].size(), 1U);
  EXPECT_EQ(result["mastered"][0]["joint"], "A2");
  EXPECT_EQ(result["mastered"][0]["holds"], false);
  EXPECT_TRUE(result["words"][0].get<std::string>().starts_with("does not hold")) << result;
  EXPECT_NEAR(result["mastered"][0]["error_deg"].get<double>(), 0.03, 0.015) << result;
  EXPECT_LE(result["touches"], 6);
  EXPECT_NE(result["words"][1].get<std::string>().find("zero of A2 +0.0"), std::string::npos);
  EXPECT_NE(notes.find("check after mastering A2: "), std::string::npos) << notes;
  std::printf("%s", notes.c_str());
}

TEST(ACheck, AfterMasteringHoldsWhereTheZeroIsAsItWasToBe) {
  const auto result = checked(0, {"A2"}, mastered_arm(0.0));
  EXPECT_EQ(result["holds"], true) << result;
  EXPECT_EQ(result["mastered"][0]["holds"], true);
}

TEST(Positions, OfAPositionerThatRestsAtTheEndOfItsRangeAreAtTheEnd) {
  calib::Robot robot;
  robot.joints.resize(2);
  robot.positioner.resize(2);
  for (calib::PositionerAxis& axis : robot.positioner) {
    axis.min_rad = -1.0;
    axis.max_rad = 2.0;
  }
  const PartedAxes resting = parted(robot, {0.1, 0.2, -1.0001, 2.001});
  EXPECT_EQ(resting.arm_rad, (calib::JointVector{0.1, 0.2}));
  EXPECT_EQ(resting.positioner_rad, (std::vector{-1.0, 2.0}));
  EXPECT_EQ(parted(robot, {0.1, 0.2, 0.5, 1.0}).positioner_rad, (std::vector{0.5, 1.0}));
  const std::vector beyond{-1.0, 2.1};  // more than noise: limits are checked with the actual value
  EXPECT_EQ(parted(robot, {0.1, 0.2, -1.0, 2.1}).positioner_rad, beyond);
}

}  // namespace
}  // namespace cellcal::daemon::testing
