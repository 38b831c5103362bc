// Causes of a predicted uncertainty above the goal.

#include "calib/plan/missing.h"

#include <gtest/gtest.h>

#include "calib/model/units.h"
#include "calib/plan/plan.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;

/// Postures that differ in A2 and A3.
std::vector<JointVector> postures() {
  std::vector<JointVector> all;
  for (int k = 0; k <= 60; ++k)
    all.push_back({0.0, (-90.0 + k) * kRadPerDeg, (40.0 + k) * kRadPerDeg, 0.0, 0.5, 0.0});
  return all;
}

/// Two unknowns: a wave of A2 and a length, which move the tip as stated at a posture.
struct Case {
  std::vector<JointVector> q = postures();
  Eigen::MatrixXd moves_m = Eigen::MatrixXd::Zero(3 * static_cast<Eigen::Index>(q.size()), 2);
  Eigen::MatrixXd covariance_u = Eigen::MatrixXd::Identity(2, 2);
  std::vector<ParameterKey> keys{wave_parameter(ParameterKind::kFunctionSine, 1, 9),
                                 joint_parameter(ParameterKind::kD, 2)};
  Eigen::VectorXd prior_weight = Eigen::VectorXd::Ones(2);

  Missing found(double ripple_rad = 0.0) const {
    return largest_part(ArmModel(demo_cell()),
                        {q, moves_m, covariance_u, keys, prior_weight, ripple_rad});
  }
};

TEST(Missing, IsTheJointWhoseFunctionIsLeftWithTheAnglesWhereItIsLeft) {
  Case c;
  c.moves_m.col(1).setConstant(1e-5);
  for (Eigen::Index k = 20; k < 30; ++k) c.moves_m.block<3, 1>(3 * k, 0).setConstant(1e-4);
  const Missing missing = c.found();
  EXPECT_EQ(missing.source, UncertaintySource::kTransmission);
  EXPECT_EQ(missing.joint, demo_cell().robot.joints[1].name);
  EXPECT_NEAR(missing.from_rad, -70.0 * kRadPerDeg, 1e-9);
  EXPECT_NEAR(missing.to_rad, -60.0 * kRadPerDeg, 1e-9);
  EXPECT_NEAR(missing.share, 1e-8 * 10 / (1e-8 * 10 + 1e-10 * 61), 1e-9);
  EXPECT_EQ(words(phrase_of(missing)),
            "94 % of the remaining variance: transmission error of A2, most of it from -70 to -60 "
            "deg. Allow more touches with A2 there, or choose a smaller region");
}

TEST(Missing, IsAnotherSourceWhereThatHasMore) {
  Case c;
  c.moves_m.setConstant(1e-5);
  c.moves_m.col(1) *= 2.0;
  EXPECT_EQ(c.found().source, UncertaintySource::kArmLengths);
  EXPECT_NE(words(phrase_of(c.found())).find("lengths of the arm"), std::string::npos);
  EXPECT_EQ(c.found(1.0).source, UncertaintySource::kRipple);
  c.covariance_u *= 0.5;  // half of each variance is what the touches' noise leaves
  c.moves_m.col(0) = c.moves_m.col(1);
  EXPECT_EQ(c.found().source, UncertaintySource::kTouches);
}

TEST(PlanToAGoal, HasAsManyTouchesAsItTakesAndSaysWhatIsMissing) {
  PlanOptions options;
  options.fit_touches = 60;
  options.check_touches = 0;
  options.goal_u95_m = 0.5e-3;
  const Plan easy = make_plan(demo_cell(), options);
  EXPECT_LT(easy.touches.size(), 60U);
  EXPECT_LE(easy.predicted_u95_m, options.goal_u95_m);
  EXPECT_FALSE(easy.missing);
  options.goal_u95_m = 0.01e-3;
  const Plan hard = make_plan(demo_cell(), options);
  EXPECT_EQ(hard.touches.size(), 60U);
  EXPECT_GT(hard.predicted_u95_m, options.goal_u95_m);
  ASSERT_TRUE(hard.missing);
  EXPECT_GT(hard.missing->share, 0.0);
  EXPECT_LT(hard.missing->share, 1.0);
}

}  // namespace
}  // namespace cellcal::calib
