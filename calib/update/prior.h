#pragma once
// What the last calibration says before any new touch is made, and how a change of one thing moves its
// parameters.

#include <Eigen/Core>
#include <optional>

#include "calib/check/change.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// What creeps in a month without anybody doing anything, 1 sigma; it grows with the root of the time.
struct DriftPerMonth {
  double zero_rad = 5e-6;   ///< of each joint: belts, bearings
  double tip_m = 10e-6;     ///< of each component of the tool's tip: wear, its seat
  double centre_m = 10e-6;  ///< of each component of a sphere's centre: stands, glue
};

/// The last calibration with the tool's tip among its parameters, which the cell file may have taken for known,
/// and with that drift in its covariance. Throws IdentifyError where it states none.
Calibration with_drift(const Calibration& last, double months, const DriftPerMonth& drift = {});

/// What one SI unit of each component of the change does to the parameters, a column each. Empty where the
/// calibration has no parameter for it: its tolerance is 0.
std::optional<Eigen::MatrixXd> moved_by(const PossibleChange& change, const Calibration& c);

}  // namespace cellcal::calib
