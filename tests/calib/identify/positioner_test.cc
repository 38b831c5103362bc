// The errors of a positioner are recovered from touches of the spheres on it.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "calib/estimate/external_axes.h"
#include "calib/estimate/predict.h"
#include "calib/files/calibration_json.h"
#include "calib/files/files.h"
#include "calib/identify/identify.h"
#include "calib/identify/identify_once.h"
#include "calib/model/error.h"
#include "calib/model/linear.h"
#include "tests/calib/positioner_session.h"

namespace cellcal::calib {
namespace {

using testing::PositionerSession;

const PositionerSession& session() {
  static const PositionerSession one(CELLCAL_POSITIONER_ROBOT);
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
    // A scale error of this size moves the spheres by little more than the touch noise.
    if (AxisError{parameter.axis} != AxisError::kScale) {
      EXPECT_LT(found->sigma, 0.5 * parameter.sigma) << parameter_name(c.cell, parameter);
    }
  }
}

TEST(PositionerIdentified, WhatItGivesUnderItsLoadIsFound) {
  const PositionerSession loaded(CELLCAL_POSITIONER_ROBOT, 1e-5, 300.0);
  const Calibration c = identify(loaded.cell, loaded.touches);
  EXPECT_TRUE(c.verdict.publish());
  EXPECT_LT(c.check.rms_m, 3e-5);
  int found = 0;
  for (int p = 0; p < loaded.arm.size(); ++p) {
    const ArmParameter& parameter = loaded.arm.parameters()[static_cast<std::size_t>(p)];
    if (parameter.carrier < 0 || parameter.axis < static_cast<int>(AxisError::kCompliance))
      continue;
    const ParameterResult* is = find(c, parameter);
    ASSERT_NE(is, nullptr);
    EXPECT_LT(std::abs(is->correction - loaded.x[p]), 4.0 * is->sigma)
        << parameter_name(c.cell, parameter);
    found += is->sigma < 0.5 * parameter.sigma;
  }
  EXPECT_GE(found, 2) << "about the tilting axis, and across it";
  // If it is assumed to be rigid, the same touches leave a misfit.
  Cell stiff = loaded.cell;
  for (PositionerAxis& axis : stiff.robot.positioner) axis.mass_kg = 0.0;
  EXPECT_GT(identify_single_pass(stiff, loaded.touches).check.rms_m, 2.0 * c.check.rms_m);
  const std::vector<double> e = {0.4, -1.3};
  const JointVector q = {0.1, -1.2, 1.5, 0.2, 0.8, -0.3};
  EXPECT_TRUE((carried_as_found(c, e) * Predictor(c, 2).calibrated(q, e).tcp)
                  .isApprox(Predictor(c).calibrated(q).tcp, 1e-12));
  const Calibration again = calibration_from_json(calibration_to_json(c), "c.json");
  EXPECT_TRUE(carried_as_found(again, e).isApprox(carried_as_found(c, e), 1e-9));
  EXPECT_GT(largest_give_rad(c, 0) + largest_give_rad(c, 1), 1e-4);
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

TEST(PositionerIdentified, StatesTheAnglesThatItsSpheresWereTouchedAt) {
  for (std::size_t j = 0; j < 2; ++j) {
    const auto& range = with_positioner().positioner[j].touched_rad;
    ASSERT_TRUE(range.has_value());
    const PositionerAxis& axis = session().cell.robot.positioner[j];
    EXPECT_GE((*range)[0], axis.min_rad - 1e-9);
    EXPECT_LE((*range)[1], axis.max_rad + 1e-9);
    EXPECT_GT((*range)[1] - (*range)[0], 0.5 * (axis.max_rad - axis.min_rad));
  }
  EXPECT_EQ(calibration_from_json(calibration_to_json(with_positioner()), "c.json")
                .positioner[1]
                .touched_rad.has_value(),
            true);
}

TEST(PositionerPredicted, IsWhereTheTableAsFoundHasTheTip) {
  const Calibration& c = with_positioner();
  const Predictor in_base(c), on_table(c, 2), on_first(c, 1);
  const JointVector q = {0.1, -1.2, 1.5, 0.2, 0.8, -0.3};
  const std::vector<double> e = {0.4, -1.3};
  const Eigen::Isometry3d tcp = in_base.calibrated(q).tcp;
  EXPECT_TRUE((carried_as_found(c, e) * on_table.calibrated(q, e).tcp).isApprox(tcp, 1e-12));
  const std::span<const double> first = std::span(e).first(1);
  EXPECT_TRUE(
      (carried_as_found(c, first) * on_first.calibrated(q, first).tcp).isApprox(tcp, 1e-12));
  EXPECT_GT(on_table.calibrated(q, e).u95_m, 0.0);
  EXPECT_THROW(on_table.calibrated(q, std::vector<double>{0.0, 0.0, 0.0}), std::invalid_argument);
}

/// Predicted and true tips on the table, and the bound, over poses near its spheres.
struct OnTable {
  Eigen::Matrix3Xd told, real;
  std::vector<double> u95_m;
};

OnTable on_table_of(const Calibration& c, const std::vector<CarriedPose>& poses) {
  const Predictor predictor(c, 2);
  const auto count = static_cast<Eigen::Index>(poses.size());
  OnTable at{Eigen::Matrix3Xd(3, count), Eigen::Matrix3Xd(3, count), {}};
  for (Eigen::Index k = 0; k < count; ++k) {
    const CarriedPose& one = poses[static_cast<std::size_t>(k)];
    const Prediction told = predictor.calibrated(one.joint_rad, one.carrier_rad);
    at.told.col(k) = told.tcp.translation();
    at.real.col(k) = session().arm.position(
        session().arm.prepare(one.joint_rad, 0, nullptr, one.carrier_rad), session().x.data());
    at.u95_m.push_back(told.u95_m);
  }
  return at;
}

TEST(PositionerPredicted, TheBoundOnTheTableHoldsForTheArmAsItIs) {
  const Calibration& c = with_positioner();
  const auto poses = carried_poses(ArmModel(c.cell), c, 2, 300, 11);
  ASSERT_GT(poses.size(), 200u);
  const OnTable at = on_table_of(c, poses);
  // The base is aligned on the table over successive angles.
  const Eigen::Isometry3d base = calib::rigid_motion(at.told, at.real);
  int inside = 0;
  double sum_m = 0.0, bound_m = 0.0;
  for (Eigen::Index k = 0; k < at.told.cols(); ++k) {
    const double off_m = (base * at.told.col(k) - at.real.col(k)).norm();
    inside += off_m <= at.u95_m[static_cast<std::size_t>(k)];
    sum_m += off_m;
    bound_m += at.u95_m[static_cast<std::size_t>(k)];
  }
  EXPECT_GE(inside, 0.95 * static_cast<double>(poses.size()));
  EXPECT_LT(bound_m, 20.0 * sum_m);  // yet not meaningless
  EXPECT_LT(sum_m / static_cast<double>(poses.size()), 1e-4);
}

TEST(PositionerPredicted, IsRefusedOnAnAxisWithoutATouchedTarget) {
  Calibration c = with_positioner();
  std::erase_if(c.targets, [](const TargetResult& target) { return target.id.starts_with("T"); });
  EXPECT_NO_THROW(Predictor{c});
  try {
    Predictor(c, 2);
    FAIL();
  } catch (const PositionerError& error) {
    EXPECT_NE(std::string(error.what()).find("stands on E2"), std::string::npos) << error.what();
  }
}

TEST(PositionerScope, IsNearTheTargetsInTheirOwnFrame) {
  Calibration c = with_positioner();
  c.verdict.workspace = false;
  const Scope scope(c);
  const TargetResult& on_table = *std::ranges::find(c.targets, "T1", &TargetResult::id);
  EXPECT_TRUE(scope.holds_at(on_table.centre_m, 2));
  EXPECT_FALSE(scope.holds_at(on_table.centre_m, 0));
  EXPECT_FALSE(scope.holds_at(on_table.centre_m, 1));
  EXPECT_TRUE(scope.holds_at(std::ranges::find(c.targets, "S4", &TargetResult::id)->centre_m));
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

}  // namespace
}  // namespace cellcal::calib
