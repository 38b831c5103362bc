// Refusals of a positioner.

#include <gtest/gtest.h>

#include "calib/export/corrector.h"
#include "calib/export/rigid_arm.h"
#include "calib/files/files.h"
#include "calib/model/error.h"

namespace cellcal::calib {
namespace {

TEST(PositionerExport, IsRefusedByCorrectionsAndRigidArms) {
  Calibration c;
  c.cell.robot = load_robot(CELLCAL_ROBOTS_FOLDER "/kr16_2.toml");
  EXPECT_NO_THROW(nominal_rigid_arm(c.cell));
  c.cell.robot.positioner.resize(1);
  c.cell.robot.positioner[0].name = "E1";
  EXPECT_THROW(Corrector{c}, PositionerError);
  EXPECT_THROW(nominal_rigid_arm(c.cell), PositionerError);
  EXPECT_THROW(calibrated_rigid_arm(c), PositionerError);
}

}  // namespace
}  // namespace cellcal::calib
