#pragma once
// How far the tip is foreseen to be off by a calibration.

#include <vector>

#include "calib/model/joint_vector.h"
#include "calib/result/calibration.h"
#include "calib/uncertainty/nominal_error.h"

namespace cellcal::calib {

/// Mean 3-D error over the poses, ripple and discrepancy in it; 0 for fewer than three.
double foreseen_error_m(const Calibration& c, const std::vector<JointVector>& poses);
/// This arm's with its nominal model; nothing for fewer than three.
NominalError nominal_error_of(const Calibration& c, const std::vector<JointVector>& poses);
/// Poses of the workspace, and near the targets of a calibration in postures like those of the touches.
std::vector<JointVector> stated_workspace(const Calibration& c, int count);
std::vector<JointVector> stated_near_targets(const Calibration& c,
                                             const std::vector<JointVector>& around, int count);

}  // namespace cellcal::calib
