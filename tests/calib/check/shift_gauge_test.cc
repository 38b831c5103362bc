// Checks of a simulated arm as measurements of the TCP: repeatable while nothing changes, and equal to the shift of
// a knocked tool. Many checks identify a cause that a single one cannot.

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "calib/check/drift.h"
#include "calib/identify/identify.h"
#include "calib/model/error.h"
#include "calib/plan/check_plan.h"
#include "tests/calib/plan/meet.h"
#include "tests/calib/simulate.h"
#include "tests/calib/thrown.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;

struct ShiftGaugeChecks : ::testing::Test {
  static const sim::Truth& truth() {
    static const sim::Truth drawn = testing::plain_truth(demo_cell(), 5);
    return drawn;
  }
  static const Calibration& calibration() {
    static const Calibration found = identify(
        demo_cell(), testing::make_touches(demo_cell(), truth(), {.fit = 60, .seed = 5}).touches);
    return found;
  }
  static const Plan& plan() {
    static const Plan made = make_check_plan(calibration(), {});
    return made;
  }
  static std::vector<Touch> made_by(const sim::Truth& arm, std::uint64_t seed) {
    Random random(seed);
    std::vector<Touch> touches;
    for (const PlannedTouch& planned : plan().touches)
      touches.push_back(testing::meet(demo_cell(), arm, planned, random).value().touch);
    return touches;
  }
  static sim::Truth knocked(const Eigen::Vector3d& shift_m) {
    sim::Truth after = truth();
    Tool tool = after.arm.tool();
    tool.tcp.translation() += shift_m;
    after.arm = ArmModel(after.arm.robot(), tool);
    return after;
  }
  static sim::Truth slipped(std::size_t joint, double by_rad) {
    sim::Truth after = truth();
    Robot robot = after.arm.robot();
    robot.joints[joint].offset_rad += by_rad;
    after.arm = ArmModel(robot, after.arm.tool());
    return after;
  }
  /// Mean residuals over the checks.
  Eigen::VectorXd mean_off(const sim::Truth& arm, int checks, std::uint64_t seed) const {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(gauge.touches()));
    for (int k = 0; k < checks; ++k)
      sum += gauge.measure(made_by(arm, seed + static_cast<unsigned>(k))).off_m;
    return sum / checks;
  }
  ShiftGauge gauge{calibration(), made_by(truth(), 99)};
};

TEST_F(ShiftGaugeChecks, ScattersByWhatItStatesAndHasWhatAllChecksShareInItsMean) {
  constexpr int kChecks = 60;
  std::vector<Eigen::Vector3d> shifts;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (unsigned k = 0; k < kChecks; ++k) {
    const auto one = gauge.measure(made_by(truth(), 1 + k));
    shifts.push_back(one.shift_m);
    covariance = one.covariance_m2;
    mean += one.shift_m / kChecks;
  }
  double square = 0.0;
  for (const Eigen::Vector3d& shift : shifts)
    square += (shift - mean).dot(covariance.inverse() * (shift - mean));
  // 177 degrees of freedom; the stated kelvin is not simulated.
  EXPECT_LT(square / (3 * (kChecks - 1)), 1.35);
  EXPECT_GT(square / (3 * (kChecks - 1)), 0.4);
}

TEST_F(ShiftGaugeChecks, MeasuresAKnockAgainstChecksBeforeIt) {
  const Eigen::Vector3d knock(0.3e-3, -0.2e-3, 0.4e-3);
  const auto before = gauge.measure(made_by(truth(), 1));
  const auto after = gauge.measure(made_by(knocked(knock), 2));
  const Eigen::Vector3d off = after.shift_m - before.shift_m - knock;
  EXPECT_LT(off.dot((2 * after.covariance_m2).inverse() * off), 16.0);
}

TEST_F(ShiftGaugeChecks, TellsFromManyChecksWhatCreepsThoughItIsSmall) {
  const double scatter = 2.0 / 30.0;
  const Eigen::VectorXd before = mean_off(truth(), 30, 1);
  const auto tool = gauge.causes(mean_off(knocked({0.06e-3, 0, 0}), 30, 100) - before, scatter);
  EXPECT_EQ(tool.front().kind, ChangeKind::kTool);
  EXPECT_NEAR(tool.front().shift_m.norm(), 0.06e-3, 0.03e-3);
  const auto joint = gauge.causes(mean_off(slipped(1, 0.15e-3), 30, 100) - before, scatter);
  EXPECT_EQ(joint.front().kind, ChangeKind::kJoint);
  EXPECT_EQ(joint.front().name, demo_cell().robot.joints[1].name);
}

TEST_F(ShiftGaugeChecks, RefusesOtherTouchesAndTooFew) {
  auto touches = made_by(truth(), 1);
  touches.pop_back();
  const auto kind = [](const auto& act) { return testing::thrown<IdentifyError>(act).kind; };
  EXPECT_EQ(kind([&] { (void)gauge.measure(touches); }), IdentifyError::Kind::kTouches);
  touches.resize(3);
  EXPECT_EQ(kind([&] { ShiftGauge(calibration(), touches); }), IdentifyError::Kind::kUndetermined);
}

}  // namespace
}  // namespace cellcal::calib
