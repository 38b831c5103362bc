#include <gtest/gtest.h>

#include <limits>

#include "calib/result/calibration.h"
#include "calib/result/unidentifiable.h"

namespace cellcal::calib {
namespace {

Calibration with_parameters(int count) {
  Calibration calibration;
  calibration.parameters.resize(static_cast<std::size_t>(count));
  calibration.covariance = Eigen::MatrixXd::Identity(count, count);
  return calibration;
}

TEST(StrongCorrelations, FindsPairsOnBothSidesOfZeroStrongestFirst) {
  Calibration calibration = with_parameters(4);
  calibration.covariance.diagonal() << 4.0, 1.0, 9e-8, 1.0;
  calibration.covariance(0, 1) = calibration.covariance(1, 0) = 0.92 * 2.0;
  calibration.covariance(2, 3) = calibration.covariance(3, 2) = -0.97 * 3e-4;
  const Correlations strong = strong_correlations(calibration, 0.9);
  ASSERT_TRUE(strong.available);
  EXPECT_FALSE(strong.frame_removed);
  ASSERT_EQ(strong.pairs.size(), 2U);
  EXPECT_EQ(strong.pairs[0].first, 2U);
  EXPECT_EQ(strong.pairs[0].second, 3U);
  EXPECT_NEAR(strong.pairs[0].correlation, -0.97, 1e-12);
  EXPECT_NEAR(strong.pairs[1].correlation, 0.92, 1e-12);
}

// The height of the base and the heights of two spheres, in mm: the touches determine only each
// sphere's height above the base. Tolerances 0.7 mm for the base, 20 mm for the spheres.
Calibration heights(double touch_sigma) {
  Calibration calibration = with_parameters(3);
  const Eigen::Vector3d prior_sigma(0.7, 20.0, 20.0);
  Eigen::MatrixXd jacobian(2, 3);
  jacobian << -1.0, 1.0, 0.0, -1.0, 0.0, 1.0;
  jacobian /= touch_sigma;
  Eigen::Matrix3d precision = jacobian.transpose() * jacobian;
  precision.diagonal() += prior_sigma.cwiseAbs2().cwiseInverse();
  calibration.covariance = precision.inverse();
  const Eigen::Vector3d together = Eigen::Vector3d::Ones();
  calibration.frame_basis = together / together.cwiseQuotient(prior_sigma).norm();
  return calibration;
}

TEST(StrongCorrelations, TakeTheFrameOut) {
  Calibration calibration = heights(0.05);
  const Correlations strong = strong_correlations(calibration, 0.9);
  EXPECT_TRUE(strong.available);
  EXPECT_TRUE(strong.frame_removed);
  EXPECT_TRUE(strong.pairs.empty());

  calibration.frame_basis.resize(0, 0);
  const Correlations raw = strong_correlations(calibration, 0.9);
  EXPECT_FALSE(raw.frame_removed);
  EXPECT_EQ(raw.pairs.size(), 3U) << "with the frame left in, everything goes together";
}

TEST(StrongCorrelations, SurviveTheRemovalOfTheFrameWhereTheyAreReal) {
  Calibration calibration = heights(0.05);
  // Both heights depend on the same uncertain touch: a common error of 0.3 mm.
  calibration.covariance(1, 1) += 0.09;
  calibration.covariance(2, 2) += 0.09;
  calibration.covariance(1, 2) += 0.09;
  calibration.covariance(2, 1) += 0.09;
  const Correlations strong = strong_correlations(calibration, 0.9);
  EXPECT_TRUE(strong.frame_removed);
  ASSERT_EQ(strong.pairs.size(), 1U);
  EXPECT_EQ(strong.pairs[0].first, 1U);
  EXPECT_EQ(strong.pairs[0].second, 2U);
  EXPECT_NEAR(strong.pairs[0].correlation, 0.09 / (0.09 + 0.05 * 0.05), 1e-3);
}

TEST(StrongCorrelations, KeepsTheFrameWhereTheCovarianceCannotBeFactored) {
  Calibration calibration = with_parameters(2);
  calibration.covariance << 1.0, 1.0, 1.0, 1.0;
  calibration.frame_basis = Eigen::MatrixXd::Ones(2, 1);
  const Correlations strong = strong_correlations(calibration, 0.9);
  EXPECT_TRUE(strong.available);
  EXPECT_FALSE(strong.frame_removed);
  EXPECT_EQ(strong.pairs.size(), 1U);
}

TEST(StrongCorrelations, AreNotAvailableWithoutAUsableCovariance) {
  EXPECT_FALSE(strong_correlations(Calibration{}, 0.9).available);
  Calibration wrong_size = with_parameters(3);
  wrong_size.covariance.resize(2, 2);
  wrong_size.covariance.setZero();
  EXPECT_FALSE(strong_correlations(wrong_size, 0.9).available);
  Calibration poisoned = with_parameters(3);
  poisoned.covariance(1, 2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(strong_correlations(poisoned, 0.9).available);
}

TEST(StrongCorrelations, IgnoreParametersWithoutVariance) {
  Calibration calibration = with_parameters(3);
  calibration.covariance(1, 1) = 0.0;
  calibration.covariance(2, 2) = -1.0;
  const Correlations strong = strong_correlations(calibration, 0.9);
  EXPECT_TRUE(strong.available);
  EXPECT_TRUE(strong.pairs.empty());
}

TEST(StrongCorrelations, AreEmptyWhenNoParameterVaries) {
  Calibration calibration = with_parameters(2);
  calibration.covariance.setZero();
  calibration.frame_basis = Eigen::MatrixXd::Ones(2, 1);
  EXPECT_TRUE(strong_correlations(calibration, 0.9).pairs.empty());
}

TEST(StrongCorrelations, WithTargetsOrTheFrameAreCountedNotListed) {
  Calibration calibration = with_parameters(4);
  calibration.parameters[0].key = joint_parameter(ParameterKind::kTheta, 0);
  calibration.parameters[1].key = joint_parameter(ParameterKind::kTheta, 1);
  calibration.parameters[2].key = target_parameter(ParameterKind::kCentre, 0);
  calibration.parameters[3].key = tool_parameter(ParameterKind::kTcp, 0);
  calibration.parameters[0].decided_by = DecidedBy::kFrame;
  calibration.covariance.setConstant(0.95);
  calibration.covariance.diagonal().setOnes();
  const Correlations strong = strong_correlations(calibration);
  EXPECT_EQ(strong.of_targets_or_frame, 5U);
  ASSERT_EQ(strong.pairs.size(), 1U);
  EXPECT_EQ(strong.pairs[0].first, 1U);
  EXPECT_EQ(strong.pairs[0].second, 3U);
}

}  // namespace
}  // namespace cellcal::calib
