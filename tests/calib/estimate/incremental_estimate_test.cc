// An incremental estimate agrees with one computed from scratch.

#include "calib/estimate/incremental_estimate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/estimate/region.h"
#include "calib/identify/identify.h"
#include "calib/model/error.h"
#include "tests/calib/simulate.h"
#include "tests/calib/thrown.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::make_touches;

std::vector<Touch> touches_of(unsigned seed, int count, double outlier_share = 0.0) {
  return make_touches(demo_cell(), testing::plain_truth(demo_cell(), seed),
                      {.fit = count, .outlier_share = outlier_share, .seed = seed})
      .touches;
}

/// rms displacement of the tip over the workspace, base aligned: by one standard deviation of the
/// covariance, and by the difference between two solutions.
struct Moved {
  double sigma_m, difference_m;
};
Moved moved(const IncrementalEstimate& estimate, const Calibration& whole) {
  const ArmModel& arm = estimate.problem().arm();
  const Eigen::VectorXd x = estimate.x_si(), one = Eigen::VectorXd::Ones(arm.size());
  const Eigen::MatrixXd moves =
      aligned_moves(arm, workspace_poses(arm, 50, 3), x.data(), one) / std::sqrt(50.0);
  Eigen::VectorXd difference(arm.size());
  for (int i = 0; i < arm.size(); ++i) {
    const ParameterResult& p = whole.parameters[static_cast<std::size_t>(i)];
    difference[i] = x[i] - p.nominal - p.correction;
  }
  const Eigen::MatrixXd covariance = estimate.covariance_si().topLeftCorner(arm.size(), arm.size());
  return {std::sqrt((moves * covariance * moves.transpose()).trace()), (moves * difference).norm()};
}

TEST(Running, TouchesTakenOneByOneSayWhatAllAtOnceSay) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    const std::vector<Touch> all = touches_of(seed, 90, 0.05);
    IncrementalEstimate estimate(demo_cell(), {all.begin(), all.begin() + 45});
    for (std::size_t i = 45; i < all.size(); ++i) estimate.add(all[i]);
    const Calibration whole = identify(demo_cell(), all);
    const Moved m = moved(estimate, whole);
    EXPECT_LT(m.difference_m, 0.1 * m.sigma_m);
    const Eigen::Index arm = estimate.problem().arm_size();
    const double inflation = std::max(1.0, whole.chi2_per_dof);
    const Eigen::VectorXd one = Eigen::VectorXd::Ones(arm);
    const Eigen::VectorXd x = estimate.x_si();
    const Eigen::MatrixXd moves = aligned_moves(
        estimate.problem().arm(), workspace_poses(estimate.problem().arm(), 50, 3), x.data(), one);
    const auto predicted = [&](const Eigen::MatrixXd& covariance) {
      return predicted_mean_error_m(moves, covariance.topLeftCorner(arm, arm),
                                    Eigen::VectorXd::Zero(moves.rows() / 3));
    };
    const double expected = predicted(whole.covariance / inflation);
    EXPECT_NEAR(predicted(estimate.covariance_si()), expected, 0.05 * expected);
    for (const Outlier& outlier : whole.outliers) EXPECT_FALSE(estimate.in_use()[outlier.touch]);
  }
}

TEST(Running, RepeatsWeighAsTheyDoAllAtOnce) {
  // Two places, touched five times each.
  std::vector<Touch> all = touches_of(3, 60);
  for (int times = 0; times < 4; ++times)
    for (const std::size_t place : {50, 55}) {
      Touch again = all[place];
      again.joint_rad[0] += 1e-5 * (times + 1);
      again.joint_rad[1] -= 2e-5 * (times - 1);
      all.push_back(std::move(again));
    }
  IncrementalEstimate estimate(demo_cell(), {all.begin(), all.begin() + 55});
  for (std::size_t i = 55; i < all.size(); ++i) estimate.add(all[i]);
  const Problem& p = estimate.problem();
  const IncrementalEstimate without(demo_cell(), {all.begin(), all.begin() + 60});
  EXPECT_NEAR(p.joint_lever_m(49), without.problem().joint_lever_m(49), 1e-2);
  EXPECT_NEAR(p.joint_lever_m(50), std::sqrt(5.0) * without.problem().joint_lever_m(50), 2e-2);
  // Noise from the file and from the scatter of the repeats, as in identify(), where starts differ.
  const Calibration whole = identify(demo_cell(), all);
  EXPECT_NEAR(p.own_sigma_m(0), whole.repeats.used_m, 1e-3 * whole.repeats.used_m);
  EXPECT_LT(p.own_sigma_m(0), 0.9 * demo_cell().touch_sigma_m);
  const Moved m = moved(estimate, whole);
  EXPECT_LT(m.difference_m, 0.1 * m.sigma_m);
}

