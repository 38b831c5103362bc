// The errors of a linear unit are recovered from touches along it.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "calib/check/tcp_check.h"
#include "calib/estimate/predict.h"
#include "calib/files/calibration_json.h"
#include "calib/files/files.h"
#include "calib/identify/identify.h"
#include "calib/identify/update.h"
#include "calib/model/error.h"
#include "calib/model/linear.h"
#include "calib/plan/check_plan.h"
#include "calib/plan/plan.h"
#include "tests/calib/track_cell.h"

namespace cellcal::calib {
namespace {

/// KR 16 with rigid, exact gears, so that only geometry remains.
Cell track_cell() {
  Cell cell = testing::track_cell(CELLCAL_TRACK_ROBOT);
  for (Joint& joint : cell.robot.joints) {
    joint.compliance_sigma_rad_per_nm = 0.0;
    joint.mass_kg = 0.0;
  }
  return cell;
}

/// Contact of the true tip with the sphere on the planned search line.
std::optional<Touch> touch(const ArmModel& arm, const Eigen::VectorXd& x, const Cell& cell,
                           const PlannedTouch& planned) {
  const Target& target = cell.targets[cell.target_index(planned.target)];
  const auto at = [&](double s) {
    JointVector q = planned.standoff;
    for (std::size_t i = 0; i < q.size(); ++i) q[i] += s * (planned.end[i] - planned.standoff[i]);
    return q;
  };
  const auto gap = [&](double s) {
    return (arm.position(arm.prepare(at(s)), x.data()) - target.centre_m).norm() -
           target.diameter_m / 2.0;
  };
  double out = -0.8, in = 1.8;
  if (gap(out) < 0.0 || gap(in) > 0.0) return std::nullopt;
  for (int k = 0; k < 60; ++k) (gap((out + in) / 2.0) > 0.0 ? out : in) = (out + in) / 2.0;
  Touch made;
  made.joint_rad = at(out);
  made.target = planned.target;
  made.set = planned.set;
  return made;
}

struct TrackSession {
  Cell cell = track_cell();
  ArmModel arm{cell};
  Eigen::VectorXd x = Eigen::VectorXd::Zero(arm.size());
  std::vector<Touch> touches;

