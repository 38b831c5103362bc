// Two arms on the same spheres: the relation of their bases against the truth, and spheres that moved in between.

#include "calib/check/base_relation.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include "calib/estimate/region.h"
#include "calib/identify/identify.h"
#include "calib/model/error.h"
#include "calib/model/linear.h"
#include "calib/model/units.h"
#include "tests/calib/check/second_arm.h"
#include "tests/calib/simulate.h"
#include "tests/calib/thrown.h"

namespace cellcal::calib {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using testing::demo_cell;
using testing::second_base;
using testing::second_cell;

const Calibration& second() { return testing::second_calibration(); }

std::vector<SpherePair> all_pairs() {
  std::vector<SpherePair> pairs;
  for (const Target& target : demo_cell().targets) pairs.push_back({target.id, target.id});
  return pairs;
}

/// Rigid motion that takes the tips by `from` to those by `to` over the workspace.
Isometry3d motion_between(const ArmModel& arm, const Eigen::VectorXd& from, const ArmModel& other,
                          const Eigen::VectorXd& to) {
  const auto poses = workspace_poses(arm, 300, 77);
  Eigen::Matrix3Xd one(3, poses.size()), two(3, poses.size());
  for (std::size_t k = 0; k < poses.size(); ++k) {
    one.col(static_cast<Eigen::Index>(k)) = arm.position(arm.prepare(poses[k]), from.data());
    two.col(static_cast<Eigen::Index>(k)) = other.position(other.prepare(poses[k]), to.data());
  }
  return calib::rigid_motion(one, two);
}

Eigen::Matrix<double, 6, 1> error_of(const BaseRelation& found, const Isometry3d& truth) {
  Eigen::Matrix<double, 6, 1> error;
  error.head<3>() = found.second_in_first.translation() - truth.translation();
  error.tail<3>() = turn_vector(found.second_in_first.linear() * truth.linear().transpose());
  return error;
}

TEST(ARelationOfTwoArms, IsWithinItsUncertaintyOfTheTruthThatTheCalibratedArmsHave) {
  const auto to_truth = [](const Calibration& c, const sim::Truth& truth) {
    const ArmModel arm(at_level(c.cell, c.level));
    return motion_between(arm, arm_values(arm, c), truth.arm, truth.errors);
  };
  sim::Truth second_truth = testing::plain_truth(second_cell(), 8);
  const Isometry3d truth = to_truth(testing::calibration(), testing::truth()).inverse() *
                           second_base() * to_truth(second(), second_truth);
  const BaseRelation found = relate_bases(testing::calibration(), second(), all_pairs());
  EXPECT_TRUE(found.agrees());
  const auto error = error_of(found, truth);
  for (int i = 0; i < 6; ++i)
    EXPECT_LT(std::abs(error[i]), 3.5 * std::sqrt(found.covariance(i, i))) << i;
  EXPECT_LT(2.0 * std::sqrt(found.middle_covariance.trace()), 1e-3);
  EXPECT_GT(2.0 * std::sqrt(found.middle_covariance.trace()), 1e-5);
  for (const RelatedSphere& one : found.spheres)
    EXPECT_LT(one.off_m.norm(), one.u_m) << one.sphere.first;
}

/// Calibrations whose errors are drawn from their own covariance, as often as they state.
class Drawn {
 public:
  explicit Drawn(const Calibration& truth)
      : truth_(truth), arm_(at_level(truth.cell, truth.level)), x_(arm_values(arm_, truth)) {
    const Eigen::VectorXd sigma = truth.covariance.diagonal().cwiseMax(1e-30).cwiseSqrt();
    const Eigen::MatrixXd unit =
        sigma.cwiseInverse().asDiagonal() * truth.covariance * sigma.cwiseInverse().asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> pairs(unit);
    root_ = sigma.asDiagonal() * pairs.eigenvectors() *
            pairs.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
  }

  Calibration draw(Random& random) const {
    Eigen::VectorXd z(root_.cols());
    for (double& value : z) value = random.normal();
    const Eigen::VectorXd off = root_ * z;
    Calibration drawn = truth_;
    for (std::size_t p = 0; p < drawn.parameters.size(); ++p) {
      drawn.parameters[p].correction += off[static_cast<Eigen::Index>(p)];
      const ParameterKey& key = drawn.parameters[p].key;
      if (key.kind != ParameterKind::kCentre) continue;
      for (TargetResult& target : drawn.targets)
        if (target.id == drawn.cell.targets[static_cast<std::size_t>(key.target)].id)
          target.centre_m[key.axis] += off[static_cast<Eigen::Index>(p)];
    }
    return drawn;
  }

  /// From the base of a drawn calibration to that of the truth.
  Isometry3d to_truth(const Calibration& drawn) const {
    return motion_between(arm_, arm_values(arm_, drawn), arm_, x_);
  }

