// Unmodelled errors of an arm are estimated instead of refused, are included in every bound, and do
// not decrease with the number of touches.

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "calib/estimate/predict.h"
#include "calib/estimate/region.h"
#include "calib/identify/identify.h"
#include "calib/model/linear.h"
#include "tests/calib/findings.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::found;
using testing::make_touches;
using testing::plain_truth;
using testing::the;
using testing::words_of;

/// A tip error that is smooth in the posture: many waves of about 0.6 rad of the first three axes.
class Field {
 public:
  Field(double sigma_m, unsigned seed) {
    constexpr int kWaves = 60;
    constexpr double kReachRad = 0.6;
    Random random(seed);
    for (int k = 0; k < kWaves; ++k) {
      Wave wave;
      for (double& c : wave.along) c = sigma_m * std::sqrt(2.0 / kWaves) * random.normal();
      for (int i = 0; i < 3; ++i) wave.by_axis.push_back(random.normal() / kReachRad);
      wave.phase = random.uniform(0.0, 6.283);
      waves_.push_back(wave);
    }
  }
  Eigen::Vector3d at(const JointVector& q) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const Wave& w : waves_)
      sum += w.along *
             std::cos(std::inner_product(w.by_axis.begin(), w.by_axis.end(), q.begin(), w.phase));
    return sum;
  }

 private:
  struct Wave {
    Eigen::Vector3d along;
    std::vector<double> by_axis;
    double phase = 0.0;
  };
  std::vector<Wave> waves_;
};

/// Displaces the touch as if the same arm's tip were off by `off_m`.
void displace(Touch& touch, const sim::Truth& truth, const Eigen::Vector3d& off_m, double noise_m) {
  const Eigen::Vector3d tip =
      truth.arm.position(truth.arm.prepare(touch.joint_rad), truth.errors.data());
  const Eigen::Vector3d normal =
      (tip - truth.centre_m[demo_cell().target_index(touch.target)]).normalized();
  const Eigen::VectorXd along =
      truth.arm.nominal_jacobian(touch.joint_rad).topRows<3>().transpose() * normal;
  const double by_m = noise_m - off_m.dot(normal);
  for (std::size_t i = 0; i < touch.joint_rad.size(); ++i)
    touch.joint_rad[i] += by_m * along[static_cast<Eigen::Index>(i)] / along.squaredNorm();
}

struct Session {
  int fit = 100;
  int repeated = 0;  ///< places that are touched four times
  double noise_m = 0.03e-3;
  unsigned seed = 1;
};

std::vector<Touch> touches_of(const Session& session, const sim::Truth& truth, const Field& field) {
  const auto made =
      make_touches(demo_cell(), truth, {.fit = session.fit, .noise_m = 0.0, .seed = session.seed});
  Random random(session.seed + 500);
  std::vector<Touch> touches;
  for (std::size_t i = 0; i < made.touches.size(); ++i) {
    const int times = static_cast<int>(i) < session.repeated ? 4 : 1;
    for (int k = 0; k < times; ++k) {
      touches.push_back(made.touches[i]);
      displace(touches.back(), truth, field.at(made.touches[i].joint_rad),
               session.noise_m * random.normal());
    }
  }
  return touches;
}

/// Over postures of the whole workspace, after alignment of the base.
struct Judged {
  double covered = 0.0, mean_m = 0.0;
};
Judged judged(const Calibration& c, const sim::Truth& truth, const Field& field) {
  const Predictor predictor(c);
  const ArmModel model(demo_cell().robot, demo_cell().tool);
  const auto poses = workspace_poses(model, 300, 7);
  const auto n = static_cast<Eigen::Index>(poses.size());
  Eigen::Matrix3Xd real(3, n), foreseen(3, n);
  Eigen::VectorXd u95(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const JointVector& q = poses[static_cast<std::size_t>(i)];
    const Prediction p = predictor.calibrated(q);
    real.col(i) = truth.arm.position(truth.arm.prepare(q), truth.errors.data()) + field.at(q);
    foreseen.col(i) = p.tcp.translation();
    u95[i] = p.u95_m;
  }
  const Eigen::Matrix4d motion = calib::rigid_motion(foreseen, real).matrix();
  const Eigen::VectorXd off =
      ((motion.topLeftCorner<3, 3>() * foreseen).colwise() + motion.topRightCorner<3, 1>() - real)
          .colwise()
          .norm()
          .transpose();
  return {static_cast<double>((off.array() <= u95.array()).count()) / static_cast<double>(n),
          off.mean()};
}

