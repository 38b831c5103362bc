// Parts of the arm's model selected by evidence: transmission errors as functions of each joint's
// own angle, and compliance across the axes; learnt if the touches support them, otherwise absent.

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "calib/estimate/predict.h"
#include "calib/files/calibration_json.h"
#include "calib/identify/identify.h"
#include "calib/model/kinematics.h"
#include "calib/model/units.h"
#include "tests/calib/identify/judged.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::has_functions;
using testing::make_touches;
using testing::plain_truth;
using testing::truth_with_waves;

const std::vector<Touch>& touches_of_waves() {
  static const std::vector<Touch> touches =
      make_touches(demo_cell(), truth_with_waves(), {.fit = 250, .check = 60, .seed = 3}).touches;
  return touches;
}

const Calibration& learnt() {
  static const Calibration c = identify(demo_cell(), touches_of_waves());
  return c;
}

TEST(JointFunctions, AreLearntWhereTouchesSpeakForThem) {
  ASSERT_TRUE(has_functions(learnt()));
  const Calibration without = identify(demo_cell(), touches_of_waves(), {.level = ModelLevel{}});
  ASSERT_FALSE(has_functions(without));
  EXPECT_LT(learnt().check.rms_m, 0.75 * without.check.rms_m);
}

TEST(JointFunctions, AreAbsentWhereThereAreNone) {
  const auto touches =
      make_touches(demo_cell(), plain_truth(demo_cell(), 7), {.fit = 60, .seed = 3}).touches;
  EXPECT_FALSE(has_functions(identify(demo_cell(), touches)));
}

TEST(JointFunctions, OfASizeThatNoGearHasAreNotLearnt) {
  auto touches =
      make_touches(demo_cell(), plain_truth(demo_cell(), 7), {.fit = 100, .seed = 3}).touches;
  for (Touch& touch : touches)
    touch.joint_rad[1] += 2000.0 * kRadPerArcsec * std::sin(8.0 * touch.joint_rad[1]);
  const Calibration c = identify(demo_cell(), touches);
  EXPECT_FALSE(has_functions(c));
  EXPECT_FALSE(c.verdict.publish());
}

TEST(JointFunctions, LeaveAFasterWaveOfOneJointToItself) {
  const std::string name = demo_cell().robot.joints[1].name;
  const auto touches =
      make_touches(demo_cell(), truth_with_waves(name), {.fit = 400, .check = 60, .seed = 3})
          .touches;
  const Calibration c = identify(demo_cell(), touches);
  const auto is_the_wave = [](const JointWave& wave) { return std::abs(wave.order - 62) <= 1; };
  for (const Joint& joint : c.cell.robot.joints)
    EXPECT_EQ(std::ranges::any_of(joint.waves, is_the_wave), joint.name == name) << joint.name;
  // The largest coefficient above the orders of the functions is that of the wave.
  const auto fast = [](const ParameterResult& p) {
    return is_function(p.key.kind) && p.key.harmonic > kHighestOrder ? std::abs(p.correction) : 0.0;
  };
  const auto largest = std::ranges::max_element(c.parameters, {}, fast);
  EXPECT_NEAR(largest->key.harmonic, 62, 1);
}

/// Random orders of 5 to 40 per turn in every joint, and of 41 to 100 in the second.
Cell cell_with_fast_orders() {
  Cell cell = demo_cell();
  for (Joint& joint : cell.robot.joints) {
    joint.function_sigma_rad = 15.0 * kRadPerArcsec;
    joint.function_reach_rad = 0.1;
  }
  cell.robot.joints[1].function_fast_sigma_rad = 18.0 * kRadPerArcsec;
  return cell;
}

TEST(JointFunctions, HaveFastOrdersWhereNoSingleWaveExplainsAJoint) {
  const auto touches = make_touches(demo_cell(), plain_truth(cell_with_fast_orders(), 7),
                                    {.fit = 300, .check = 60, .seed = 3})
                           .touches;
  const Calibration c = identify(demo_cell(), touches);
  for (std::size_t i = 0; i < c.cell.robot.joints.size(); ++i)
    EXPECT_EQ(c.cell.robot.joints[i].function_fast_sigma_rad > 0.0, i == 1) << i;
  const Calibration read = calibration_from_json(calibration_to_json(c), "learnt.json");
  EXPECT_NEAR(read.cell.robot.joints[1].function_fast_sigma_rad,
              c.cell.robot.joints[1].function_fast_sigma_rad, 1e-12);
  EXPECT_EQ(read.parameters.size(), c.parameters.size());
}

TEST(JointFunctions, AreReadBackFromTheirFile) {
  const Calibration read = calibration_from_json(calibration_to_json(learnt()), "learnt.json");
  const Predictor before(learnt()), after(read);
  for (std::size_t i = 0; i < 5; ++i) {
    const Prediction a = before.calibrated(touches_of_waves()[i].joint_rad),
                     b = after.calibrated(touches_of_waves()[i].joint_rad);
    EXPECT_LT((a.tcp.translation() - b.tcp.translation()).norm(), 1e-12);
    EXPECT_NEAR(a.u95_m, b.u95_m, 1e-6 * a.u95_m);
  }
}

