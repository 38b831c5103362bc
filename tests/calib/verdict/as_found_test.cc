// An arm as found: its earlier description compared with the touches and with the new one.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calib/estimate/predict.h"
#include "calib/identify/identify.h"
#include "calib/verdict/change.h"
#include "calib/verdict/verdict.h"
#include "sim/cell/compare.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::make_touches;
using testing::plain_truth;

struct AnArmAsFound : ::testing::Test {
  static void SetUpTestSuite() {
    touches = new std::vector<Touch>(make_touches(demo_cell(), plain_truth(demo_cell(), 3),
                                                  {.fit = 60, .check = 12, .rho_m = 2e-4})
                                         .touches);
    now = new Calibration(identify(demo_cell(), *touches));
    outlier = new std::vector<bool>(touches->size());
    for (const Outlier& one : now->outliers) (*outlier)[one.touch] = true;
  }
  static void TearDownTestSuite() {
    delete touches;
    delete now;
    delete outlier;
  }
  /// As delivered: no error identified yet.
  static Calibration nominal() {
    Calibration same = *now;
    for (ParameterResult& one : same.parameters) one.correction = 0.0;
    return same;
  }
  static inline std::vector<Touch>* touches = nullptr;
  static inline Calibration* now = nullptr;
  static inline std::vector<bool>* outlier = nullptr;
};

TEST_F(AnArmAsFound, ByTheNominalArmIsWhatTheCalibrationSaysOfBefore) {
  const auto found = found_residuals(nominal(), *touches, *outlier);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->fit.count, now->before.count);
  EXPECT_EQ(found->check.count, now->check_before.count);
  EXPECT_NEAR(found->fit.rms_m, now->before.rms_m, 1e-6);
  EXPECT_NEAR(found->fit.max_m, now->before.max_m, 1e-5);
  EXPECT_NEAR(found->check.rms_m, now->check_before.rms_m, 1e-5);
}

TEST_F(AnArmAsFound, ByItsOwnCalibrationIsAsLeft) {
  const auto found = found_residuals(*now, *touches, *outlier);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->fit.rms_m, now->after.rms_m, 3e-6);
  EXPECT_NEAR(found->check.rms_m, now->check.rms_m, 3e-6);
}

TEST_F(AnArmAsFound, DoesNotBlameTheArmForSpheresThatWereSetUpAnew) {
  Calibration moved = *now;
  for (Target& target : moved.cell.targets) target.centre_m.x() += 0.05;
  for (TargetResult& target : moved.targets) target.centre_m.x() += 0.05;
  EXPECT_NEAR(found_residuals(moved, *touches, *outlier)->fit.rms_m, now->after.rms_m, 3e-6);
}

TEST_F(AnArmAsFound, IsNotSaidOfSpheresOrToolsThatTheEarlierOneDidNotHave) {
  std::vector<Touch> others = *touches;
  others[5].target = "S9";
  EXPECT_FALSE(found_residuals(*now, others, *outlier));
  others = *touches;
  others[5].tool = "probe";
  EXPECT_FALSE(found_residuals(*now, others, *outlier));
  EXPECT_FALSE(found_residuals(*now, {}, {}));
}

TEST(TheErrorOfTheNominalModel, IsThisArmsOwnWithinItsStatedUncertainty) {
  constexpr int kArms = 20;
  int held = 0, held_near = 0;
  double smallest = 1.0, largest = 0.0, off = 0.0, of_u = 0.0;
  for (int seed = 1; seed <= kArms; ++seed) {
    const sim::Truth truth = plain_truth(demo_cell(), static_cast<std::uint64_t>(seed));
    const auto made =
        make_touches(demo_cell(), truth, {.fit = 60, .seed = static_cast<unsigned>(seed)}).touches;
    const Calibration c = identify(demo_cell(), made, {.region_poses = kStatedPoses});
    std::vector<JointVector> around;
    for (const Touch& touch : made) around.push_back(touch.joint_rad);
    const sim::TruthFigures real = sim::truth_figures(truth, c, around);
    const double real_m = real.workspace.nominal_mean_m;
    held_near += std::abs(c.nominal_near_targets_m - real.local.nominal_mean_m) <=
                 c.nominal_near_targets_u_m;
    held += std::abs(c.nominal_workspace_m - real_m) <= c.nominal_workspace_u_m;
    smallest = std::min(smallest, c.nominal_workspace_m);
    largest = std::max(largest, c.nominal_workspace_m);
    off += std::abs(c.nominal_workspace_m - real_m) / kArms;
    of_u += c.nominal_workspace_u_m / kArms;
    EXPECT_LT(c.nominal_workspace_u_m, 0.25 * c.nominal_workspace_m) << seed;
  }
  std::printf(
      "%d of %d arms within U, %d near the targets; %.2f to %.2f mm, off by %.3f mm, U %.3f mm in the mean\n",
      held, kArms, held_near, 1e3 * smallest, 1e3 * largest, 1e3 * off, 1e3 * of_u);
  EXPECT_GE(held, 18);
  EXPECT_GE(held_near, 18);
  EXPECT_GT(largest, 1.5 * smallest);  // a figure of the arm, not of the model
}

TEST_F(AnArmAsFound, IsApartOverTheScopeByTheErrorsThatWereFound) {
  EXPECT_NEAR(apart_in_scope(now, *now, *touches, true)->max_apart_m, 0.0, 1e-12);
  const auto drawn = apart_in_scope(nullptr, *now, *touches, true);
  ASSERT_TRUE(drawn);
  EXPECT_EQ(drawn->poses, kScopePoses);
  EXPECT_NEAR(drawn->mean_apart_m, now->nominal_workspace_m, 0.03 * now->nominal_workspace_m);
  EXPECT_GT(drawn->max_apart_m, drawn->mean_apart_m);
  EXPECT_GT(drawn->mean_u95_m, now->predicted_workspace_m);
  const auto near = apart_in_scope(nullptr, *now, *touches, false);
  ASSERT_TRUE(near);
  EXPECT_LT(near->mean_u95_m, drawn->mean_u95_m);
  Calibration other = *now;
  other.cell.robot.joints[1].a_m += 1e-3;
  EXPECT_FALSE(apart_in_scope(&other, *now, *touches, true));
}

}  // namespace
}  // namespace cellcal::calib