Cell stating(double sigma_m) {
  Cell cell = demo_cell();
  cell.touch_sigma_m = sigma_m;
  return cell;
}

// The prediction is too small for some arms: in tests/experiments/run discrepancy by at most a factor
// of 1.9.
constexpr double kUnderstated = 2.0;

TEST(Discrepancy, IsEstimatedInsteadOfRefusedAndItsBoundHoldsWhereNoTouchWas) {
  for (const unsigned seed : {1u, 2u}) {
    SCOPED_TRACE(seed);
    const sim::Truth truth = plain_truth(demo_cell(), seed);
    const Field field(0.25e-3, seed);
    // With half as many touches it is distinguishable from noise in most arms, not in all.
    const Calibration c =
        identify(stating(0.03e-3), touches_of({.fit = 200, .seed = seed}, truth, field));
    EXPECT_TRUE(c.verdict.publish()) << words_of(c);
    EXPECT_TRUE(c.discrepancy.estimated);
    EXPECT_NEAR(c.discrepancy.sigma_m, 0.25e-3, 0.15e-3);
    ASSERT_TRUE(found(c, FindingKind::kModelError)) << words_of(c);
    EXPECT_EQ(find(the(c, FindingKind::kModelError).evidence, "repeats"), nullptr);
    const Judged real = judged(c, truth, field);
    EXPECT_GT(real.covered, 0.85);
    EXPECT_LT(real.mean_m, kUnderstated * c.predicted_workspace_m);
  }
}

TEST(Discrepancy, IsNotHiddenByATouchSigmaThatIsTheWholeMisfit) {
  const sim::Truth truth = plain_truth(demo_cell(), 3);
  const Field field(0.25e-3, 3);
  for (const int repeated : {0, 6}) {
    SCOPED_TRACE(repeated);
    const Calibration c =
        identify(stating(0.2e-3), touches_of({.repeated = repeated, .seed = 3}, truth, field));
    EXPECT_TRUE(c.verdict.publish()) << words_of(c);
    EXPECT_GT(c.discrepancy.sigma_m, 0.1e-3);
    const Judged real = judged(c, truth, field);
    EXPECT_GT(real.covered, 0.85);
    EXPECT_LT(real.mean_m, kUnderstated * c.predicted_workspace_m);
  }
}

/// A hundred tracker readings at A1 < 0 of an arm whose joints deviate by waves that the touch sigma hides.
std::vector<Touch> seen_from_one_side(const Cell& cell) {
  const sim::Truth truth = plain_truth(demo_cell(), 2);
  std::vector<Touch> touches;
  for (const JointVector& q : workspace_poses(ArmModel(cell), 300, 7)) {
    if (q[0] > 0.0 || touches.size() == 100) continue;
    JointVector real = q;
    for (std::size_t i = 0; i < real.size(); ++i)
      for (int k = 3; k < 6; ++k) real[i] += 1e-4 * std::sin(k * q[i] + static_cast<double>(i));
    Touch touch;
    touch.target = "T1";
    touch.joint_rad = q;
    Eigen::Map<Eigen::Vector3d>(touch.tracker_m) =
        truth.arm.position(truth.arm.prepare(real), truth.errors.data());
    touches.push_back(std::move(touch));
  }
  return touches;
}

double mean_u95_m(const Calibration& c, bool other_side) {
  const Predictor predictor(c);
  double sum = 0.0, count = 0.0;
  for (const JointVector& q : workspace_poses(ArmModel(c.cell), 300, 7)) {
    if ((q[0] > 0.0) != other_side) continue;
    sum += predictor.calibrated(q).u95_m;
    count += 1.0;
  }
  return sum / count;
}

TEST(Discrepancy, OfATrackerMayBeSharedByThePosesOfAJointsAngle) {
  const Cell cell = testing::tracker_cell(0.1e-3);
  const std::vector<Touch> touches = seen_from_one_side(cell);
  const Calibration shared = identify(cell, touches);
  const Calibration apart = identify(cell, touches, {.functions = false});  // for comparison
  ASSERT_GT(shared.discrepancy.sigma_m, 0.0);
  ASSERT_EQ(shared.discrepancy.sigma_m, apart.discrepancy.sigma_m) << "the same estimate";
  for (const bool other_side : {false, true})
    EXPECT_GT(mean_u95_m(shared, other_side), 1.05 * mean_u95_m(apart, other_side)) << other_side;
}

