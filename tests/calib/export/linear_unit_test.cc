// Refusals of a linear unit.

#include <gtest/gtest.h>

#include "calib/export/corrector.h"
#include "calib/export/rigid_arm.h"
#include "calib/files/files.h"
#include "calib/model/error.h"

namespace cellcal::calib {
namespace {

Calibration on_a_track() {
  Calibration c;
  c.cell.robot = load_robot(CELLCAL_ROBOTS_FOLDER "/kr16_2.toml");
  Joint unit;
  unit.name = "E1";
  unit.max_rad = 3.0;
  unit.guide.emplace();
  c.cell.robot.joints.insert(c.cell.robot.joints.begin(), unit);
  return c;
}

TEST(LinearUnitExport, IsRefusedByCorrectionsAndRigidArms) {
  const Calibration c = on_a_track();
  EXPECT_THROW(Corrector{c}, LinearUnitError);
  EXPECT_THROW(nominal_rigid_arm(c.cell), LinearUnitError);
  EXPECT_THROW(calibrated_rigid_arm(c), LinearUnitError);
}

}  // namespace
}  // namespace cellcal::calib
