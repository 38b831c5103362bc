// Repeated touches at one place measure the noise of a touch, independently of the arm's errors.

#include "calib/estimate/repeats.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "calib/estimate/evidence.h"
#include "calib/estimate/start.h"
#include "calib/identify/identify.h"
#include "calib/identify/identify_once.h"
#include "calib/model/linear.h"
#include "tests/calib/simulate.h"
#include "tests/experiments/constraints/stage.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::make_touches;
using testing::plain_truth;

/// Contact detected this far before the true surface.
void push_out(Touch& touch, const sim::Truth& truth, double off_m) {
  const Eigen::Vector3d tip =
      truth.arm.position(truth.arm.prepare(touch.joint_rad), truth.errors.data());
  const Eigen::Vector3d normal =
      (tip - truth.centre_m[demo_cell().target_index(touch.target)]).normalized();
  const Eigen::VectorXd along =
      truth.arm.nominal_jacobian(touch.joint_rad).topRows<3>().transpose() * normal;
  for (std::size_t i = 0; i < touch.joint_rad.size(); ++i)
    touch.joint_rad[i] += off_m * along[static_cast<Eigen::Index>(i)] / along.squaredNorm();
}

/// Each of `places` touches made `times` times, with noise along the true normal.
std::vector<Touch> repeated(int places, int times, double noise_m, unsigned seed = 1) {
  const sim::Truth truth = plain_truth(demo_cell(), seed);
  const auto made =
      make_touches(demo_cell(), truth, {.fit = places, .noise_m = 0.0, .seed = seed}).touches;
  Random random(seed + 1000);
  std::vector<Touch> touches;
  for (int k = 0; k < times; ++k)
    for (const Touch& touch : made) {
      touches.push_back(touch);
      push_out(touches.back(), truth, noise_m * random.normal());
    }
  return touches;
}

Repeats of(const std::vector<Touch>& touches) {
  const ArmModel arm(demo_cell().robot, demo_cell().tool);
  const Problem problem(demo_cell(), arm, touches, starting_places(demo_cell(), arm, touches));
  return find_repeats(problem);
}

TEST(Repeats, AreNotWhereTheLoadIsAnother) {
  Cell cell = demo_cell();
  cell.loads = {{"full", 5.0, {0.0, 0.0, 0.1}}};
  std::vector<Touch> touches = repeated(10, 2, 1e-5);
  for (std::size_t i = 0; i < 10; ++i) touches[i].load = "full";
  const ArmModel arm(cell);
  const Problem problem(cell, arm, touches, starting_places(cell, arm, touches));
  const Repeats found = find_repeats(problem);
  EXPECT_EQ(found.touches, 0);
  EXPECT_EQ(found.times, std::vector<int>(20, 2)) << "the ripple of a posture is that of both";
  const std::vector<Touch> some = of_one_tool_per_posture(touches);
  EXPECT_EQ(some.size(), 10u);
  EXPECT_EQ(of_one_tool_per_posture(repeated(10, 2, 1e-5)).size(), 20u);
}

TEST(Repeats, MeasureTheNoiseOfATouchThroughTheErrorsOfAnUncalibratedArm) {
  for (const double noise : {1e-5, 5e-5}) {
    const Repeats repeats = of(repeated(30, 3, noise));
    EXPECT_EQ(repeats.touches, 90);
    EXPECT_EQ(repeats.degrees_of_freedom, 60.0);
    EXPECT_EQ(repeats.times, std::vector<int>(90, 3));
    // 1 / sqrt(2 * 60) = 9 %; normals of the nominal arm are off by some degrees.
    EXPECT_NEAR(repeats.scatter_m / noise, 1.0, 0.25);
  }
}

TEST(Repeats, AreNotSeenAmongTouchesOfOtherPlacesTargetsOrSets) {
  const Repeats none = of(repeated(60, 1, 3e-5));
  EXPECT_EQ(none.touches, 0);
  EXPECT_EQ(none.degrees_of_freedom, 0.0);
  EXPECT_EQ(none.used_m, demo_cell().touch_sigma_m);
  auto touches = repeated(30, 2, 3e-5);
  touches[30].joint_rad[5] += 0.002;  // of the first touch; 0.11 deg
  touches[31].target = touches[0].target;
  touches[32].set = TouchSet::kCheck;
  EXPECT_EQ(of(touches).touches, 54);
}

TEST(Repeats, ThatStateTheirOwnNoiseMeasureItAndKeepIt) {
  auto touches = repeated(30, 2, 5e-5);
  for (Touch& touch : touches) touch.sigma_m = 1e-4;
  const Repeats found = of(touches);
  EXPECT_EQ(found.touches, 60);
  EXPECT_EQ(found.degrees_of_freedom, 30.0);
  EXPECT_NEAR(found.scatter_m / 5e-5, 1.0, 0.35);
  EXPECT_EQ(found.used_degrees, 0.0);
  EXPECT_EQ(found.used_m, demo_cell().touch_sigma_m);
  for (std::size_t i = 0; i < 30; ++i) touches[i].sigma_m = 2e-4;
  EXPECT_EQ(of(touches).touches, 0) << "their mean would have no one weight";
}