TEST(Discrepancy, OfATrackerMayBeSharedWhereTheNoiseOfRepeatsHidesIt) {
  constexpr double kNoiseM = 0.3e-3;
  const Cell cell = testing::tracker_cell(kNoiseM);
  Random random(5);
  std::vector<Touch> touches;
  for (const Touch& touch : seen_from_one_side(cell))
    for (int k = 0; k < 3; ++k) {
      touches.push_back(touch);
      for (double& component : touches.back().tracker_m) component += kNoiseM * random.normal();
    }
  const Calibration shared = identify(cell, touches);
  const Calibration apart = identify(cell, touches, {.functions = false});  // for comparison
  for (const bool other_side : {false, true})
    EXPECT_GT(mean_u95_m(shared, other_side), 1.05 * mean_u95_m(apart, other_side)) << other_side;
}

TEST(Discrepancy, IsFoundThoughSomeTouchesAreGrossErrorsThatItCouldHide) {
  for (const unsigned seed : {3u, 4u}) {
    SCOPED_TRACE(seed);
    const sim::Truth truth = plain_truth(demo_cell(), seed);
    const Field field(0.25e-3, seed);
    auto touches = touches_of({.repeated = 6, .seed = seed}, truth, field);
    for (const std::size_t i : {std::size_t{2}, std::size_t{9}, std::size_t{70}})
      displace(touches[i], truth, Eigen::Vector3d::Zero(), 0.6e-3);
    const Calibration c = identify(stating(0.03e-3), touches);
    EXPECT_TRUE(c.verdict.publish()) << words_of(c);
    EXPECT_TRUE(c.discrepancy.estimated);
    EXPECT_LT(c.chi2_per_dof, 2.0);
    EXPECT_TRUE(std::any_of(c.outliers.begin(), c.outliers.end(),
                            [](const Outlier& o) { return o.touch == 2; }));
    EXPECT_GT(judged(c, truth, field).covered, 0.85);
  }
}

TEST(Discrepancy, DoesNotShrinkWithTheNumberOfTouches) {
  const sim::Truth truth = plain_truth(demo_cell(), 4);
  const Field field(0.25e-3, 4);
  const auto of = [&](int fit) {
    return identify(stating(0.2e-3), touches_of({.fit = fit, .seed = 4}, truth, field));
  };
  const Calibration many = of(500);
  EXPECT_GT(many.predicted_workspace_m, 0.2e-3);  // 0.25 mm in each of three directions remain
  EXPECT_GT(judged(many, truth, field).covered, 0.85);
}

TEST(Discrepancy, IsNotTakenForFunctionsOfTheJointsAngles) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    const sim::Truth truth = plain_truth(demo_cell(), 40 + seed);
    const Field field(0.3e-3, seed);
    const Calibration c =
        identify(demo_cell(), touches_of({.repeated = 5, .seed = seed}, truth, field));
    EXPECT_TRUE(c.discrepancy.estimated) << seed;
    for (const Joint& joint : c.cell.robot.joints) EXPECT_EQ(joint.function_sigma_rad, 0.0) << seed;
  }
}

TEST(Discrepancy, OfAnArmThatIsAsItsModelIsNone) {
  const sim::Truth truth = plain_truth(demo_cell(), 5);
  const Field none(0.0, 5);
  for (const int repeated : {0, 6}) {
    const auto touches = touches_of({.repeated = repeated, .seed = 5}, truth, none);
    const Calibration c = identify(stating(0.03e-3), touches);
    EXPECT_TRUE(c.verdict.publish()) << words_of(c);
    EXPECT_EQ(c.discrepancy.sigma_m, 0.0);
    EXPECT_FALSE(c.discrepancy.estimated);
    EXPECT_LT(c.discrepancy.alike, 4.0);
    EXPECT_FALSE(found(c, FindingKind::kModelError)) << words_of(c);
  }
}

TEST(Discrepancy, IsNotWhatRepeatsShowToBeNoise) {
  const sim::Truth truth = plain_truth(demo_cell(), 6);
  const Field none(0.0, 6);
  const auto of = [&](int repeated) {
    return identify(stating(0.15e-3),
                    touches_of({.repeated = repeated, .noise_m = 0.15e-3, .seed = 6}, truth, none));
  };
  const Calibration unknown = of(0), noise = of(10);
  EXPECT_NEAR(unknown.discrepancy.sigma_m, 0.14e-3, 0.04e-3);  // nothing shows that it is noise
  EXPECT_EQ(the(unknown, FindingKind::kModelError, "estimated"), 0.0) << words_of(unknown);
  EXPECT_EQ(noise.discrepancy.sigma_m, 0.0) << words_of(noise);
  EXPECT_LT(noise.predicted_workspace_m, unknown.predicted_workspace_m);
}

}  // namespace
}  // namespace cellcal::calib
