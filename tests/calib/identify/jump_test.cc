// A joint that slips or a tool that is knocked during a session is named, with size and time; an
// unchanged arm is not accused, and neither event is mistaken for a moved target.

#include "calib/identify/jump.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <numbers>

#include "calib/estimate/region.h"
#include "calib/files/calibration_json.h"
#include "calib/identify/identify.h"
#include "calib/model/linear.h"
#include "tests/calib/findings.h"
#include "tests/calib/identify/judged.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::found;
using testing::make_touches;
using testing::plain_truth;
using testing::tracker_cell;
using testing::words_of;

constexpr std::size_t kJumpedAt = 50;
constexpr double kRadPerDegree = std::numbers::pi / 180.0;

/// A hundred touches, spheres in turn; from touch kJumpedAt on those of `later`.
std::vector<Touch> half_and_half(const sim::Truth& before, unsigned seed,
                                 const std::vector<Touch>& later) {
  auto touches = make_touches(demo_cell(), before, {.fit = 100, .seed = seed}).touches;
  std::copy(later.begin() + kJumpedAt, later.end(), touches.begin() + kJumpedAt);
  return touches;
}

/// From kJumpedAt on the joint is `slip_deg` ahead of its controller's reading.
std::vector<Touch> slipped(std::size_t joint, double slip_deg, unsigned seed) {
  const sim::Truth truth = plain_truth(demo_cell(), seed);
  auto later = make_touches(demo_cell(), truth, {.fit = 100, .seed = seed}).touches;
  for (Touch& touch : later) touch.joint_rad[joint] -= slip_deg * kRadPerDegree;
  return half_and_half(truth, seed, later);
}

/// From kJumpedAt on the tip is displaced on the flange.
std::vector<Touch> knocked(const Eigen::Vector3d& shift_m, unsigned seed) {
  const sim::Truth truth = plain_truth(demo_cell(), seed);
  Cell bent = demo_cell();
  bent.tool.tcp.translation() += shift_m;
  sim::Truth after = truth;
  Tool tool = truth.arm.tool();
  tool.tcp.translation() += shift_m;
  after.arm = ArmModel(truth.arm.robot(), tool);
  return half_and_half(truth, seed, make_touches(bent, after, {.fit = 100, .seed = seed}).touches);
}

TEST(Jump, OfAJointsZeroIsNamedWithSizeAndTouchAndNotToldAsATargetThatMoved) {
  struct Case {
    std::size_t joint;
    double slip_deg;
  };
  unsigned seed = 1;
  for (const Case& slip :
       {Case{0, 0.05}, Case{1, 0.05}, Case{2, -0.05}, Case{3, 0.1}, Case{4, 0.07}, Case{1, 0.02}}) {
    const Calibration c = identify(demo_cell(), slipped(slip.joint, slip.slip_deg, seed++));
    EXPECT_FALSE(c.verdict.publish());
    EXPECT_TRUE(c.moved.empty());
    ASSERT_EQ(c.jumped.size(), 1u) << words_of(c);
    const Jump& jump = c.jumped[0];
    const std::string& name = demo_cell().robot.joints[slip.joint].name;
    EXPECT_EQ(jump.what, Jump::What::kJoint);
    EXPECT_EQ(jump.name, name) << words_of(c);
    EXPECT_NEAR(jump.angle_rad / kRadPerDegree, slip.slip_deg, 0.01);
    EXPECT_NEAR(jump.angle_rad / kRadPerDegree, slip.slip_deg, 5.0 * jump.sigma / kRadPerDegree);
    EXPECT_NEAR(static_cast<double>(jump.after_touch), kJumpedAt - 1, 6.0);
    const Finding& finding = c.verdict.findings.front();
    EXPECT_EQ(finding.kind, FindingKind::kJumped) << words_of(c);
    ASSERT_EQ(finding.parts.size(), 1u);
    EXPECT_EQ(finding.parts[0].about.of, Subject::Of::kJoint);
    EXPECT_EQ(finding.parts[0].about.name, name);
  }
}