TEST(Repeats, ThatAreCopiesMeasureNothing) {
  EXPECT_EQ(of(repeated(30, 3, 0.0)).degrees_of_freedom, 0.0);
}

TEST(Repeats, AreNotTouchesOfAnotherSpeedWhereTheLatchDelayIsInDoubt) {
  auto touches = repeated(30, 2, 5e-5);
  for (std::size_t i = 0; i < touches.size(); ++i) touches[i].speed_m_s = i < 30 ? 0.01 : 0.002;
  EXPECT_EQ(of(touches).touches, 60) << "0.2 ms make 0.0016 mm";
  Cell doubtful = demo_cell();
  doubtful.latch_delay_sigma_s = 5e-3;
  const ArmModel arm(doubtful);
  const Problem problem(doubtful, arm, touches, starting_places(doubtful, arm, touches));
  EXPECT_EQ(find_repeats(problem).touches, 0);
}

TEST(Repeats, FinerThanTheTouchesLeaveToEveryLevelWhatThePosturesShare) {
  const sim::Truth truth = plain_truth(demo_cell(), 2);
  const auto once =
      make_touches(demo_cell(), truth, {.fit = 60, .noise_m = demo_cell().touch_sigma_m, .seed = 2})
          .touches;
  const auto ripple_free = [&](double again_m) {
    Random random(7);
    std::vector<Touch> touches;
    for (const Touch& touch : once)
      for (int k = 0; k < 2; ++k) {
        touches.push_back(touch);
        push_out(touches.back(), truth, again_m * random.normal());
      }
    const Calibration c = identify_single_pass(demo_cell(), touches);
    return std::ranges::count(c.levels, 0.0,
                              [](const LevelEvidence& l) { return l.level.ripple_rad; });
  };
  EXPECT_EQ(ripple_free(0.1 * demo_cell().touch_sigma_m), 0);
  EXPECT_GT(ripple_free(demo_cell().touch_sigma_m), 0) << "as stated";
}

TEST(Repeats, OfAParkedArmMeasureTheNoiseOfItsTracker) {
  const sim::constraints::Stage stage =
      sim::constraints::set_up(testing::tracker_cell(), {.seed = 3});
  Random random(3);
  std::vector<Touch> touches;
  for (const Touch& place : sim::constraints::touch(stage, {.fit = 20, .noise_m = 0.0, .seed = 3}))
    for (int k = 0; k < 4; ++k) {
      touches.push_back(place);
      for (double& reading : touches.back().tracker_m) reading += 9e-5 * random.normal();
    }
  const ArmModel arm(stage.cell.robot, stage.cell.tool);
  const auto places = starting_places(stage.cell, arm, touches);
  const Repeats repeats = find_repeats(Problem(stage.cell, arm, touches, places));
  EXPECT_EQ(repeats.touches, 80);
  EXPECT_EQ(repeats.degrees_of_freedom, 180.0);
  EXPECT_NEAR(repeats.scatter_m / 9e-5, 1.0, 0.2);
}

TEST(Repeats, GrossErrorsAmongThemDoNotCountAsNoise) {
  auto touches = repeated(30, 3, 3e-5);
  for (const std::size_t i : {3u, 40u})  // 0.25 mm, still the same place
    push_out(touches[i], plain_truth(demo_cell(), 1), 2.5e-4);
  const Repeats repeats = of(touches);
  EXPECT_EQ(repeats.touches, 90);
  EXPECT_NEAR(repeats.scatter_m, 3e-5, 1e-5);
  EXPECT_EQ(repeats.degrees_of_freedom, 56.0);
}

TEST(Repeats, ThatScatterFarLessThanStatedAreBelievedAlone) {
  Cell cell = demo_cell();
  cell.touch_sigma_m = 0.22e-3;
  const auto touches = repeated(5, 4, 2e-5);
  const ArmModel arm(cell.robot, cell.tool);
  const Repeats repeats =
      find_repeats(Problem(cell, arm, touches, starting_places(cell, arm, touches)));
  EXPECT_EQ(repeats.used_m, repeats.scatter_m);
  EXPECT_LT(repeats.used_m, 4e-5);
}

TEST(Repeats, AFewHardlyMoveTheStatedNoiseManyReplaceIt) {
  const double stated = demo_cell().touch_sigma_m;
  const Repeats few = of(repeated(2, 2, 9e-5)), many = of(repeated(60, 3, 9e-5));
  EXPECT_LT(few.used_m, 0.5 * (stated + few.scatter_m) + 1e-5);
  EXPECT_NEAR(many.used_m / many.scatter_m, 1.0, 0.05);
}

