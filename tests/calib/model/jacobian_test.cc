// Every derivative against differences, two ways.

#include <ceres/cost_function.h>
#include <ceres/gradient_checker.h>
#include <gtest/gtest.h>

#include "calib/model/kinematics.h"
#include "tests/calib/model/random_arm.h"

namespace cellcal::calib {
namespace {

constexpr int kArms = 200;

/// Fourth-order central difference of the position by parameter p.
Eigen::Vector3d difference(const ArmModel& arm, const PreparedPose& pose, const Eigen::VectorXd& x,
                           int p, double step) {
  const auto at = [&](double steps) {
    Eigen::VectorXd moved = x;
    moved[p] += steps * step;
    return arm.position(pose, moved.data());
  };
  return (8.0 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12.0 * step);
}

TEST(Jacobian, OfThePositionAgreesWithDifferencesForAnyArm) {
  Random random(1);
  for (int k = 0; k < kArms; ++k) {
    const auto drawn = testing::random_arm(random);
    const ArmModel arm(drawn.robot, drawn.tool);
    const PreparedPose pose = arm.prepare(testing::random_joints(drawn.robot, random));
    const Eigen::VectorXd x = testing::random_errors(arm, random, 3.0);
    Eigen::Matrix3Xd jacobian(3, arm.size());
    arm.position(pose, x.data(), jacobian);
    for (int p = 0; p < arm.size(); ++p) {
      // A milliradian or a millimetre: truncation h^4 f'''''/30 is 1e-12 of the reach, rounding
      // of 10 m over 2e-3 is 1e-12. Where a factor (torque) stands between parameter and angle the
      // step shrinks with it and the derivative grows.
      const double factor = std::max(1.0, std::abs(pose.factor[p]));
      const Eigen::Vector3d expected = difference(arm, pose, x, p, 1e-3 / factor);
      EXPECT_LT((jacobian.col(p) - expected).norm(), 1e-10 * factor)
          << "arm " << k << " parameter " << arm.parameters()[static_cast<std::size_t>(p)].name;
    }
  }
}

/// The position in prior units, as the estimator sees it.
class PositionCost final : public ceres::CostFunction {
 public:
  PositionCost(const ArmModel& arm, PreparedPose pose) : arm_(arm), pose_(std::move(pose)) {
    set_num_residuals(3);
    mutable_parameter_block_sizes()->push_back(arm.size());
  }
  bool Evaluate(double const* const* u, double* residual, double** jacobians) const override {
    Eigen::VectorXd sigma(arm_.size()), x(arm_.size());
    for (int p = 0; p < arm_.size(); ++p) {
      sigma[p] = arm_.parameters()[static_cast<std::size_t>(p)].sigma;
      x[p] = sigma[p] * u[0][p];
    }
    Eigen::Matrix3Xd j(3, arm_.size());
    Eigen::Map<Eigen::Vector3d>{residual} = arm_.position(pose_, x.data(), j) / kUnitM;
    if (jacobians != nullptr && jacobians[0] != nullptr)
      Eigen::Map<Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>>(
          jacobians[0], 3, arm_.size()) = j * sigma.asDiagonal() / kUnitM;
    return true;
  }

 private:
  static constexpr double kUnitM = 1e-3;  // what a sigma moves: residuals about 1
  const ArmModel& arm_;
  PreparedPose pose_;
};

TEST(Jacobian, OfThePositionPassesCeresGradientChecker) {
  Random random(2);
  for (int k = 0; k < kArms; ++k) {
    const auto drawn = testing::random_arm(random);
    const ArmModel arm(drawn.robot, drawn.tool);
    const PositionCost cost(arm, arm.prepare(testing::random_joints(drawn.robot, random)));
    // Sixty sigma off, so that the second order would show.
    Eigen::VectorXd u(arm.size());
    for (int p = 0; p < u.size(); ++p) u[p] = 60.0 * random.normal();
    ceres::NumericDiffOptions numeric;
    numeric.relative_step_size = 1e-3;
    numeric.ridders_relative_initial_step_size = 1e-1;
    const std::vector<const ceres::Manifold*>* no_manifolds = nullptr;
    ceres::GradientChecker checker(&cost, no_manifolds, numeric);
    ceres::GradientChecker::ProbeResults results;
    const double* blocks[] = {u.data()};
    EXPECT_TRUE(checker.Probe(blocks, 1e-6, &results)) << "arm " << k << ": " << results.error_log;
  }
}

TEST(Jacobian, OfTheNominalToolFollowsTheAxisAnglesTheirSignIncluded) {
  Random random(3);
  constexpr double kStep = 1e-5;  // truncation h^2 of the reach, rounding 1e-15 / h: 1e-9
  for (int k = 0; k < kArms; ++k) {
    const auto drawn = testing::random_arm(random);
    const ArmModel arm(drawn.robot, drawn.tool);
    const JointVector q = testing::random_joints(drawn.robot, random);
    const auto jacobian = arm.nominal_jacobian(q);
    ASSERT_EQ(jacobian.cols(), static_cast<Eigen::Index>(q.size()));
    for (std::size_t i = 0; i < q.size(); ++i) {
      JointVector up = q, down = q;
      up[i] += kStep;
      down[i] -= kStep;
      const Eigen::Isometry3d a = arm.nominal_tcp(down), b = arm.nominal_tcp(up);
      const Eigen::Vector3d linear = (b.translation() - a.translation()) / (2.0 * kStep);
      const Eigen::AngleAxisd turn(b.linear() * a.linear().transpose());
      const Eigen::Vector3d angular = turn.axis() * turn.angle() / (2.0 * kStep);
      const auto column = jacobian.col(static_cast<Eigen::Index>(i));
      EXPECT_LT((column.head<3>() - linear).norm(), 1e-8) << "arm " << k << " joint " << i;
      EXPECT_LT((column.tail<3>() - angular).norm(), 1e-8) << "arm " << k << " joint " << i;
    }
  }
}

}  // namespace
}  // namespace cellcal::calib
