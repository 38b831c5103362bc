#pragma once
// A robot file's priors replaced by its fleet's, each old and new value named.

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
         after = 0.0;  ///< SI, radians; before 0: the file states none, and it was assumed
};

struct Accepted {
  Robot robot;
  std::vector<PriorChange> changes;
};

/// The priors are of another nominal geometry.
struct OtherNominalGeometry {
  std::string priors, robot;  ///< SHA-256
};

/// The robot with what is offered: tolerances where it allows that error at all; compliance where the file states it; the
/// amplitude of gears where it names their orders, or of all joints where it names none (orders 1 to 4, each the smaller the
/// higher, as an estimate assumes them).
std::variant<Accepted, OtherNominalGeometry> accept(const Robot& robot, const FleetPriors& priors);

}  // namespace cellcal::calib