TEST(JointFunctions, AreTabulatedOverTheAnglesTouched) {
  const auto file = nlohmann::json::parse(calibration_to_json(learnt()));
  ASSERT_EQ(file["joint_functions"].size(), learnt().cell.robot.joints.size());
  const auto& table = file["joint_functions"][1];
  const Joint& joint = learnt().cell.robot.joints[1];
  EXPECT_EQ(table["joint"], joint.name);
  EXPECT_NEAR(table["angle_deg"].front(), joint.function_min_rad * kDegPerRad, 1e-9);
  EXPECT_NEAR(table["angle_deg"].back(), joint.function_max_rad * kDegPerRad, 1e-9);
  ASSERT_EQ(table["angle_deg"].size(), table["error_arcsec"].size());
  // Compared with the series, at one angle.
  const std::size_t at = table["angle_deg"].size() / 2;
  const double angle = table["angle_deg"][at].get<double>() / kDegPerRad;
  double error = 0.0;
  for (const ParameterResult& p : learnt().parameters)
    if (is_function(p.key.kind) && p.key.joint == 1)
      error += p.correction * (p.key.kind == ParameterKind::kFunctionCosine
                                   ? std::cos(p.key.harmonic * angle)
                                   : std::sin(p.key.harmonic * angle));
  EXPECT_NEAR(table["error_arcsec"][at], error / kRadPerArcsec, 1e-6);
  EXPECT_GT(table["u95_arcsec"][at], 0.0);
}

TEST(JointFunctions, TheNextSessionWithTheirRobotHasThem) {
  const Calibration again = identify(learnt().cell, touches_of_waves(), {.level = ModelLevel{}});
  EXPECT_TRUE(has_functions(again));
}

bool has_bearings(const Calibration& c) {
  return std::ranges::any_of(
      c.parameters, [](const ParameterResult& p) { return p.key.kind == ParameterKind::kBearing; });
}

/// Bearings of A1 to A3 with a compliance of 6 arcsec per 10 N m, 1 sigma.
Cell cell_with_bearings() {
  Cell cell = demo_cell();
  for (std::size_t i : {0, 1, 2}) cell.robot.joints[i].bearing_sigma_rad_per_nm = 3e-6;
  return cell;
}

TEST(Bearings, AreLearntWhereTheRobotFileStatesThem) {
  const auto touches = make_touches(demo_cell(), plain_truth(cell_with_bearings(), 7),
                                    {.fit = 150, .check = 60, .seed = 3})
                           .touches;
  const Calibration learnt = identify(cell_with_bearings(), touches);
  ASSERT_TRUE(has_bearings(learnt));
  const Calibration without = identify(demo_cell(), touches, {.level = ModelLevel{}});
  ASSERT_FALSE(has_bearings(without));
  EXPECT_LT(learnt.check.rms_m, without.check.rms_m);
}

TEST(Bearings, AreAbsentWhereThereAreNone) {
  const auto touches =
      make_touches(demo_cell(), plain_truth(demo_cell(), 7), {.fit = 150, .seed = 3}).touches;
  EXPECT_FALSE(has_bearings(identify(demo_cell(), touches)));
}

/// Bearings with a compliance of 40 arcsec per 10 N m.
TEST(Bearings, AreLearntWhereTheTouchesShowThem) {
  Cell soft = demo_cell();
  for (std::size_t i : {0, 1, 2}) soft.robot.joints[i].bearing_sigma_rad_per_nm = 2e-5;
  const auto touches =
      make_touches(demo_cell(), plain_truth(soft, 7), {.fit = 150, .check = 60, .seed = 3}).touches;
  const Calibration learnt = identify(demo_cell(), touches);
  ASSERT_TRUE(has_bearings(learnt));
  EXPECT_LT(learnt.check.rms_m,
            0.8 * identify(demo_cell(), touches, {.level = ModelLevel{}}).check.rms_m);
}

Cell heavy_cell() {
  Cell cell = demo_cell();
  cell.robot.joints[1].counterbalance_sigma_rad = 300.0 * kRadPerArcsec;
  for (std::size_t i : {1, 2}) {
    cell.robot.joints[i].stiffening_sigma_rad = 60.0 * kRadPerArcsec;
    cell.robot.joints[i].stiffening_nm = 50.0;
  }
  return cell;
}

TEST(HeavyArm, HasCounterbalanceAndStiffeningGearsWhereItsFileStatesThem) {
  const auto touches =
      make_touches(demo_cell(), plain_truth(heavy_cell(), 7), {.fit = 100, .check = 60, .seed = 3})
          .touches;
  const Calibration with = identify(heavy_cell(), touches);
  EXPECT_TRUE(with.verdict.publish());
  EXPECT_GT(with.log_evidence, identify(demo_cell(), touches).log_evidence + 10.0);
  EXPECT_TRUE(std::ranges::any_of(with.parameters, [](const ParameterResult& p) {
    return p.key.kind == ParameterKind::kStiffening;
  }));
}

}  // namespace
}  // namespace cellcal::calib
