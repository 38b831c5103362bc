// Every derivative compared with finite differences, by two methods.

#include <ceres/dynamic_numeric_diff_cost_function.h>
#include <gtest/gtest.h>

#include "calib/model/kinematics.h"
#include "tests/calib/model/random_arm.h"

namespace cellcal::calib {
namespace {

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
  for (int k = 0; k < testing::kArms; ++k) {
    const auto drawn = testing::random_arm(random);
    const ArmModel arm(drawn.robot, drawn.tool);
    const PreparedPose pose = arm.prepare(testing::random_joints(drawn.robot, random));
    const Eigen::VectorXd x = testing::random_errors(arm, random, 3.0);
    Eigen::Matrix3Xd jacobian(3, arm.size());
    arm.position(pose, x.data(), jacobian);
    for (int p = 0; p < arm.size(); ++p) {
      // A milliradian or a millimetre: truncation h^4 f'''''/30 is 1e-12 of the reach, rounding of
      // 10 m over 2e-3 is 1e-12. For a factor (torque) between parameter and angle the step
      // decreases and the derivative increases with it.
      const double factor = std::max(1.0, std::abs(pose.factor[p]));
      const Eigen::Vector3d expected = difference(arm, pose, x, p, 1e-3 / factor);
      EXPECT_LT((jacobian.col(p) - expected).norm(), 1e-10 * factor)
          << "arm " << k << " parameter " << p;
    }
  }
}

/// The position in prior units, as in the estimator, in millimetres: effect of one sigma.
struct PositionInPriorUnits {
  const ArmModel& arm;
  const PreparedPose& pose;
  bool operator()(double const* const* u, double* position_mm) const {
    Eigen::VectorXd x(arm.size());
    for (int p = 0; p < arm.size(); ++p)
      x[p] = arm.parameters()[static_cast<std::size_t>(p)].sigma * u[0][p];
    Eigen::Map<Eigen::Vector3d>{position_mm} = 1e3 * arm.position(pose, x.data());
    return true;
  }
};

TEST(Jacobian, OfThePositionAgreesWithCeresAdaptiveDifferences) {
  // As ceres::GradientChecker (Ridders' extrapolated differences, relative error), without
  // passing Eigen's vectors into the shared library: their allocators differ under sanitizers.
  using Numeric = ceres::DynamicNumericDiffCostFunction<PositionInPriorUnits, ceres::RIDDERS>;
  constexpr double kRelative = 1e-7;
  Random random(2);
  for (int k = 0; k < testing::kArms; ++k) {
    const auto drawn = testing::random_arm(random);
    const ArmModel arm(drawn.robot, drawn.tool);
    const PreparedPose pose = arm.prepare(testing::random_joints(drawn.robot, random));
    // Sixty sigma, so that second-order terms would be visible.
    Eigen::VectorXd u(arm.size()), x(arm.size());
    for (int p = 0; p < arm.size(); ++p) {
      u[p] = 60.0 * random.normal();
      x[p] = arm.parameters()[static_cast<std::size_t>(p)].sigma * u[p];
    }
    Eigen::Matrix3Xd jacobian(3, arm.size());
    arm.position(pose, x.data(), jacobian);

    PositionInPriorUnits functor{arm, pose};
    Numeric numeric(&functor, ceres::DO_NOT_TAKE_OWNERSHIP);
    numeric.AddParameterBlock(arm.size());
    numeric.SetNumResiduals(3);
    Eigen::Vector3d position;
    Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor> expected(3, arm.size());
    const double* blocks[] = {u.data()};
    double* jacobians[] = {expected.data()};
    ASSERT_TRUE(numeric.Evaluate(blocks, position.data(), jacobians));
    for (int p = 0; p < arm.size(); ++p) {
      const ArmParameter& parameter = arm.parameters()[static_cast<std::size_t>(p)];
      const Eigen::Vector3d own = 1e3 * parameter.sigma * jacobian.col(p);
      EXPECT_LT((own - expected.col(p)).norm(), kRelative * std::max(1.0, own.norm()))
          << "arm " << k << " parameter " << p;
    }
  }
}

TEST(Jacobian, OfTheNominalToolFollowsTheAxisAnglesTheirSignIncluded) {
  Random random(3);
  constexpr double kStep = 1e-5;  // truncation h^2 of the reach, rounding 1e-15 / h: 1e-9
  for (int k = 0; k < testing::kArms; ++k) {
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
