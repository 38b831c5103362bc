#include <gtest/gtest.h>

#include "calib/files/files.h"
#include "calib/model/linear.h"
#include "calib/model/units.h"
#include "calib/plan/duration.h"

namespace cellcal::calib {
namespace {

struct PointSpeed : ::testing::Test {
  Cell cell = load_cell(CELLCAL_DEMO_CELL);
  ArmModel arm{cell};
};

TEST_F(PointSpeed, OfATurnAboutTheColumnIsThatOfThePointFarthestFromItsAxis) {
  const std::vector<double> from{0.0, -90 * kRadPerDeg, 90 * kRadPerDeg, 0.0, 0.0, 0.0};
  std::vector<double> to = from;
  to[0] = 0.5;
  double farthest_m = arm.nominal_tip_m(from).head<2>().norm();
  for (const Eigen::Vector3d& origin : arm.shape(arm.prepare(from), nullptr).joint_origin_m)
    farthest_m = std::max(farthest_m, origin.head<2>().norm());
  EXPECT_NEAR(fastest_point_m_s(arm, from, to), 0.5 * farthest_m, 0.001 * farthest_m);
}

TEST_F(PointSpeed, OfTheElbowCountsWhereTheTipStandsStill) {
  const std::vector<double> from{0.0, -90 * kRadPerDeg, 90 * kRadPerDeg, 0.0, 30 * kRadPerDeg, 0.0};
  // A2, A3 and A5 rotate in one plane: the direction that leaves the tip in place.
  const auto jacobian = arm.nominal_jacobian(from);
  const auto row = [&](int k) {
    return Eigen::Vector3d(jacobian(k, 1), jacobian(k, 2), jacobian(k, 4));
  };
  const Eigen::Vector3d still = row(0).cross(row(2)).normalized();
  std::vector<double> to = from;
  to[1] += 0.02 * still[0];
  to[2] += 0.02 * still[1];
  to[4] += 0.02 * still[2];
  const auto elbow_m = [&](const std::vector<double>& q) {
    return arm.shape(arm.prepare(q), nullptr).joint_origin_m[2];
  };
  const double elbow = (elbow_m(to) - elbow_m(from)).norm();
  const double tip = (arm.nominal_tip_m(to) - arm.nominal_tip_m(from)).norm();
  ASSERT_GT(elbow, 10.0 * tip);
  EXPECT_GE(fastest_point_m_s(arm, from, to), 0.999 * elbow);
}

TEST_F(PointSpeed, IsNoLessThanAnyChordOfARandomWay) {
  Random random(5);
  for (int k = 0; k < 50; ++k) {
    std::vector<double> from(6), to(6);
    for (std::size_t i = 0; i < 6; ++i) {
      const Joint& joint = cell.robot.joints[i];
      from[i] = random.uniform(joint.min_rad, joint.max_rad);
      to[i] = random.uniform(joint.min_rad, joint.max_rad);
    }
    const double bound = fastest_point_m_s(arm, from, to);
    constexpr int kChords = 500;
    std::vector<double> q = from;
    Eigen::Vector3d last = arm.nominal_tip_m(q);
    for (int c = 1; c <= kChords; ++c) {
      for (std::size_t i = 0; i < 6; ++i) q[i] = from[i] + (to[i] - from[i]) * c / kChords;
      const Eigen::Vector3d now = arm.nominal_tip_m(q);
      EXPECT_LE((now - last).norm() * kChords, 1.01 * bound);
      last = now;
    }
  }
}

TEST_F(PointSpeed, IsNothingWhereNoAxisMoves) {
  const std::vector<double> at(6, 0.1);
  EXPECT_EQ(fastest_point_m_s(arm, at, at), 0.0);
}

}  // namespace
}  // namespace cellcal::calib