void expect_slip_of_a3(const Calibration& c, double slip_deg) {
  EXPECT_FALSE(c.verdict.publish());
  ASSERT_EQ(c.jumped.size(), 1u) << words_of(c);
  EXPECT_EQ(c.jumped[0].name, demo_cell().robot.joints[2].name) << words_of(c);
  EXPECT_NEAR(c.jumped[0].angle_rad / kRadPerDegree, slip_deg, 0.01);
}

TEST(Jump, OfADegreeSoonAfterTheBeginningIsTheJointsThatSlipped) {
  // Much of it is explained by another joint's jump, or by an error of this joint from the start.
  for (const std::size_t joint : {std::size_t{1}, std::size_t{4}}) {
    const sim::Truth truth = plain_truth(demo_cell(), 5);
    auto touches = make_touches(demo_cell(), truth, {.fit = 80, .check = 16, .seed = 5}).touches;
    for (std::size_t i = 29; i < touches.size(); ++i) touches[i].joint_rad[joint] -= kRadPerDegree;
    const Calibration c = identify(demo_cell(), touches);
    ASSERT_EQ(c.jumped.size(), 1u) << words_of(c);
    EXPECT_EQ(c.jumped[0].name, demo_cell().robot.joints[joint].name) << words_of(c);
    EXPECT_NEAR(c.jumped[0].angle_rad / kRadPerDegree, 1.0, 0.02);
  }
}

TEST(Jump, IsNamedBesideNotesThatAreNoObjections) {
  Cell cell = demo_cell();
  cell.lengths.resize(1);
  expect_slip_of_a3(identify(cell, slipped(2, 0.05, 3)), 0.05);
  cell = demo_cell();
  cell.targets.push_back(cell.targets.front());
  cell.targets.back().id = "never touched";
  expect_slip_of_a3(identify(cell, slipped(2, 0.05, 3)), 0.05);
}

TEST(Jump, BetweenTwoVisitsOfTheSamePlacesIsNotTakenForNoise) {
  constexpr double kSlipDeg = 0.05, kScatterRad = 1e-5;
  auto touches =
      make_touches(demo_cell(), plain_truth(demo_cell(), 3), {.fit = 80, .seed = 3}).touches;
  Random random(3);
  for (std::size_t i = 0; i < 80; ++i) {
    Touch again = touches[i];
    for (double& q : again.joint_rad) q += kScatterRad * random.normal();
    again.joint_rad[2] -= kSlipDeg * kRadPerDegree;
    touches.push_back(again);
  }
  expect_slip_of_a3(identify(demo_cell(), touches), kSlipDeg);
}

TEST(Jump, OfTheToolIsNamedWithItsSideOnTheFlange) {
  for (const double times : {0.5, 1.0, 3.0}) {
    const Eigen::Vector3d shift(0.4e-3 * times, -0.5e-3 * times, 0.3e-3 * times);
    const Calibration c = identify(demo_cell(), knocked(shift, 7));
    EXPECT_FALSE(c.verdict.publish());
    ASSERT_EQ(c.jumped.size(), 1u) << words_of(c);
    EXPECT_EQ(c.jumped[0].what, Jump::What::kTool) << words_of(c);
    EXPECT_LT((c.jumped[0].shift_m - shift).norm(), 0.1e-3) << words_of(c);
    ASSERT_EQ(c.verdict.findings.front().kind, FindingKind::kJumped) << words_of(c);
    EXPECT_EQ(c.verdict.findings.front().parts.at(0).about.of, Subject::Of::kTool);
  }
}

