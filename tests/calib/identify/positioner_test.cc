// The errors of a positioner are found again from touches of spheres on it.

#include <gtest/gtest.h>

#include <cmath>

#include "calib/files/calibration_json.h"
#include "calib/files/files.h"
#include "calib/identify/identify.h"
#include "calib/identify/identify_once.h"
#include "calib/identify/update.h"
#include "calib/model/error.h"
#include "calib/model/linear.h"
#include "calib/plan/plan.h"
#include "tests/calib/positioner_cell.h"

namespace cellcal::calib {
namespace {

/// Rigid, exact gears, so that what is left is geometry.
Cell cell_with_positioner() {
  Cell cell = testing::positioner_cell(CELLCAL_POSITIONER_ROBOT);
  for (Joint& joint : cell.robot.joints) {
    joint.compliance_sigma_rad_per_nm = 0.0;
    joint.mass_kg = 0.0;
  }
  return cell;
}

/// Where the true tip meets the sphere on the planned search line.
std::optional<Touch> contact(const ArmModel& arm, const Eigen::VectorXd& x, const Cell& cell,
                             const PlannedTouch& planned) {
  const Target& target = cell.targets[cell.target_index(planned.target)];
  Touch made;
  made.target = planned.target;
  made.set = planned.set;
  made.positioner_rad = planned.positioner_rad;
  const auto at = [&](double s) {
    JointVector q = planned.standoff;
    for (std::size_t i = 0; i < q.size(); ++i) q[i] += s * (planned.end[i] - planned.standoff[i]);
    return q;
  };
  const auto gap = [&](double s) {
    const PreparedPose pose = arm.prepare(at(s), 0, nullptr, carrier_rad(made, target));
    return (arm.position(pose, x.data()) - target.centre_m).norm() - target.diameter_m / 2.0;
  };
  double out = -0.8, in = 1.8;
  if (gap(out) < 0.0 || gap(in) > 0.0) return std::nullopt;
  for (int k = 0; k < 60; ++k) (gap((out + in) / 2.0) > 0.0 ? out : in) = (out + in) / 2.0;
  made.joint_rad = at(out);
  return made;
}

struct PositionerSession {
  Cell cell = cell_with_positioner();
  ArmModel arm{cell};
  Eigen::VectorXd x = Eigen::VectorXd::Zero(arm.size());
  std::vector<Touch> touches;

  PositionerSession() {
    Random random(3);
    for (int p = 0; p < arm.size(); ++p) {
      const ArmParameter& parameter = arm.parameters()[static_cast<std::size_t>(p)];
      // A tenth of the arm's tolerances, so that the positioner's errors are the large ones.
      const double share = parameter.kind == ParameterKind::kPositioner ? 1.0 : 0.1;
      x[p] = share * parameter.sigma * random.normal();
    }
    PlanOptions options;
    options.fit_touches = 70;
    options.check_touches = 15;
    for (const PlannedTouch& planned : make_plan(cell, options).touches)
      if (auto one = contact(arm, x, cell, planned)) touches.push_back(std::move(*one));
  }
};

const PositionerSession& session() {
  static const PositionerSession one;
  return one;
}

const Calibration& with_positioner() {
  static const Calibration found = identify(session().cell, session().touches);
  return found;
}

TEST(PositionerIdentified, ItsErrorsAreFoundAgain) {
  const Calibration& c = with_positioner();
  EXPECT_GT(c.before.rms_m, 3e-4);
  EXPECT_LT(c.check.rms_m, 2e-5);
  EXPECT_TRUE(c.verdict.publish());
  for (int p = 0; p < session().arm.size(); ++p) {
    const ArmParameter& parameter = session().arm.parameters()[static_cast<std::size_t>(p)];
    if (parameter.kind != ParameterKind::kPositioner) continue;
    const ParameterResult* found = find(c, parameter);
    ASSERT_NE(found, nullptr);
    EXPECT_LT(std::abs(found->correction - session().x[p]), 4.0 * found->sigma)
        << parameter_name(c.cell, parameter);
    // A scale of this size moves the spheres by little more than the noise of a touch.
    if (AxisError{parameter.axis} != AxisError::kScale) {
      EXPECT_LT(found->sigma, 0.5 * parameter.sigma) << parameter_name(c.cell, parameter);
    }
  }
}

TEST(PositionerIdentified, ItsAxesAreStatedAsLinesWithBounds) {
  const Calibration& c = with_positioner();
  ASSERT_EQ(c.positioner.size(), 2u);
  EXPECT_EQ(c.positioner[0].axis, "E1");
  EXPECT_EQ(c.positioner[1].axis, "E2");
  Robot found = c.cell.robot;
  for (std::size_t j = 0; j < 2; ++j) {
    const PositionerLine& line = c.positioner[j];
    EXPECT_GT(line.place_u95_m, 0.0);
    EXPECT_LT(line.place_u95_m, 2e-4);
    EXPECT_GT(line.direction_u95_rad, 0.0);
    EXPECT_LT(line.direction_u95_rad, 5e-4);
    found.positioner[j].frame = line.frame;
    const Eigen::Isometry3d place = carried_at(found, std::vector<double>(j + 1, 0.0));
    EXPECT_LT((place.translation() - line.point_m).norm(), 1e-12);
    EXPECT_LT((place.linear().col(2) - line.direction).norm(), 1e-12);
  }
}

TEST(PositionerIdentified, OutlivesTheCalibrationFile) {
  const Calibration& c = with_positioner();
  const Calibration again = calibration_from_json(calibration_to_json(c), "c.json");
  EXPECT_EQ(again.parameters.size(), c.parameters.size());
  ASSERT_EQ(again.positioner.size(), 2u);
  EXPECT_NEAR(again.positioner[1].place_u95_m, c.positioner[1].place_u95_m, 1e-12);
}

TEST(PositionerIdentified, TakenForExactItLeavesItsErrors) {
  Cell exact = session().cell;
  for (PositionerAxis& axis : exact.robot.positioner)
    axis.place_sigma_m = axis.direction_sigma_rad = axis.scale_sigma = 0.0;
  const Calibration without = identify_single_pass(exact, session().touches);
  EXPECT_GT(without.chi2_per_dof, 10.0 * with_positioner().chi2_per_dof);
  EXPECT_EQ(without.positioner.size(), 2u);  // as drawn, its place in the base still has a bound
}

TEST(PositionerIdentified, AnAngleThatIsNotANumberIsRefused) {
  std::vector<Touch> touches = session().touches;
  touches[3].positioner_rad[1] = std::nan("");
  EXPECT_THROW(identify(session().cell, touches), IdentifyError);
}

TEST(PositionerIdentified, AnUpdateRefusesIt) {
  EXPECT_THROW(update(with_positioner(), session().touches, {}), PositionerError);
}

}  // namespace
}  // namespace cellcal::calib
