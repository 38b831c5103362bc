#pragma once
// How far the arms of one robot model lie from their nominal geometry, learned from many calibrations (calib/priors).
// calib/files/priors_file.h writes it as "cellcal.priors/1".

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "calib/result/names.h"

namespace cellcal::calib {

/// What a joint's errors are grouped by; each group has one spread.
enum class SpreadKind { kLength, kAngle, kCompliance, kGear };
inline constexpr std::array kSpreadKinds{SpreadKind::kLength, SpreadKind::kAngle,
                                         SpreadKind::kCompliance, SpreadKind::kGear};

/// For so many arms, whose errors are seen perfectly and are as far off as the robot file states, its tolerances
/// count.
inline constexpr double kDrawnArms = 4.0;

/// SI units and radians; of gears the amplitude of order 1.
struct Spread {
  double drawn = 0.0;        ///< 1 sigma that the robot file stated, which few arms do not overrule
  double found = 0.0;        ///< 1 sigma of the arms
  double found_sigma = 0.0;  ///< of that
  double arms = 0.0;         ///< so many arms whose errors are seen perfectly tell as much
};

/// What is offered to a cell: the spread found, wider by its own uncertainty; and no narrower than drawn where the
/// arms tell less of it than the robot file counts for, so that what other joints show widens it, but does not narrow
/// it. Bounds that come of a prior too narrow are too small; of one too wide they are only wide.
double offered(const Spread& spread);

struct JointPriors {
  std::string joint;
  std::array<std::optional<Spread>, kSpreadKinds.size()>
      spreads;  ///< by SpreadKind; none: not learned

  std::optional<Spread>& of(SpreadKind kind) { return spreads[static_cast<std::size_t>(kind)]; }
  const std::optional<Spread>& of(SpreadKind kind) const {
    return spreads[static_cast<std::size_t>(kind)];
  }
};

struct FleetPriors {
  long version = 1;              ///< of this model's priors, counted by who makes them
  std::string made;              ///< ISO 8601 UTC
  std::string robot;             ///< model, of the robot file
  std::string nominal_geometry;  ///< SHA-256 (calib/files/robot_file.h)
  int arms = 0;                  ///< behind it
  std::vector<JointPriors> joints;
};

/// Why a calibration has no part in the priors.
enum class SetAsideKind {
  kUnreadable,            ///< no calibration can be read of it
  kWithheld,              ///< it was not published
  kOtherNominalGeometry,  ///< its arm is nominally another
  kInconsistent,  ///< parameters and covariance are not what an estimate from its priors leaves
  kTellsNothing,  ///< its priors decided all of it
  kSameArm,       ///< another calibration of the arm counts
  kTooFar,        ///< as a whole farther from nominal than the other arms' spread allows
  kTooNear        ///< nearer than chance allows
};
inline constexpr std::array kSetAsideKinds{
    Named<SetAsideKind>{SetAsideKind::kUnreadable, "unreadable"},
    Named<SetAsideKind>{SetAsideKind::kWithheld, "withheld"},
    Named<SetAsideKind>{SetAsideKind::kOtherNominalGeometry, "other_drawing"},
    Named<SetAsideKind>{SetAsideKind::kInconsistent, "inconsistent"},
    Named<SetAsideKind>{SetAsideKind::kTellsNothing, "tells_nothing"},
    Named<SetAsideKind>{SetAsideKind::kSameArm, "same_arm"},
    Named<SetAsideKind>{SetAsideKind::kTooFar, "too_far"},
    Named<SetAsideKind>{SetAsideKind::kTooNear, "too_near"}};

struct SetAside {
  std::string name;  ///< the calibration's, as it was given
  SetAsideKind kind = SetAsideKind::kUnreadable;
  std::string other = {};  ///< kSameArm: the calibration that counts; kUnreadable: what is wrong
  double chi2 = 0.0;       ///< kTooFar, kTooNear: of its errors by the arms' spread
  int directions = 0;      ///< likewise: degrees of freedom
};

}  // namespace cellcal::calib