TEST(Jump, OfATargetByAMillimetreIsToldWithItsSizeThoughManyTouchesWereLeftOut) {
  for (unsigned seed = 21; seed <= 28; ++seed) {
    const sim::Truth truth = plain_truth(demo_cell(), seed);
    sim::Truth after = truth;
    const Eigen::Vector3d shift(0.6e-3, 0.0, 0.8e-3);
    const std::size_t target = seed % 4;
    after.centre_m[target] += shift;
    const Calibration c = identify(
        demo_cell(),
        half_and_half(truth, seed,
                      make_touches(demo_cell(), after, {.fit = 100, .seed = seed}).touches));
    ASSERT_EQ(c.moved.size(), 1u) << seed << words_of(c);
    EXPECT_TRUE(c.jumped.empty());
    EXPECT_EQ(c.moved[0].target, demo_cell().targets[target].id);
    EXPECT_LT((c.moved[0].shift_m - shift).norm(), 0.15e-3) << seed << words_of(c);
    EXPECT_FALSE(found(c, FindingKind::kOutliersOfTarget)) << words_of(c);
  }
}

TEST(Jump, IsNotSeenWhereNothingDid) {
  for (unsigned seed = 61; seed <= 80; ++seed) {
    const Calibration c = identify(demo_cell(), slipped(0, 0.0, seed));
    EXPECT_TRUE(c.jumped.empty()) << seed << words_of(c);
    EXPECT_TRUE(c.verdict.publish()) << seed << words_of(c);
  }
}

/// A tracker's readings of 24 postures, ten in a row of each, in random order. The arm has an
/// unmodelled error, common to the touches of one posture.
std::vector<Touch> ten_of_each(const Cell& cell, const sim::Truth& truth, double beside_m,
                               unsigned seed,
                               const std::function<void(std::size_t, Touch&)>& change = {}) {
  auto postures = workspace_poses(ArmModel(cell), 24, 7);
  Random random(seed);
  for (std::size_t i = postures.size(); i > 1; --i)
    std::swap(postures[i - 1], postures[random.below(i)]);
  std::vector<Touch> touches;
  for (const JointVector& q : postures) {
    Eigen::Vector3d off;
    for (double& c : off) c = beside_m * random.normal();
    for (int k = 0; k < 10; ++k) {
      Touch touch;
      touch.target = "T1";
      touch.joint_rad = q;
      const Eigen::Vector3d tip =
          truth.arm.position(truth.arm.prepare(q), truth.errors.data()) + off;
      for (int axis = 0; axis < 3; ++axis)
        touch.tracker_m[axis] = tip[axis] + 0.02e-3 * random.normal();
      if (change) change(touches.size(), touch);
      touches.push_back(touch);
    }
  }
  return touches;
}

TEST(Jump, IsNotMadeOfTheErrorThatTheTouchesOfOnePostureShare) {
  for (const double sigma_m : {0.02e-3, 0.004e-3})
    for (unsigned seed = 1; seed <= 2; ++seed) {
      SCOPED_TRACE(seed);
      const Cell cell = tracker_cell(sigma_m);
      const Calibration c =
          identify(cell, ten_of_each(cell, plain_truth(demo_cell(), seed), 0.06e-3, seed));
      EXPECT_TRUE(c.jumped.empty()) << words_of(c);
      EXPECT_TRUE(c.moved.empty()) << words_of(c);
      EXPECT_FALSE(found(c, FindingKind::kLikelyCause)) << words_of(c);
      EXPECT_TRUE(c.verdict.publish()) << words_of(c);
    }
}

TEST(Jump, IsNamedBesideAnErrorThatTheTouchesOfOnePostureShare) {
  const Cell cell = tracker_cell(0.02e-3);
  const Calibration c = identify(cell, ten_of_each(cell, plain_truth(demo_cell(), 2), 0.06e-3, 2,
                                                   [](std::size_t i, Touch& touch) {
                                                     if (i >= 120)
                                                       touch.joint_rad[2] -= 0.1 * kRadPerDegree;
                                                   }));
  ASSERT_EQ(c.jumped.size(), 1u) << words_of(c);
  EXPECT_EQ(c.jumped[0].name, demo_cell().robot.joints[2].name) << words_of(c);
  EXPECT_NEAR(c.jumped[0].angle_rad / kRadPerDegree, 0.1, 0.02);
}

