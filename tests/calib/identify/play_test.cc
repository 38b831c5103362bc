// Play that is closed by the load: an unknown if the touches support it, otherwise not mentioned.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "calib/estimate/predict.h"
#include "calib/files/calibration_json.h"
#include "calib/identify/identify.h"
#include "calib/model/kinematics.h"
#include "calib/model/units.h"
#include "calib/result/level.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::make_touches;
using testing::plain_truth;

/// The demo's cell, with stated masses of its arm.
Cell cell_with_masses() {
  Cell cell = demo_cell();
  const Cell heavy = at_level(cell, ModelLevel{});
  for (std::size_t i = 0; i < cell.robot.joints.size(); ++i) {
    cell.robot.joints[i].mass_kg = heavy.robot.joints[i].mass_kg;
    cell.robot.joints[i].com_m = heavy.robot.joints[i].com_m;
  }
  return cell;
}

/// Play of two minutes of arc at A2, A3 and A5, closed by 60 N m: not the moment that is assumed.
sim::Truth worn_truth(Cell worn) {
  for (const std::size_t joint : {1, 2, 4}) {
    worn.robot.joints[joint].play_sigma_rad = 60.0 * kRadPerArcsec;
    worn.robot.joints[joint].play_closes_nm = 60.0;
  }
  sim::Truth truth = plain_truth(worn, 7);
  for (int i = 0; i < truth.arm.size(); ++i) {
    const ArmParameter& p = truth.arm.parameters()[static_cast<std::size_t>(i)];
    if (p.kind == ParameterKind::kPlay) truth.errors[i] = p.sigma;
  }
  return truth;
}

bool has_play(const Calibration& c) {
  return std::any_of(c.parameters.begin(), c.parameters.end(),
                     [](const ParameterResult& p) { return p.key.kind == ParameterKind::kPlay; });
}

TEST(Play, IsAnUnknownWhereTheTouchesSpeakForIt) {
  const Cell cell = cell_with_masses();
  const auto touches =
      make_touches(cell, worn_truth(cell), {.fit = 150, .check = 20, .seed = 3}).touches;
  const Calibration c = identify(cell, touches);
  EXPECT_TRUE(c.verdict.publish());
  EXPECT_EQ(c.level.play, 1.0);
  ASSERT_TRUE(has_play(c));
  // Also retained when read back.
  const Calibration read = calibration_from_json(calibration_to_json(c), "played.json");
  EXPECT_EQ(read.level.play, 1.0);
  const auto& joints = touches[0].joint_rad;
  const Eigen::Vector3d off = Predictor(read).calibrated(joints).tcp.translation() -
                              Predictor(c).calibrated(joints).tcp.translation();
  EXPECT_LT(off.norm(), 1e-9);
}

TEST(Play, IsNotSpokenOfWhereThereIsNone) {
  const sim::Truth truth = plain_truth(demo_cell(), 7);
  const auto touches = make_touches(demo_cell(), truth, {.fit = 60, .seed = 3}).touches;
  const Calibration c = identify(demo_cell(), touches);
  EXPECT_EQ(c.level.play, 0.0);
  EXPECT_FALSE(has_play(c));
  EXPECT_EQ(calibration_to_json(c).find("play"), std::string::npos);
}

}  // namespace
}  // namespace cellcal::calib
