#pragma once
// What the touches of one arm say of its errors, the priors that its calibration stood on divided out.

#include <Eigen/Core>
#include <string>
#include <variant>
#include <vector>

#include "calib/result/calibration.h"
#include "calib/result/fleet_priors.h"

namespace cellcal::calib {

/// rows * (errors [SI]) + N(0, 1) = values.
struct ArmEvidence {
  std::string name;  ///< of the calibration: its file
  std::string arm;   ///< which arm it is, as far as known; empty: not known
  std::string time;  ///< ISO 8601 UTC; empty: not known
  bool update = false;
  Robot robot;
  std::string nominal_geometry;    ///< nominal_geometry_sha256()
  std::vector<ParameterKey> keys;  ///< of the errors
  Eigen::MatrixXd rows;
  Eigen::VectorXd values;
};

/// Or why it has no part.
std::variant<ArmEvidence, SetAsideKind> evidence_of(const Calibration& calibration);

}  // namespace cellcal::calib