TEST(Jump, OfATrackerIsNamedAsItsMoveWithSizeAndReadingNotAsAKnockedTool) {
  const Cell cell = tracker_cell(0.02e-3);
  const Eigen::Vector3d shift(0.2e-3, -0.3e-3, 0.1e-3);
  const auto postures = workspace_poses(ArmModel(cell), 60, 7);
  const auto read = [&](double turn_rad, const Eigen::Vector3d& by_m) {
    const sim::Truth truth = plain_truth(demo_cell(), 3);
    Random random(3);
    std::vector<Touch> touches;
    for (const JointVector& q : postures) {
      Eigen::Vector3d tip = truth.arm.position(truth.arm.prepare(q), truth.errors.data());
      if (touches.size() >= 30)
        tip = Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitX()) * tip + by_m;
      Touch touch;
      touch.target = "T1";
      touch.joint_rad = q;
      for (int axis = 0; axis < 3; ++axis)
        touch.tracker_m[axis] = tip[axis] + 0.02e-3 * random.normal();
      touches.push_back(touch);
    }
    return identify(cell, touches);
  };
  const Calibration healthy = read(0.0, Eigen::Vector3d::Zero());
  EXPECT_TRUE(healthy.moved.empty() && healthy.jumped.empty()) << words_of(healthy);
  // By as much as the readings, to the other side: the place of the tracker in the base.
  const Calibration moved = read(0.0, shift);
  ASSERT_EQ(moved.moved.size(), 1U) << words_of(moved);
  EXPECT_TRUE(moved.jumped.empty()) << words_of(moved);
  EXPECT_FALSE(moved.verdict.publish());
  EXPECT_EQ(moved.moved[0].after_touch, 29U);
  EXPECT_LT((moved.moved[0].shift_m + shift).norm(), 6.0 * moved.moved[0].sigma_m);
  EXPECT_LT(moved.moved[0].sigma_m, 0.05e-3);
  EXPECT_NE(words_of(moved).find("tracker T1 or the robot's foot moved by "), std::string::npos)
      << words_of(moved);
  const Calibration turned = read(0.5e-3, Eigen::Vector3d::Zero());
  ASSERT_EQ(turned.moved.size(), 1U) << words_of(turned);
  EXPECT_TRUE(turned.jumped.empty()) << words_of(turned);
}

/// Functions of the joints' angles can absorb it where each posture is visited once.
TEST(Jump, OfAnArmWithFunctionsIsNamedThoughEachPostureIsVisitedOnce) {
  const Cell cell = tracker_cell(0.02e-3);
  const sim::Truth truth = testing::truth_with_waves({}, 20.0);
  const Calibration healthy = identify(cell, ten_of_each(cell, truth, 0.01e-3, 2));
  EXPECT_TRUE(testing::has_functions(healthy));
  EXPECT_TRUE(healthy.jumped.empty()) << words_of(healthy);
  EXPECT_TRUE(healthy.verdict.publish()) << words_of(healthy);
  const auto slips = [](std::size_t i, Touch& touch) {
    if (i >= 120) touch.joint_rad[2] -= 0.1 * kRadPerDegree;
  };
  const Calibration c = identify(cell, ten_of_each(cell, truth, 0.01e-3, 2, slips));
  EXPECT_TRUE(testing::has_functions(c));
  ASSERT_EQ(c.jumped.size(), 1u) << words_of(c);
  EXPECT_EQ(c.jumped[0].name, demo_cell().robot.joints[2].name) << words_of(c);
  EXPECT_FALSE(c.verdict.publish());
}

