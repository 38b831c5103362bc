// An arm built in code instead of a file: two links of 0.4 m in a plane on a turning base. It
// touches one sphere with joint 2 off by 0.2 degrees, and the error is identified from the touches.
#include <cmath>
#include <exception>
#include <iostream>
#include <numbers>

#include "calib/identify/identify.h"
#include "calib/model/kinematics.h"

using namespace cellcal::calib;

namespace {

constexpr double kDeg = std::numbers::pi / 180.0;

Joint joint(const char* name, double d_m, double a_m, double alpha_rad) {
  Joint j;
  j.name = name;
  j.d_m = d_m;
  j.a_m = a_m;
  j.alpha_rad = alpha_rad;
  j.min_rad = -170 * kDeg;
  j.max_rad = 170 * kDeg;
  j.tolerance_length_m = 0.5e-3;
  j.tolerance_angle_rad = 0.5 * kDeg;
  j.errors = {JointError::kTheta};
  return j;
}

}  // namespace

int main() try {
  Cell cell;
  cell.robot.name = "planar arm";
  cell.robot.joints = {joint("A1", 0.3, 0.0, 90 * kDeg), joint("A2", 0.0, 0.4, 0.0),
                       joint("A3", 0.0, 0.4, 0.0)};
  cell.tool.tcp.translation() = Eigen::Vector3d(0.05, 0.0, 0.0);
  cell.touch_sigma_m = 0.05e-3;
  Target sphere;
  sphere.id = "S1";
  sphere.diameter_m = 0.05;
  sphere.has_centre = true;
  sphere.centre_m = Eigen::Vector3d(0.55, 0.1, 0.25);
  sphere.centre_sigma_m = 1e-4;
  cell.targets = {sphere};

  // The real arm: joint 2 is off by 0.2 degrees. Contacts with the sphere are found by bisection.
  Robot real = cell.robot;
  real.joints[1].offset_rad += 0.2 * kDeg;
  const ArmModel arm(real, cell.tool);
  std::vector<Touch> touches;
  for (int k = 0; k < 40; ++k) {
    const double a1 = (8.5 + 0.9 * (k % 5)) * kDeg, a3 = -(92.0 + 1.5 * (k / 5)) * kDeg;
    double low = -20 * kDeg, high = 120 * kDeg;  // of joint 2
    const auto depth_m = [&](double a2) {
      const std::vector<double> q = {a1, a2, a3};
      return (arm.nominal_tcp(q).translation() - sphere.centre_m).norm() - 0.025;
    };
    // The tip descends from above until it touches.
    while (depth_m(high) > 0.0 && high > low) high -= 0.2 * kDeg;
    if (high <= low) continue;
    low = high, high = high + 0.2 * kDeg;
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (low + high);
      (depth_m(middle) > 0.0 ? high : low) = middle;
    }
    Touch touch;
    touch.joint_rad = {a1, high, a3};
    touch.target = "S1";
    touches.push_back(touch);
  }
  const Calibration result = identify(cell, touches);
  std::cout << touches.size() << " touches\n";
  for (const ParameterResult& p : result.parameters) {
    if (p.decided_by != DecidedBy::kData) continue;
    std::cout << parameter_name(cell, p.key) << "  " << p.correction * p.to_unit << " +- "
              << 2.0 * p.sigma * p.to_unit << ' ' << p.unit << '\n';
  }
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
