#pragma once
// Replaces the priors of a robot file by those of its fleet, and lists old and new values.

#include <string>
#include <variant>
#include <vector>

#include "calib/model/robot.h"
#include "calib/result/fleet_priors.h"

namespace cellcal::calib {

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
/// order as an estimate assumes.
std::variant<Accepted, OtherNominalGeometry> accept(const Robot& robot, const FleetPriors& priors);

}  // namespace cellcal::calib
