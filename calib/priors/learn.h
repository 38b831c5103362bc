#pragma once
// Learns priors for a robot model from the calibrations of many arms.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "calib/model/robot.h"
#include "calib/result/calibration.h"
#include "calib/result/fleet_priors.h"

namespace cellcal::calib {

// Evidence of one arm's touches on its errors, with the priors of its calibration divided out.

/// Size of a joint's function by the touches: rms over a turn; of an arm without functions the
/// ripple that represents them.
struct FunctionSize {
  double size_rad = 0.0, reach_rad = 0.0;  ///< reach 0: the touches showed no function
};

/// rows * (errors [SI]) + N(0, 1) = values.
struct ArmEvidence {
  std::string name;  ///< of the calibration: its file
  std::string arm;   ///< identity of the arm; empty: unknown
  std::string time;  ///< ISO 8601 UTC; empty: unknown
  bool update = false;
  Robot robot;
  std::string nominal_geometry;    ///< nominal_geometry_sha256()
  std::vector<ParameterKey> keys;  ///< of the errors
  Eigen::MatrixXd rows;
  Eigen::VectorXd values;
  std::vector<FunctionSize> functions;  ///< per joint
};

/// Or the reason for setting the calibration aside.
std::variant<ArmEvidence, SetAsideKind> evidence_of(const Calibration& calibration);

/// Minimum number of arms.
inline constexpr int kFewestArms = 3;

enum class NoPriors {
  kTooFewArms,
  kNotOnePopulation  ///< more than a fifth of the arms are outliers
};

struct Learned {
  /// Without version and date, which the caller sets; joints in the robot file's order.
  FleetPriors priors;
  std::optional<NoPriors> none;     ///< set if the priors are unusable; they have no joints then
  std::vector<SetAside> set_aside;  ///< by name
};

/// The most frequent nominal geometry of these arms, from the robot file with the median tolerances, so that few files
/// cannot influence it. Throws std::invalid_argument if there are none.
Robot commonest_nominal_geometry(const std::vector<ArmEvidence>& arms);

/// Arms of another nominal geometry are set aside.
Learned learn(const Robot& nominal, std::vector<ArmEvidence> arms);

// Replaces the priors of a robot file by those of its fleet, and lists old and new values.

/// One prior sigma of the robot file.
struct PriorChange {
  std::string joint;
  SpreadKind kind = SpreadKind::kLength;
  double before = 0.0,
         after = 0.0;  ///< SI, radians; before 0: assumed, not in the file
};

struct Accepted {
  Robot robot;
  std::vector<PriorChange> changes;
};

/// The priors are of a different nominal geometry.
struct OtherNominalGeometry {
  std::string priors, robot;  ///< SHA-256
};

/// The robot with the priors offered: tolerances for errors that it allows; compliance if the file states it; gear
/// amplitudes for the orders that it names, or for orders 1 to 4 of all joints if it names none, decreasing with the
/// order as an estimate assumes; the joints' functions with their reach, at all angles.
std::variant<Accepted, OtherNominalGeometry> accept(const Robot& robot, const FleetPriors& priors);

}  // namespace cellcal::calib
