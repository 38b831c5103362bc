#pragma once
// The demo cell with an arm calibrated by 100 touches, and possible changes afterwards.

#include <functional>
#include <string>

#include "calib/identify/identify.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib::testing {

inline const sim::Truth& truth() {
  static const sim::Truth drawn = plain_truth(demo_cell(), 5);
  return drawn;
}

inline const Calibration& calibration() {
  static const Calibration found =
      identify(demo_cell(), make_touches(demo_cell(), truth(), {.fit = 100, .seed = 5}).touches);
  return found;
}

inline sim::Truth knocked(const Eigen::Vector3d& shift_m) {
  sim::Truth after = truth();
  Tool tool = after.arm.tool();
  tool.tcp.translation() += shift_m;
  after.arm = ArmModel(after.arm.robot(), tool);
  return after;
}

inline sim::Truth with_robot(const std::function<void(Robot&)>& change) {
  sim::Truth after = truth();
  Robot robot = after.arm.robot();
  change(robot);
  after.arm = ArmModel(robot, after.arm.tool());
  return after;
}

inline sim::Truth moved(const std::string& sphere, const Eigen::Vector3d& by_m) {
  sim::Truth after = truth();
  after.centre_m[demo_cell().target_index(sphere)] += by_m;
  return after;
}

}  // namespace cellcal::calib::testing