 private:
  const Calibration& truth_;
  ArmModel arm_;
  Eigen::VectorXd x_;
  Eigen::MatrixXd root_;
};

/// The second calibration with its spheres exactly where the first has them.
Calibration consistent_second(const Isometry3d& base) {
  Calibration exact = second();
  for (TargetResult& target : exact.targets)
    for (const TargetResult& other : testing::calibration().targets)
      if (other.id == target.id) target.centre_m = base.inverse() * other.centre_m;
  return exact;
}

TEST(TheUncertaintyOfARelation, CoversTheErrorOfNineteenDrawnPairsOfArmsInTwenty) {
  constexpr int kPairs = 400;
  const Calibration exact = consistent_second(second_base());
  const Drawn first(testing::calibration()), other(exact);
  Random random(4);
  int within = 0, quiet = 0;
  double squares = 0.0;
  for (int pair = 0; pair < kPairs; ++pair) {
    const Calibration one = first.draw(random), two = other.draw(random);
    const BaseRelation found = relate_bases(one, two, all_pairs());
    const Isometry3d truth = first.to_truth(one).inverse() * second_base() * other.to_truth(two);
    const auto error = error_of(found, truth);
    for (int i = 0; i < 6; ++i)
      within += std::abs(error[i]) < 2.0 * std::sqrt(found.covariance(i, i));
    squares += Cholesky(found.covariance).whitened(Eigen::VectorXd(error)).squaredNorm() / 6.0;
    quiet += found.agrees();
  }
  RecordProperty("within_per_mille", 1000 * within / (6 * kPairs));
  EXPECT_NEAR(static_cast<double>(within) / (6 * kPairs), 0.9545, 0.03);
  EXPECT_NEAR(squares / kPairs, 1.0, 0.2);
  EXPECT_GE(quiet, kPairs - 6);  // one in a thousand is a false alarm
}

TEST(ASphereThatMovedBetweenTwoSessions, IsNamedAndLeftOut) {
  Calibration moved = second();
  moved.targets[1].centre_m += Vector3d(0.0, 4e-4, 3e-4);
  const BaseRelation before = relate_bases(testing::calibration(), second(), all_pairs());
  const BaseRelation found = relate_bases(testing::calibration(), moved, all_pairs());
  EXPECT_FALSE(found.agrees());
  for (std::size_t k = 0; k < found.spheres.size(); ++k) {
    EXPECT_EQ(found.spheres[k].agrees, k != 1) << k;
    EXPECT_FALSE(found.spheres[k].suspect);
  }
  EXPECT_NEAR(found.spheres[1].off_m.norm(), 5e-4, 1e-4);
  EXPECT_GT(found.spheres[1].sigmas, 5.0);
  const auto shift = error_of(found, before.second_in_first);
  for (int i = 0; i < 6; ++i)
    EXPECT_LT(std::abs(shift[i]), 3.0 * std::sqrt(found.covariance(i, i)));
}

TEST(OfThreeSpheres, NoneIsLeftOutWhereTheyContradictAndThePossibleOnesAreNamed) {
  Calibration moved = second();
  moved.targets[1].centre_m += Vector3d(0.0, 2e-3, 0.0);
  std::vector<SpherePair> three = all_pairs();
  three.resize(3);
  EXPECT_TRUE(relate_bases(testing::calibration(), second(), three).agrees());
  const BaseRelation found = relate_bases(testing::calibration(), moved, three);
  EXPECT_FALSE(found.agrees());
  for (const RelatedSphere& one : found.spheres) EXPECT_TRUE(one.agrees);
  EXPECT_TRUE(found.spheres[1].suspect);
}

TEST(ARelation, IsRefusedForTooFewSpheresOnOneLineOfOtherKindsAndOfOtherSizes) {
  const Calibration& one = testing::calibration();
  std::vector<SpherePair> pairs = all_pairs();
  const auto refusal = [&](const Calibration& other, std::size_t count) {
    return std::string(testing::thrown<IdentifyError>([&] {
                         relate_bases(one, other, std::span(pairs).first(count));
                       }).what());
  };
  EXPECT_NE(refusal(second(), 2).find("2 common spheres, 3 are needed"), std::string::npos);
  Calibration other = second();
  other.cell.targets[0].diameter_m += 5e-4;
  EXPECT_NE(refusal(other, 4).find("S1: diameter"), std::string::npos);
  other = second();
  other.covariance.resize(0, 0);
  EXPECT_NE(refusal(other, 4).find("no covariance"), std::string::npos);
  other = second();
  other.targets[2].kind = TargetKind::kPlane;
  EXPECT_NE(refusal(other, 4).find("S3 is a plane"), std::string::npos);
  other = second();
  other.targets[2].centre_m = (other.targets[0].centre_m + other.targets[1].centre_m) / 2.0;
  EXPECT_NE(refusal(other, 3).find("off one line"), std::string::npos);
  pairs[1].second = "S9";
  EXPECT_NE(refusal(second(), 4).find("no target \"S9\""), std::string::npos);
  other = second();
  other.cell.robot.joints[0].guide = LinearGuide{};
  EXPECT_THROW(relate_bases(other, second(), all_pairs()), LinearUnitError);
}

}  // namespace
}  // namespace cellcal::calib