TEST(Running, EveryHonestTouchMakesItSurer) {
  const std::vector<Touch> all = touches_of(5, 52);
  IncrementalEstimate estimate(demo_cell(), {all.begin(), all.begin() + 45});
  Eigen::MatrixXd before = estimate.covariance_si();
  for (std::size_t i = 45; i < all.size(); ++i) {
    const IncrementalEstimate::Taken taken = estimate.add(all[i]);
    ASSERT_FALSE(taken.anew);  // otherwise the levels' weights may change
    const Eigen::MatrixXd after = estimate.covariance_si();
    EXPECT_LT(after.diagonal().cwiseQuotient(before.diagonal()).minCoeff(), 1.0) << i;
    before = after;
  }
}

TEST(Running, AGrossTouchIsNotBelieved) {
  const std::vector<Touch> all = touches_of(6, 60);
  IncrementalEstimate estimate(demo_cell(), {all.begin(), all.end() - 1});
  const Eigen::VectorXd before = estimate.x_si();
  Touch wrong = all.back();
  wrong.joint_rad[1] += 2e-3;  // two millimetres at one metre
  const IncrementalEstimate::Taken taken = estimate.add(wrong);
  EXPECT_TRUE(taken.outlier);
  EXPECT_GT(taken.off_sigma, 5.0);
  EXPECT_FALSE(estimate.in_use().back());
  EXPECT_EQ(before, estimate.x_si());
}

TEST(Running, ATargetNotTouchedBeforeIsTakenInFromNothing) {
  std::vector<Touch> known, other;
  for (const Touch& touch : touches_of(7, 80))
    (touch.target == demo_cell().targets.back().id ? other : known).push_back(touch);
  IncrementalEstimate estimate(demo_cell(), known);
  const int unknowns = estimate.problem().size();
  EXPECT_TRUE(estimate.add(other[0]).anew);
  EXPECT_GT(estimate.problem().size(), unknowns);
  for (std::size_t i = 1; i < other.size(); ++i) estimate.add(other[i]);
  std::vector<Touch> all = known;
  all.insert(all.end(), other.begin(), other.end());
  const Moved m = moved(estimate, identify(demo_cell(), all));
  EXPECT_LT(m.difference_m, 0.1 * m.sigma_m);
}

TEST(Running, ACheckTouchSaysNothing) {
  std::vector<Touch> all = touches_of(8, 50);
  IncrementalEstimate estimate(demo_cell(), {all.begin(), all.end() - 1});
  const Eigen::VectorXd before = estimate.x_si();
  all.back().set = TouchSet::kCheck;
  estimate.add(all.back());
  EXPECT_EQ(before, estimate.x_si());
  EXPECT_EQ(estimate.touches().size(), all.size());
}

TEST(Running, ATouchThatCannotBeIsRefusedAndNothingChanges) {
  const std::vector<Touch> all = touches_of(9, 50);
  IncrementalEstimate estimate(demo_cell(), {all.begin(), all.end() - 1});
  const Eigen::VectorXd before = estimate.x_si();
  Touch wrong = all.back();
  wrong.joint_rad[2] = std::numeric_limits<double>::quiet_NaN();
  const auto error = testing::thrown<IdentifyError>([&] { estimate.add(wrong); });
  EXPECT_EQ(error.kind, IdentifyError::Kind::kTouches);
  EXPECT_EQ(error.target, wrong.target);
  wrong = all.back();
  wrong.target = "S9";
  EXPECT_ANY_THROW(estimate.add(wrong));
  wrong = all.back();
  wrong.joint_rad.pop_back();
  EXPECT_ANY_THROW(estimate.add(wrong));
  EXPECT_EQ(estimate.touches().size(), all.size() - 1);
  EXPECT_EQ(before, estimate.x_si());
  EXPECT_FALSE(estimate.add(all.back()).outlier);
}

}  // namespace
}  // namespace cellcal::calib
