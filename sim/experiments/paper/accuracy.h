#pragma once
// Error of a calibrated arm away from the sphere, which touches on it cannot show.

#include <Eigen/Core>

#include "calib/result/calibration.h"
#include "sim/experiments/paper/task.h"

namespace cellcal::sim::paper {

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
