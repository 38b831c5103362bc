// The controller's model of the arm over both interfaces, from the emulated controllers to the comparison.

#include "daemon/runner/stated_poses.h"

#include <gtest/gtest.h>

#include "calib/files/files.h"
#include "calib/model/linear.h"
#include "sim/cell/truth.h"
#include "sim/krc/cartesian_arm.h"
#include "tests/drivers/kuka/eki/eki_rig.h"
#include "tests/drivers/kuka/rsi/rig.h"

namespace cellcal::daemon {
namespace {

using Outcome = calib::ControllerModel::Outcome;
using drivers::MoveOutcome;
using namespace std::chrono_literals;

calib::Cell cell_of(const char* robot) {
  calib::Cell cell;
  cell.robot = calib::load_named_robot(robot);
  return cell;
}

/// The KR 5 with errors of its tolerances.
calib::Cell measured() {
  calib::Cell cell = cell_of("kr5_r1400");
  sim::Truth truth{calib::ArmModel(cell.robot, cell.tool), {}, {}, {}};
  calib::Random random(3);
  truth.errors.resize(truth.arm.size());
  for (int i = 0; i < truth.arm.size(); ++i)
    truth.errors[i] = random.normal() * truth.arm.parameters()[static_cast<std::size_t>(i)].sigma;
  cell.robot = sim::measured_robot(truth);
  return cell;
}

/// Moves to some postures; $TOOL and $BASE are configured as $NULLFRAME.
template <class Rig>
Outcome compared_by(Rig& rig) {
  const Eigen::Isometry3d none = Eigen::Isometry3d::Identity();
  StatedPoses poses(cell_of("kr5_r1400").robot, {none, none});
  rig.make_ready();
  poses.observe(rig.core.state());
  calib::Random random(7);
  for (int k = 0; k < 8; ++k) {
    drivers::AxisAngles to{0.0, -90.0, 90.0, 0.0, 90.0, 0.0};
    for (double& angle : to) angle = (angle + random.uniform(-30.0, 30.0)) * drivers::kDeg;
    rig.begin(drivers::MoveKind::kTransit, to);
    std::optional<drivers::CoreResult> result;
    EXPECT_TRUE(rig.run_until([&] { return (result = rig.core.next_result()).has_value(); }, 60s));
    EXPECT_EQ(result.value().outcome, MoveOutcome::kArrived);
    rig.run(500ms);
    poses.observe(rig.core.state());
  }
  EXPECT_EQ(poses.judge().postures, 9u);
  EXPECT_EQ(poses.judged().outcome, poses.judge().outcome);
  return poses.judged().outcome;
}

void expect_over_both_wires(const calib::Cell& stated, Outcome outcome) {
  sim::ControllerConfig rsi;
  rsi.noise_sigma_deg = 0.0005;
  rsi.states = sim::make_cartesian_arm(stated);
  drivers::Rig over_rsi(rsi);
  EXPECT_EQ(compared_by(over_rsi), outcome) << "RSI";
  sim::EkiControllerConfig eki = drivers::eki_controller();
  eki.noise_sigma_deg = 0.0005;
  eki.states = sim::make_cartesian_arm(stated);
  drivers::EkiRig over_eki(eki);
  EXPECT_EQ(compared_by(over_eki), outcome) << "EKI";
}

TEST(StatedPoses, OfTheRobotFilesArmAgree) {
  expect_over_both_wires(cell_of("kr5_r1400"), Outcome::kAgrees);
}

TEST(StatedPoses, OfAnotherTypeOrWithAbsoluteAccuracyDiffer) {
  expect_over_both_wires(cell_of("kr5_arc"), Outcome::kDiffers);
  expect_over_both_wires(measured(), Outcome::kDiffers);
}

TEST(StatedPoses, WithAnotherToolAreOfTheSameModel) {
  calib::Cell cell = cell_of("kr5_r1400");
  cell.tool.tcp.translation() = Eigen::Vector3d(0.06, 0.05, 0.41);
  cell.tool.tcp.linear() =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  expect_over_both_wires(cell, Outcome::kOtherFrames);
}

}  // namespace
}  // namespace cellcal::daemon
