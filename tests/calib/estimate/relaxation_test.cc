#include "calib/estimate/relaxation.h"

#include <gtest/gtest.h>

namespace cellcal::calib {
namespace {

/// Rounds until the steps towards 0 are small, of at most 20; a step is -(1 - factor) u.
int rounds_until_small(const Eigen::Vector3d& factors) {
  Eigen::VectorXd u = Eigen::Vector3d(3.0, -2.0, 1.0);
  Relaxation relaxation;
  int round = 0;
  for (; round < 20; ++round) {
    const Eigen::VectorXd step = factors.cwiseProduct(u) - u;
    if (step.lpNorm<Eigen::Infinity>() < 1e-2) break;
    u += relaxation.share_of(step) * step;
  }
  return round;
}

TEST(Relaxation, SettlesWhatTurnsBackWithoutBecomingSmall) {
  EXPECT_LT(rounds_until_small({-1.0, 0.1, 0.0}), 12);
  EXPECT_LT(rounds_until_small({-1.3, -0.9, 0.1}), 16);
}

TEST(Relaxation, TakesStepsThatBecomeSmallAsTheyAre) {
  Relaxation relaxation;
  Eigen::VectorXd step = Eigen::Vector2d(1.0, -1.0);
  for (const double factor : {0.5, 0.9, -0.2, 0.1, 0.0}) {
    EXPECT_EQ(relaxation.share_of(step), 1.0);
    step *= factor;
  }
}

TEST(Relaxation, ForgetsTheStepsOfAnotherProblem) {
  Relaxation relaxation;
  relaxation.share_of(Eigen::Vector2d(1.0, 1.0));
  EXPECT_LT(relaxation.share_of(Eigen::Vector2d(-1.0, -1.0)), 1.0);
  relaxation.forget();
  EXPECT_EQ(relaxation.share_of(Eigen::Vector2d(1.0, 1.0)), 1.0);
}

}  // namespace
}  // namespace cellcal::calib
