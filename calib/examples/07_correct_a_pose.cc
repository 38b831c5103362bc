// Joint angles that bring the real TCP to a pose, instead of those of the nominal arm.
//   07_correct_a_pose calibration.json 0 -90 90 0 30 0     pose of the nominal arm, axis angles in degrees
#include <cstdlib>
#include <exception>
#include <iostream>
#include <numbers>
#include <variant>

#include "calib/estimate/predict.h"
#include "calib/export/corrector.h"
#include "calib/files/calibration_json.h"

int main(int argc, char** argv) try {
  using namespace cellcal::calib;
  if (argc < 3) {
    std::cerr << "07_correct_a_pose CALIBRATION AXIS_ANGLES_IN_DEGREES...\n";
    return 2;
  }
  const Calibration calibration = load_calibration(argv[1]);
  JointVector seed;
  for (int i = 2; i < argc; ++i) seed.push_back(std::atof(argv[i]) * std::numbers::pi / 180.0);
  if (seed.size() != calibration.cell.robot.joints.size()) {
    std::cerr << "this arm has " << calibration.cell.robot.joints.size() << " axes\n";
    return 2;
  }
  const Eigen::Isometry3d wanted = Predictor(calibration).nominal(seed);
  const Reach reach = Corrector(calibration).joints(wanted, seed);
  if (const auto* reason = std::get_if<NotReached>(&reach)) {
    std::cerr << words(*reason, calibration.cell.robot) << '\n';
    return 1;
  }
  const auto& at = std::get<Reached>(reach);
  std::cout << "corrected";
  for (const double q : at.joint_rad) std::cout << ' ' << q * 180.0 / std::numbers::pi;
  std::cout << " deg, forward " << 1e3 * at.off_m << " mm off\n";
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
