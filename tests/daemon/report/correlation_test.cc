#include "daemon/report/correlation.h"

#include <gtest/gtest.h>

#include <limits>

namespace cellcal::daemon::report {
namespace {

calib::Calibration with_parameters(int count) {
  calib::Calibration calibration;
  calibration.parameters.resize(static_cast<std::size_t>(count));
  calibration.covariance = Eigen::MatrixXd::Identity(count, count);
  return calibration;
}

TEST(StrongCorrelations, FindsPairsOnBothSidesOfZeroStrongestFirst) {
  calib::Calibration calibration = with_parameters(4);
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

TEST(StrongCorrelations, TakesTheFrameOut) {
  // Parameters 0 and 1 share nothing but a frame direction that swamps both.
  calib::Calibration calibration = with_parameters(3);
  calibration.covariance *= 1e-8;
  calibration.frame_basis = Eigen::MatrixXd::Zero(3, 1);
  calibration.frame_basis(0, 0) = calibration.frame_basis(1, 0) = 1e-2;
  calibration.covariance += calibration.frame_basis * calibration.frame_basis.transpose();
  const Correlations strong = strong_correlations(calibration, 0.9);
  EXPECT_TRUE(strong.frame_removed);
  // One of the two is left along the difference; together they were one degree of freedom.
  for (const CorrelatedPair& pair : strong.pairs) {
    EXPECT_LT(pair.correlation, 0.0) << "the frame's own positive correlation must be gone";
  }
  calibration.frame_basis.resize(0, 0);
  const Correlations raw = strong_correlations(calibration, 0.9);
  ASSERT_EQ(raw.pairs.size(), 1U);
  EXPECT_GT(raw.pairs[0].correlation, 0.999);
}

TEST(StrongCorrelations, KeepsTheFrameWhereTheCovarianceCannotBeFactored) {
  calib::Calibration calibration = with_parameters(2);
  calibration.covariance << 1.0, 1.0, 1.0, 1.0;
  calibration.frame_basis = Eigen::MatrixXd::Ones(2, 1);
  const Correlations strong = strong_correlations(calibration, 0.9);
  EXPECT_TRUE(strong.available);
  EXPECT_FALSE(strong.frame_removed);
  EXPECT_EQ(strong.pairs.size(), 1U);
}

TEST(StrongCorrelations, AreNotAvailableWithoutAUsableCovariance) {
  EXPECT_FALSE(strong_correlations(calib::Calibration{}, 0.9).available);
  calib::Calibration wrong_size = with_parameters(3);
  wrong_size.covariance.resize(2, 2);
  wrong_size.covariance.setZero();
  EXPECT_FALSE(strong_correlations(wrong_size, 0.9).available);
  calib::Calibration poisoned = with_parameters(3);
  poisoned.covariance(1, 2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(strong_correlations(poisoned, 0.9).available);
}

TEST(StrongCorrelations, IgnoreParametersWithoutVariance) {
  calib::Calibration calibration = with_parameters(3);
  calibration.covariance(1, 1) = 0.0;
  calibration.covariance(2, 2) = -1.0;
  const Correlations strong = strong_correlations(calibration, 0.9);
  EXPECT_TRUE(strong.available);
  EXPECT_TRUE(strong.pairs.empty());
}

TEST(StrongCorrelations, AreEmptyWhenNoParameterVaries) {
  calib::Calibration calibration = with_parameters(2);
  calibration.covariance.setZero();
  calibration.frame_basis = Eigen::MatrixXd::Ones(2, 1);
  EXPECT_TRUE(strong_correlations(calibration, 0.9).pairs.empty());
}

}  // namespace
}  // namespace cellcal::daemon::report
