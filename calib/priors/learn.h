#pragma once
// From what the touches of many arms say to priors for arms of their model.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "calib/result/calibration.h"
#include "calib/result/fleet_priors.h"

namespace cellcal::calib {

// What the touches of one arm say of its errors, the priors that its calibration stood on divided out.

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

/// Fewer arms are no fleet.
inline constexpr int kFewestArms = 3;

enum class NoPriors {
  kTooFewArms,
  kNotOnePopulation  ///< more than a fifth of the arms do not fit with the others
};

struct Learned {
  /// Without version and date, which are the caller's; joints in the robot file's order.
  FleetPriors priors;
  std::optional<NoPriors> none;     ///< why the priors are not to be used: they have no joints then
  std::vector<SetAside> set_aside;  ///< by name
};

/// The nominal geometry that most of these arms have, of the robot file whose tolerances are in the middle of theirs: no few
/// have a say in it. Throws std::invalid_argument where there are none.
Robot commonest_nominal_geometry(const std::vector<ArmEvidence>& arms);

/// Arms of another nominal geometry are set aside.
Learned learn(const Robot& nominal, std::vector<ArmEvidence> arms);

}  // namespace cellcal::calib
