// True TCP position: nominal and calibrated position of one pose.
//   01_predict_a_pose calibration.json 0 -90 90 0 30 0        axis angles in degrees
#include <cstdlib>
#include <exception>
#include <iostream>
#include <numbers>
#include <vector>

#include "calib/estimate/predict.h"
#include "calib/files/calibration_json.h"

int main(int argc, char** argv) try {
  using namespace cellcal::calib;
  if (argc < 3) {
    std::cerr << "01_predict_a_pose CALIBRATION AXIS_ANGLES_IN_DEGREES...\n";
    return 2;
  }
  const Calibration calibration = load_calibration(argv[1]);
  std::vector<double> joint_rad;
  for (int i = 2; i < argc; ++i) joint_rad.push_back(std::atof(argv[i]) * std::numbers::pi / 180.0);
  if (joint_rad.size() != calibration.cell.robot.joints.size()) {
    std::cerr << "this arm has " << calibration.cell.robot.joints.size() << " axes\n";
    return 2;
  }
  const Predictor predictor(calibration);
  const Prediction real = predictor.calibrated(joint_rad);
  const Eigen::Vector3d nominal_mm = 1e3 * predictor.nominal(joint_rad).translation();
  const Eigen::Vector3d real_mm = 1e3 * real.tcp.translation();
  std::cout << "nominal    " << nominal_mm.transpose() << " mm\n"
            << "calibrated " << real_mm.transpose() << " mm, within " << 1e3 * real.u95_m
            << " mm (95 %)\n";
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