TEST(Jump, BelowThePredictedErrorWithholdsNothing) {
  const Cell cell = demo_cell();
  const auto touches = slipped(0, 0.0, 61);
  Calibration c;
  c.verdict.judged = true;
  c.predicted_near_targets_m = 0.05e-3;
  const auto confirmed = [&](Jump jump) {
    jump.log_odds = 20.0;
    jump.squared_sigmas = 100.0;
    return !confirmed_jumps(cell, touches, covered_m(c), {std::move(jump)}).empty();
  };
  Jump slip{Jump::What::kJoint, cell.robot.joints[0].name, kJumpedAt};
  slip.angle_rad = 0.001 * kRadPerDegree;  // at most 0.03 mm within the arm's reach
  EXPECT_FALSE(confirmed(slip));
  slip.angle_rad = 0.02 * kRadPerDegree;
  EXPECT_TRUE(confirmed(slip));
  Jump knock{Jump::What::kTool, "tool", kJumpedAt};
  knock.shift_m = {0.0, 0.04e-3, 0.0};
  EXPECT_FALSE(confirmed(knock));
  // It is named as the cause if the result is withheld anyway.
  c.verdict.add({FindingKind::kManyOutliers, Severity::kWithholds});
  EXPECT_TRUE(confirmed(knock));
}

TEST(Jump, OfManyTouchesIsSaidByAShareOfThem) {
  const sim::Truth truth = plain_truth(demo_cell(), 3);
  auto touches = make_touches(demo_cell(), truth, {.fit = 2500, .seed = 3}).touches;
  for (std::size_t i = 1500; i < touches.size(); ++i)
    touches[i].joint_rad[3] -= 0.1 * kRadPerDegree;
  const Calibration c = identify(demo_cell(), touches);
  ASSERT_EQ(c.jumped.size(), 1u) << words_of(c);
  EXPECT_EQ(c.jumped[0].name, "A4");
  EXPECT_NEAR(static_cast<double>(c.jumped[0].after_touch), 1499.0, 15.0);
}

TEST(Jump, OfAllTouchesIsNone) {
  // Remastered before the session: an ordinary error of the arm.
  auto touches = slipped(3, 0.0, 5);
  for (Touch& touch : touches) touch.joint_rad[3] += 0.05 * kRadPerDegree;
  EXPECT_TRUE(identify(demo_cell(), touches).jumped.empty());
}

TEST(Jump, OfATargetThatIsCalledAsTheFirstJointIsNotToldAsThatJoints) {
  Cell cell = demo_cell();
  cell.lengths.clear();
  const std::string name = cell.robot.joints.front().name;
  cell.targets.front().id = name;
  std::vector<Touch> touches(2);
  for (Touch& touch : touches) touch.target = name;
  const auto told_as_the_joints = [&](Jump::What what) {
    Calibration c;
    c.jumped.resize(1);
    c.jumped[0].what = what;
    c.jumped[0].name = name;
    c.jumped[0].shift_m = {0.3e-3, 0.0, 0.0};
    withhold_for_jumps(cell, touches, {}, c);
    return find(testing::the(c, FindingKind::kJumped).evidence, "first_joint") != nullptr;
  };
  EXPECT_TRUE(told_as_the_joints(Jump::What::kJoint));
  EXPECT_FALSE(told_as_the_joints(Jump::What::kTarget));
  EXPECT_FALSE(told_as_the_joints(Jump::What::kTool));
}

TEST(Jump, IsKeptInTheFile) {
  const Calibration c = identify(demo_cell(), slipped(3, 0.1, 4));
  ASSERT_EQ(c.jumped.size(), 1u);
  const Calibration read = calibration_from_json(calibration_to_json(c), "jumped");
  ASSERT_EQ(read.jumped.size(), 1u);
  EXPECT_EQ(read.jumped[0].what, c.jumped[0].what);
  EXPECT_EQ(read.jumped[0].name, c.jumped[0].name);
  EXPECT_EQ(read.jumped[0].after_touch, c.jumped[0].after_touch);
  EXPECT_NEAR(read.jumped[0].angle_rad, c.jumped[0].angle_rad, 1e-12);
  EXPECT_NEAR(read.jumped[0].sigma, c.jumped[0].sigma, 1e-12);
}

}  // namespace
}  // namespace cellcal::calib
