#pragma once
// The seed paper's task with a known truth: an arm with given errors, touching one sphere. Touches
// are made on the exact chain (not the paper's linearised one): contact is where the real tip, bent
// by its weight, meets the sphere.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "calib/model/kinematics.h"
#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"

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

// Joint angles that bring the real arm's tip to a point, by Newton's method.

/// Joint angles inside the limits with the nominal tip at `tip_m` and the flange orientation
/// `flange`, from random starts; empty if none is found.
std::optional<std::vector<double>> reach_nominal(const calib::ArmModel& model,
                                                 const Eigen::Matrix3d& flange,
                                                 const Eigen::Vector3d& tip_m,
                                                 std::mt19937_64& random);

/// Smallest change of `joint_rad` that puts the tip of the arm with errors `x` exactly (1e-13 m) at
/// `tip_m`; empty if outside the limits.
std::optional<std::vector<double>> reach_exactly(const calib::ArmModel& model, const double* x,
                                                 const Eigen::Vector3d& tip_m,
                                                 std::vector<double> joint_rad);

// Error of a calibrated arm away from the sphere, which touches on it cannot show.

struct Spread {
  double mean_m = 0.0, max_m = 0.0;
};

/// Eq. 39 on the held-out touches, with the result's errors in the exact chain.
Spread check_on_exact_chain(const Task& task, const calib::Calibration& result);
/// Eq. 39 with the nominal arm and the true centre, over one set of touches: "before".
Spread nominal_error(const Task& task, calib::TouchSet set);

/// 3-D tip error over `poses` random poses of the whole workspace, after the rigid alignment that
/// removes the motion of the base frame.
Spread workspace_error(const Task& task, const calib::Calibration& result, int poses = 1000);

/// Errors of a result in the order of ArmModel::parameters(), matched by name.
Eigen::VectorXd arm_errors(const calib::ArmModel& model, const calib::Calibration& result);

}  // namespace cellcal::sim::paper
