// Single waves of the joints' gears, found among all orders of all joints.

#include <gtest/gtest.h>

#include <algorithm>

#include "calib/files/calibration_json.h"
#include "calib/identify/identify.h"
#include "calib/model/units.h"
#include "tests/calib/identify/judged.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::make_touches;
using testing::plain_truth;

constexpr std::size_t kJoint = 1;
constexpr int kOrder = 103;

std::vector<Touch> touches_of(double wave_rad) {
  Cell waved = demo_cell();
  if (wave_rad > 0.0) waved.robot.joints[kJoint].waves = {{kOrder, wave_rad}};
  return make_touches(demo_cell(), plain_truth(waved, 7), {.fit = 250, .check = 60, .seed = 3})
      .touches;
}

const Calibration& found() {
  static const Calibration c = identify(demo_cell(), touches_of(20.0 * kRadPerArcsec));
  return c;
}

TEST(JointWaves, AreFoundInTheJointThatHasOne) {
  for (std::size_t j = 0; j < found().cell.robot.joints.size(); ++j) {
    const Joint& joint = found().cell.robot.joints[j];
    ASSERT_EQ(joint.waves.size(), j == kJoint ? 1U : 0U) << joint.name;
  }
  EXPECT_EQ(found().cell.robot.joints[kJoint].waves.front().order, kOrder);
}

TEST(JointWaves, MakeTheResultBetter) {
  const Calibration without =
      identify(demo_cell(), touches_of(20.0 * kRadPerArcsec), {.functions = false});
  EXPECT_LT(found().check.rms_m, 0.8 * without.check.rms_m);
}

TEST(JointWaves, AreAbsentWhereThereAreNone) {
  const Calibration c = identify(demo_cell(), touches_of(0.0));
  for (const Joint& joint : c.cell.robot.joints) EXPECT_TRUE(joint.waves.empty()) << joint.name;
}

TEST(JointWaves, AreReadBackFromTheirFile) {
  const Calibration read = calibration_from_json(calibration_to_json(found()), "found.json");
  ASSERT_EQ(read.cell.robot.joints[kJoint].waves.size(), 1U);
  EXPECT_EQ(read.parameters.size(), found().parameters.size());
}

}  // namespace
}  // namespace cellcal::calib
