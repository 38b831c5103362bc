#pragma once
// The seed paper's task with a known truth: an arm with given errors, touching one sphere. Touches
// are made on the exact chain (not the paper's linearised one): contact is where the real tip, bent
// by its weight, meets the sphere.

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "calib/model/kinematics.h"
#include "calib/model/robot.h"
#include "calib/model/touch.h"

namespace cellcal::sim::paper {

/// Errors of one joint from the paper's tables; a missing d or beta is zero.
struct JointErrors {
  double theta_rad = 0.0, d_m = 0.0, a_m = 0.0, alpha_rad = 0.0, beta_rad = 0.0;
};

struct Conditions {
  std::string cell;                 ///< file name of the cell, in this file's directory
  std::vector<JointErrors> errors;  ///< per joint, true
  double deflection = 0.0;          ///< c_t, true, 1/(N m^2)
  int fit_touches = 50;
  int check_touches = 30;
  double noise_m = 0.0;  ///< 1 sigma of one contact along the sphere's normal
  unsigned seed = 1;
};

/// Section 4: the errors of Table 2 (metres and radians, in spite of its heading), no noise.
Conditions simulation_conditions();
/// Section 5: the errors reported in Table 3 for the real robot are used in place of its unknown
/// ones.
Conditions experiment_conditions();

/// Sphere centre in the paper, base frame [m].
Eigen::Vector3d sphere_centre();

struct Task {
  calib::Cell cell;
  Eigen::VectorXd true_errors;         ///< in the order of ArmModel::parameters()
  Eigen::Vector3d centre_m;            ///< true
  double radius_m = 0.0;               ///< true
  std::vector<calib::Touch> touches;   ///< fit touches, then check touches
  std::vector<Eigen::Vector3d> tip_m;  ///< position of the real tip, per touch, base frame
};

/// Throws std::runtime_error if too few places on the sphere are reachable, calib::FileError for an
/// invalid cell file.
Task make_task(const Conditions& conditions);

}  // namespace cellcal::sim::paper