TEST(Repeats, WeighTheTouchesByWhatTheyMeasured) {
  auto touches = repeated(40, 3, 9e-5);
  const Calibration c = identify(demo_cell(), touches);
  EXPECT_NEAR(c.repeats.used_m, 8.8e-5, 1.5e-5) << "three times what the cell file states";
  EXPECT_NEAR(c.chi2_per_dof, 1.0, 0.4);
  EXPECT_TRUE(c.outliers.empty());
  for (Touch& touch : touches) touch.sigma_m = demo_cell().touch_sigma_m;
  IdentifyOptions all;
  all.reject_outliers = false;
  all.level = ModelLevel{};
  EXPECT_GT(identify_single_pass(demo_cell(), touches, all).chi2_per_dof, 5.0)
      << "a sigma that a touch states is its own";
}

TEST(Repeats, SpeakForRippleAsTheirMeanDoes) {
  const ArmModel arm(demo_cell().robot, demo_cell().tool);
  const auto gain = [&](int times, double offset_m) {
    auto touches = repeated(60, times, 0.0);
    const sim::Truth truth = plain_truth(demo_cell(), 1);
    Random random(5);
    for (std::size_t i = 0; i < 60; ++i) {  // an error of the posture
      const double off_m = offset_m * random.normal();
      for (int k = 0; k < times; ++k)
        push_out(touches[i + 60 * static_cast<std::size_t>(k)], truth, off_m);
    }
    const std::vector<Touch> once(touches.begin(), touches.begin() + 60);
    Problem problem(demo_cell(), arm, touches, starting_places(demo_cell(), arm, once));
    weigh_repeats(problem);
    problem.set_noise(3e-5 * std::sqrt(times));
    const Eigen::VectorXd u = Eigen::VectorXd::Zero(problem.size());
    const Linearisation at = linearise(problem, u, std::vector<bool>(touches.size(), true));
    const auto log_evidence = [&](double ripple_rad) {
      const ModelLevel level{1.0, 1.0, ripple_rad};
      return LevelSums(problem, u, at, std::span(&level, 1)).log_evidence();
    };
    return log_evidence(3e-5) - log_evidence(0.0);
  };
  for (const double offset_m : {0.0, 5e-5}) {
    const double once = gain(1, offset_m);
    EXPECT_NEAR(gain(4, offset_m), once, 1e-3 * std::abs(once)) << offset_m;
  }
  EXPECT_GT(gain(4, 5e-5), gain(4, 0.0) + 1.0);
}

TEST(Repeats, AreOneRowOfTheirMeanAndTheDifferencesFromIt) {
  const ArmModel arm(demo_cell().robot, demo_cell().tool);
  const auto touches = repeated(40, 3, 3e-5);
  Problem problem(demo_cell(), arm, touches, starting_places(demo_cell(), arm, touches));
  const Eigen::VectorXd u = Eigen::VectorXd::Zero(problem.size());
  std::vector<bool> use(touches.size(), true);
  use[0] = use[41] = use[81] = false;  // an outlier; two of one place
  EXPECT_EQ(mean_rows(problem, linearise(problem, u, use)).linear.touch_row.size(), 117U)
      << "repeats not sought yet";
  weigh_repeats(problem);
  const Linearisation at = linearise(problem, u, use);
  const MeanRows mean = mean_rows(problem, at);
  EXPECT_EQ(mean.linear.touch_row.size(), 40U);
  EXPECT_EQ(mean.times[2], 3);
  EXPECT_EQ(mean.times[40], 2) << "the first is not in use";
  EXPECT_EQ(mean.times[1], 1);
  const auto touched = at.residual.head(at.length_row);
  EXPECT_NEAR(mean.linear.residual.head(mean.linear.length_row).squaredNorm() + mean.differences,
              touched.squaredNorm(), 1e-9 * touched.squaredNorm());
  EXPECT_NEAR(mean.differences / (2 * 38 + 1) * std::pow(problem.own_sigma_m(0) / 3e-5, 2), 1.0,
              0.4);
  EXPECT_EQ(mean.linear.residual.tail(mean.linear.residual.size() - mean.linear.length_row),
            at.residual.tail(at.residual.size() - at.length_row));
}

TEST(Repeats, DoNotAverageTheRippleOfTheirPlaceAway) {
  IdentifyOptions ripple;
  ripple.level = ModelLevel{1.0, 1.0, 1e-4};  // 20 arcsec, some 0.1 mm at a tip
  const auto predicted = [&](int times) {
    auto touches = repeated(60, times, 1e-6);
    for (Touch& touch : touches) touch.sigma_m = 1e-6;
    return identify_single_pass(demo_cell(), touches, ripple).predicted_workspace_m;
  };
  EXPECT_NEAR(predicted(8) / predicted(1), 1.0, 0.02);
}

}  // namespace
}  // namespace cellcal::calib
