// Constraint of each kind of target on the tip, and its derivatives, against differences.

#include <ceres/dynamic_numeric_diff_cost_function.h>
#include <gtest/gtest.h>

#include "calib/estimate/problem.h"
#include "calib/estimate/solve.h"
#include "tests/calib/model/random_arm.h"

namespace cellcal::calib {
namespace {

using Eigen::Vector3d;

constexpr int kArms = 100;
constexpr TargetKind kKinds[] = {
    TargetKind::kSphere, TargetKind::kWire,    TargetKind::kPlane,
    TargetKind::kPoint,  TargetKind::kTracker, TargetKind::kTracker};  // the last measures poses

/// One touch of each kind by a random, unrealistic arm.
struct Drawn {
  explicit Drawn(Random& random) {
    const auto drawn = testing::random_arm(random);
    cell.robot = drawn.robot;
    cell.tool = drawn.tool;
    cell.tool.tip_radius_m = 2e-3;
    cell.touch_sigma_m = 1e-5;
    cell.turn_sigma_rad = 1e-4;
    cell.radius_offset_sigma_m = 3e-4;
    for (std::size_t k = 0; k < std::size(kKinds); ++k) {
      Target target;
      target.id = "T" + std::to_string(k);
      target.kind = kKinds[k];
      if (target.kind == TargetKind::kSphere) {
        target.diameter_m = 0.05;
        target.diameter_sigma_m = 1e-5;
      }
      cell.targets.push_back(target);
      Touch touch;
      touch.target = target.id;
      touch.joint_rad = testing::random_joints(cell.robot, random);
      touch.radius_m = 0.3;
      for (double& m : touch.tracker_m) m = 2.0 * random.normal();
      touch.speed_m_s = random.uniform(0.001, 0.02);
      const Vector3d along = testing::random_direction(random);
      if (random.uniform() < 0.5) touch.approach = {along.x(), along.y(), along.z()};
      touches.push_back(touch);
      const Eigen::Isometry3d pose = testing::random_pose(random, 2.0);
      TargetPlace place(pose.translation());
      place.axes = pose.linear();
      place.middle_m = Vector3d(random.normal(), random.normal(), random.normal());
      places.push_back(place);
    }
    Touch& posed = touches.back();
    posed.tracker_abc_rad = {random.uniform(-3.0, 3.0), random.uniform(-3.0, 3.0),
                             random.uniform(-3.0, 3.0)};
    // Measured close to the arm's orientation: rotations beyond half a turn are ambiguous.
    places.back().probe = ArmModel(cell).nominal_tcp(posed.joint_rad).linear().transpose() *
                          places.back().axes * probe_turn(posed);
    for (const auto& [from, to] : {std::pair{0, 1}, {0, 3}, {1, 3}})  // those with a centre
      cell.lengths.push_back(
          {cell.targets[from].id, cell.targets[to].id, 1.0 + random.uniform(), 1e-5});
  }
  Cell cell;
  std::vector<Touch> touches;
  std::vector<TargetPlace> places;
};

using Rows = Eigen::Matrix<double, Problem::kMostRows, 1>;

/// Fourth-order central difference of the residual by x[p].
Rows difference(const Problem& problem, std::size_t touch, const Eigen::VectorXd& x, int p,
                double step) {
  const auto at = [&](double steps) {
    Eigen::VectorXd moved = x;
    moved[p] += steps * step;
    Rows r = Rows::Zero();
    problem.residual_m(touch, problem.at(moved.data()), r.data(), nullptr, nullptr);
    return r;
  };
  return (8.0 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12.0 * step);
}

TEST(KindJacobian, OfEveryKindAgreesWithDifferencesForAnyArm) {
  Random random(1);
  int posed = 0, examined = 0;
  for (int k = 0; k < kArms; ++k) {
    const Drawn drawn(random);
    const ArmModel arm(drawn.cell.robot, drawn.cell.tool);
    const Problem problem(drawn.cell, arm, drawn.touches, drawn.places);
    Eigen::VectorXd x(problem.size());
    for (int i = 0; i < problem.size(); ++i) {
      const Unknown& unknown = problem.unknowns()[static_cast<std::size_t>(i)];
      // Targets well away from their start, so that second-order terms are tested, too.
      const double off =
          unknown.unit == "deg" && i >= problem.shared_size() ? 0.5 / unknown.scale : 3.0;
      x[i] = unknown.origin + unknown.scale * off * random.normal();
    }
    for (std::size_t t = 0; t < drawn.touches.size(); ++t) {
      SCOPED_TRACE("arm " + std::to_string(k) + " kind " + std::to_string(t));
      const TargetBlock& block = problem.blocks()[t];
      const int rows = problem.rows(t);
      std::vector<double> by_shared(static_cast<std::size_t>(rows * problem.shared_size()));
      std::vector<double> by_target(static_cast<std::size_t>(rows * block.size()));
      double r[Problem::kMostRows];
      problem.residual_m(t, problem.at(x.data()), r, by_shared.data(), by_target.data());
      if (rows == Problem::kMostRows) {
        constexpr double kNearHalfATurnRad = 2.8;  // beyond it the rotation vector flips
        ++posed;
        if (Eigen::Map<Vector3d>(r + 3).norm() > kNearHalfATurnRad * problem.turn_lever_m(t))
          continue;
        ++examined;
      }
      const auto expect = [&](int unknown, const double* column, int stride, double factor) {
        const Rows expected = difference(problem, t, x, unknown, 1e-3 / factor);
        for (int row = 0; row < rows; ++row)
          EXPECT_NEAR(column[row * stride], expected[row], 1e-8 * factor) << parameter_name(
              problem.cell(), problem.unknowns()[static_cast<std::size_t>(unknown)].key);
      };
      for (int i = 0; i < problem.shared_size(); ++i) {
        const double factor =
            i < arm.size() ? std::max(1.0, std::abs(problem.pose(t).factor[i])) : 1.0;
        expect(i, by_shared.data() + i, problem.shared_size(), factor);
      }
      for (int i = 0; i < block.size(); ++i)
        expect(block.first + i, by_target.data() + i, block.size(), 1.0);
    }
  }
  EXPECT_EQ(posed, kArms);
  EXPECT_GT(examined, kArms / 2);
}

/// All rows of the estimator, in prior units and divided by their sigmas, lengths included.
struct AllRows {
  const Problem& problem;
  const std::vector<bool>& use;
  bool operator()(double const* const* u, double* residual) const {
    const Linearisation rows =
        linearise(problem, Eigen::Map<const Eigen::VectorXd>(u[0], problem.size()), use);
    Eigen::Map<Eigen::VectorXd>(residual, rows.residual.size()) = rows.residual;
    return true;
  }
};

TEST(KindJacobian, OfAllRowsLengthsIncludedAgreesWithCeresAdaptiveDifferences) {
  // As for the arm alone (model/jacobian_test): the method of ceres::GradientChecker.
  using Numeric = ceres::DynamicNumericDiffCostFunction<AllRows, ceres::RIDDERS>;
  constexpr double kRelative = 1e-7;  // of the largest derivative in the row
  Random random(5);
  for (int k = 0; k < kArms; ++k) {
    const Drawn drawn(random);
    const ArmModel arm(drawn.cell.robot, drawn.cell.tool);
    const Problem problem(drawn.cell, arm, drawn.touches, drawn.places);
    const std::vector<bool> use(drawn.touches.size(), true);
    Eigen::VectorXd u(problem.size());
    for (double& sigmas : u) sigmas = 10.0 * random.normal();
    const Linearisation own = linearise(problem, u, use);
    ASSERT_EQ(own.residual.size() - own.length_row, 3);

    AllRows functor{problem, use};
    Numeric numeric(&functor, ceres::DO_NOT_TAKE_OWNERSHIP);
    numeric.AddParameterBlock(problem.size());
    numeric.SetNumResiduals(static_cast<int>(own.residual.size()));
    Eigen::VectorXd residual(own.residual.size());
    RowMajor expected(own.jacobian.rows(), own.jacobian.cols());
    const double* blocks[] = {u.data()};
    double* jacobians[] = {expected.data()};
    ASSERT_TRUE(numeric.Evaluate(blocks, residual.data(), jacobians));
    for (Eigen::Index row = 0; row < own.jacobian.rows(); ++row) {
      const double largest = own.jacobian.row(row).lpNorm<Eigen::Infinity>();
      for (Eigen::Index i = 0; i < own.jacobian.cols(); ++i)
        EXPECT_NEAR(own.jacobian(row, i), expected(row, i), kRelative * largest)
            << "arm " << k << " row " << row << " unknown "
            << parameter_name(problem.cell(), problem.unknowns()[static_cast<std::size_t>(i)].key);
    }
  }
}

TEST(KindJacobian, OfATurnIsRightAtAndNearNoTurn) {
  Random random(2);
  for (const double size : {0.0, 1e-12, 1e-6, 0.9e-4, 1.1e-4, 1e-2, 1.0, 3.0}) {
    TargetPlace start(Vector3d(0.3, -0.2, 0.5));
    start.axes = testing::random_pose(random, 1.0).linear();
    start.middle_m = Vector3d(1.0, 2.0, 3.0);
    Eigen::VectorXd x(6);
    x << 0.1, 0.2, 0.3, size * testing::random_direction(random);
    const Vector3d reading(3.0, -1.0, 2.0);
    Eigen::Matrix<double, 3, 6> by_x;
    tracked_m(start, x.data(), reading, &by_x);
    for (int p = 0; p < 6; ++p) {
      const auto at = [&](double step) {
        Eigen::VectorXd moved = x;
        moved[p] += step;
        return tracked_m(start, moved.data(), reading, nullptr);
      };
      constexpr double kStep = 1e-3;
      const Vector3d expected =
          (8.0 * (at(kStep) - at(-kStep)) - (at(2 * kStep) - at(-2 * kStep))) / (12.0 * kStep);
      EXPECT_LT((by_x.col(p) - expected).norm(), 1e-9) << "turn " << size << " unknown " << p;
    }
  }
}

TEST(KindJacobian, UnknownsAndPlacesAreEachOthersInverse) {
  Random random(3);
  for (int k = 0; k < kArms; ++k) {
    TargetPlace start(Vector3d(random.normal(), random.normal(), random.normal()));
    start.axes = testing::random_pose(random, 1.0).linear();
    start.middle_m = Vector3d(random.normal(), random.normal(), random.normal());
    TargetPlace place = start;
    const Eigen::AngleAxisd turn(random.uniform(0.0, 0.7), testing::random_direction(random));
    place.axes = turn.toRotationMatrix() * start.axes;
    place.centre_m += Vector3d(random.normal(), random.normal(), random.normal());
    Target target;
    target.kind = TargetKind::kPlane;
    Eigen::VectorXd x = unknowns_at(target.kind, start, place);
    TargetResult there = result_at(target, start, x.data());
    EXPECT_LT((there.normal - place.axes.col(2)).norm(), 1e-12);
    EXPECT_NEAR(there.distance_m, place.axes.col(2).dot(place.centre_m), 1e-12);
    EXPECT_NEAR(there.normal.dot(there.centre_m), there.distance_m, 1e-12);
    EXPECT_NEAR(
        plane_distance_m(start, x.data(), there.centre_m + 0.1 * there.normal, nullptr, nullptr),
        0.1, 1e-12);

    target.kind = TargetKind::kTracker;
    place.middle_m = Vector3d(random.normal(), random.normal(), random.normal());
    x = unknowns_at(target.kind, start, place);
    there = result_at(target, start, x.data());
    EXPECT_LT((there.frame.linear() - place.axes).norm(), 1e-12);
    EXPECT_LT((there.frame * place.middle_m - place.centre_m).norm(), 1e-12);
  }
}

TEST(KindJacobian, OfAPlaneIsPositiveOnTheToolsSideByTheTipsRadius) {
  Random random(4);
  Drawn drawn(random);
  const ArmModel arm(drawn.cell.robot, drawn.cell.tool);
  const Vector3d tip = arm.position(arm.prepare(drawn.touches[2].joint_rad), nullptr);
  drawn.places[2].centre_m = tip - 2e-3 * drawn.places[2].axes.col(2);  // the ball just touches
  const auto residual = [&](double lift_m) {
    auto places = drawn.places;
    places[2].centre_m -= lift_m * places[2].axes.col(2);
    const Problem problem(drawn.cell, arm, drawn.touches, places);
    const Eigen::VectorXd x = problem.to_si(Eigen::VectorXd::Zero(problem.size()));
    double r = 0.0;
    problem.residual_m(2, problem.at(x.data()), &r, nullptr, nullptr);
    return r;
  };
  EXPECT_NEAR(residual(0.0), 0.0, 1e-12);
  EXPECT_NEAR(residual(5e-3), 5e-3, 1e-12);
  EXPECT_NEAR(residual(-5e-3), -5e-3, 1e-12);
}

}  // namespace
}  // namespace cellcal::calib
