#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "calib/files/calibration_json.h"
#include "calib/model/kinematics.h"
#include "calib/model/linear.h"
#include "calib/result/level.h"
#include "tests/calib/priors/simulated_fleet.h"

namespace cellcal::calib::testing {
namespace {

Calibration one_arm(int touches = 60) { return fleet_of(1, uneven(), touches).front(); }

SetAsideKind refused(const Calibration& c) {
  const auto result = evidence_of(c);
  const auto* why = std::get_if<SetAsideKind>(&result);
  EXPECT_NE(why, nullptr);
  return why == nullptr ? SetAsideKind::kUnreadable : *why;
}

TEST(Evidence, WithThePriorsPutBackIsTheCalibration) {
  const Calibration c = one_arm();
  const ArmEvidence e = std::get<ArmEvidence>(evidence_of(c));
  const ArmModel arm(at_level(c.cell, {}));
  const auto n = static_cast<Eigen::Index>(e.keys.size());
  Eigen::VectorXd sigma(n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (const ArmParameter& p : arm.parameters())
      if (p == e.keys[static_cast<std::size_t>(i)]) sigma[i] = p.sigma;
  // In sigmas: what is omitted for directions decided by the prior is below a fiftieth.
  const Eigen::MatrixXd rows = e.rows * sigma.asDiagonal();
  const Cholesky posterior(rows.transpose() * rows + Eigen::MatrixXd::Identity(n, n));
  const Eigen::VectorXd mean = posterior.solve(Eigen::VectorXd(rows.transpose() * e.values));
  for (Eigen::Index i = 0; i < n; ++i) {
    const ParameterResult* p = find(c, e.keys[static_cast<std::size_t>(i)]);
    EXPECT_NEAR(mean[i], p->correction / sigma[i], 0.25);
    EXPECT_NEAR(posterior.inverse()(i, i), std::pow(p->sigma / sigma[i], 2), 0.021);
  }
}

TEST(Evidence, OfACalibrationWidenedByItsScatterIsThatMuchLess) {
  Calibration c = one_arm();
  const ArmEvidence plain = std::get<ArmEvidence>(evidence_of(c));
  c.chi2_per_dof = 4.0;
  c.covariance *= 4.0;
  const ArmEvidence widened = std::get<ArmEvidence>(evidence_of(c));
  ASSERT_EQ(plain.values.size(), widened.values.size())
      << "what the prior decided is no news by it";
  EXPECT_NEAR((plain.rows.transpose() * plain.rows).trace() /
                  (widened.rows.transpose() * widened.rows).trace(),
              4.0, 1e-6);
}

TEST(Evidence, IsTheSameOfTheCalibrationsFile) {
  const Calibration c = one_arm();
  const ArmEvidence e = std::get<ArmEvidence>(evidence_of(c));
  const ArmEvidence of_file = std::get<ArmEvidence>(
      evidence_of(calibration_from_json(calibration_to_json(c), "calibration.json")));
  EXPECT_EQ(of_file.nominal_geometry, e.nominal_geometry);
  ASSERT_EQ(of_file.keys, e.keys);
  // Eigenvectors have arbitrary signs.
  const Eigen::MatrixXd information = e.rows.transpose() * e.rows;
  const Eigen::VectorXd scale = information.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd off = of_file.rows.transpose() * of_file.rows - information;
  EXPECT_LT((scale.asDiagonal() * off * scale.asDiagonal()).cwiseAbs().maxCoeff(), 1e-5);
  EXPECT_NEAR(of_file.values.norm() / e.values.norm(), 1.0, 1e-6);
}

TEST(Evidence, OfAWithheldCalibrationIsNone) {
  Calibration c = one_arm();
  c.verdict.judged = false;
  EXPECT_EQ(refused(c), SetAsideKind::kWithheld);
}

TEST(Evidence, WithoutTouchesIsNone) {
  EXPECT_EQ(refused(one_arm(0)), SetAsideKind::kUninformative);
  Calibration on_a_track = one_arm();
  on_a_track.cell.robot.joints[0].guide.emplace();
  EXPECT_EQ(refused(on_a_track), SetAsideKind::kOtherNominalGeometry);
}

TEST(Evidence, ThatContradictsItselfIsNone) {
  Calibration wider = one_arm();
  wider.covariance *= 9.0;
  EXPECT_EQ(refused(wider), SetAsideKind::kInconsistent) << "less sure than beforehand";
  Calibration without = one_arm();
  without.covariance.resize(0, 0);
  EXPECT_EQ(refused(without), SetAsideKind::kInconsistent);
  Calibration not_a_number = one_arm();
  not_a_number.parameters[3].correction = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refused(not_a_number), SetAsideKind::kInconsistent);
  Calibration infinite = one_arm();
  infinite.covariance(2, 2) = std::numeric_limits<double>::infinity();
  EXPECT_EQ(refused(infinite), SetAsideKind::kInconsistent);
}

}  // namespace
}  // namespace cellcal::calib::testing