  explicit TrackSession(int fit) {
    Random random(3);
    for (int p = 0; p < arm.size(); ++p) {
      const ArmParameter& parameter = arm.parameters()[static_cast<std::size_t>(p)];
      // Long waves; a tenth of the arm's tolerances, so that the unit's errors are the large ones.
      const bool guide = parameter.kind == ParameterKind::kGuide;
      if (guide && parameter.harmonic > 3) continue;
      x[p] = (guide ? 1.0 : 0.1) * parameter.sigma * random.normal();
    }
    PlanOptions options;
    options.fit_touches = fit;
    options.check_touches = 20;
    for (const PlannedTouch& planned : make_plan(cell, options).touches)
      if (auto one = touch(arm, x, cell, planned)) touches.push_back(std::move(*one));
  }
};

const TrackSession& made() {
  static const TrackSession one(100);
  return one;
}

const Calibration& calibrated() {
  static const Calibration found = identify(made().cell, made().touches);
  return found;
}

TEST(LinearUnit, ItsErrorsAreFoundAgain) {
  const Calibration& c = calibrated();
  EXPECT_GT(c.before.rms_m, 3e-4);
  EXPECT_LT(c.check.rms_m, 2e-5);
  for (int p = 0; p < made().arm.size(); ++p) {
    const ArmParameter& parameter = made().arm.parameters()[static_cast<std::size_t>(p)];
    if (parameter.kind != ParameterKind::kGuide || parameter.harmonic > 2) continue;
    const std::string name = parameter_name(made().cell, parameter);
    const auto found = std::ranges::find(c.parameters, static_cast<const ParameterKey&>(parameter),
                                         &ParameterResult::key);
    ASSERT_NE(found, c.parameters.end()) << name;
    EXPECT_LT(std::abs(found->correction - made().x[p]), 4.0 * found->sigma) << name;
    // A rotation of the travel about A1 also rotates the targets (gauge), and half a wave resembles
    // a slope.
    if (name != "E1.across_slope" && parameter.harmonic != 1) {
      EXPECT_LT(found->sigma, 0.5 * parameter.sigma) << name;
    }
  }
}

TEST(LinearUnit, IsPredictedWithItsBoundOverTheWholeTrack) {
  const Calibration& c = calibrated();
  const Predictor predictor(c);
  Random random(7);
  constexpr int kPoses = 300;
  Eigen::Matrix3Xd real(3, kPoses), found(3, kPoses), nominal(3, kPoses);
  Eigen::VectorXd u95(kPoses);
  for (int k = 0; k < kPoses; ++k) {
    const JointVector q = {random.uniform(0.0, 3.0),   random.uniform(-1.0, 1.0),
                           random.uniform(-1.8, -0.6), random.uniform(0.6, 2.0),
                           random.uniform(-2.0, 2.0),  random.uniform(-1.5, 1.5),
                           random.uniform(-2.0, 2.0)};
    real.col(k) = made().arm.position(made().arm.prepare(q), made().x.data());
    const Prediction at = predictor.calibrated(q);
    found.col(k) = at.tcp.translation();
    u95[k] = at.u95_m;
    nominal.col(k) = predictor.nominal(q).translation();
  }
  const auto off = [&](const Eigen::Matrix3Xd& points) {
    const Eigen::Matrix4d motion = calib::rigid_motion(points, real).matrix();
    return Eigen::VectorXd(
        ((motion.topLeftCorner<3, 3>() * points).colwise() + motion.topRightCorner<3, 1>() - real)
            .colwise()
            .norm()
            .transpose());
  };
  EXPECT_GT(off(nominal).mean(), 3e-4);
  EXPECT_LT(off(found).mean(), 8e-5);
  EXPECT_GE((off(found).array() <= u95.array()).count(), 0.9 * kPoses);
}

TEST(LinearUnit, OutlivesTheCalibrationFile) {
  const Calibration& c = calibrated();
  const Calibration again = calibration_from_json(calibration_to_json(c), "c.json");
  const JointVector q = {1.7, 0.2, -1.2, 1.4, 0.3, 0.9, -0.4};
  const Prediction is = Predictor(c).calibrated(q), read = Predictor(again).calibrated(q);
  EXPECT_LT((is.tcp.translation() - read.tcp.translation()).norm(), 1e-9);
  EXPECT_NEAR(is.u95_m, read.u95_m, 1e-9);
}

TEST(LinearUnit, ATakenForExactUnitLeavesItsErrors) {
  Cell exact = made().cell;
  exact.robot.joints[0].guide = LinearGuide{exact.robot.joints[0].guide->along};
  const Calibration without = identify(exact, made().touches);
  EXPECT_GT(without.check.rms_m, 5.0 * calibrated().check.rms_m);
}

const Eigen::Vector3d kKnock{0.5e-3, -0.3e-3, 0.2e-3};

/// Touches by the arm as calibrated, with its tool knocked.
std::vector<Touch> touches_of(const Plan& plan, const Eigen::Vector3d& knock_m) {
  Tool tool = made().cell.tool;
  tool.tcp.translation() += knock_m;
  const ArmModel arm(made().cell.robot, tool);
  std::vector<Touch> touches;
  for (const PlannedTouch& planned : plan.touches)
    if (auto one = touch(arm, made().x, made().cell, planned)) touches.push_back(std::move(*one));
  EXPECT_EQ(touches.size(), plan.touches.size());
  return touches;
}

TEST(LinearUnit, ACheckAlongTheTrackHoldsAndNamesAKnockedTool) {
  const Calibration& c = calibrated();
  const Plan plan = make_check_plan(c, {});
  const auto [least, most] = std::ranges::minmax(
      plan.touches, {}, [](const PlannedTouch& planned) { return planned.end[0]; });
  EXPECT_GT(most.end[0] - least.end[0], 0.5);
  const std::vector<Touch> same = touches_of(plan, Eigen::Vector3d::Zero());
  EXPECT_TRUE(TcpChecker(c, same).judge(same).holds);
  const std::vector<Touch> knocked = touches_of(plan, kKnock);
  const TcpCheck check = TcpChecker(c, knocked).judge(knocked);
  EXPECT_FALSE(check.holds);
  EXPECT_EQ(check.explanations.front().kind, ChangeKind::kTool);
  EXPECT_LT((check.shift_m - kKnock).norm(), 0.15e-3);
}

TEST(LinearUnit, AnUpdateFollowsAKnockedTool) {
  const Calibration& c = calibrated();
  CheckPlanOptions how = first_update_touches();
  how.most_touches = kMostUpdateTouches;
  how.most_s = 1e3;
  const std::vector<Touch> touches = touches_of(make_check_plan(c, {}, how), kKnock);
  const Calibration updated = update(c, touches, {"session 1", 0.1, {}, 60});
  EXPECT_EQ(updated.update->outcome, UpdateOutcome::kUpdated);
  EXPECT_EQ(updated.update->explanations.front().kind, ChangeKind::kTool);
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(correction_of(updated, tool_parameter(ParameterKind::kTcp, 0, axis)), kKnock[axis],
                0.15e-3);
}

}  // namespace
}  // namespace cellcal::calib
