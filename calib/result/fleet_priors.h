#pragma once
// Deviation of the arms of one robot model from their nominal geometry, learned from many calibrations
// (calib/priors). calib/files/priors_file.h writes it as "cellcal.priors/1".

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/enum_table.h"

namespace cellcal::calib {

/// Groups of a joint's errors; each has one spread.
enum class SpreadKind { kLength, kAngle, kCompliance, kGear, kFunction };
inline constexpr auto kSpreadKinds = all_values<SpreadKind>();

/// Weight of the robot file's tolerances, as a number of arms with perfectly known errors as large as stated.
inline constexpr double kDrawnArms = 4.0;

/// SI units and radians; for gears the amplitude of order 1, for functions the rms over a turn.
struct Spread {
  double drawn = 0.0;        ///< 1 sigma stated by the robot file; prevails for few arms
  double found = 0.0;        ///< 1 sigma of the arms
  double found_sigma = 0.0;  ///< 1 sigma of `found`
  double arms = 0.0;         ///< equivalent number of perfectly known arms
};

/// Prior offered to a cell: the spread found, widened by its uncertainty, and not narrower than the stated one if the
/// arms weigh less than the robot file, so that data of other joints can widen but not narrow it. Priors that are too
/// narrow make bounds too small; priors that are too wide only make them wide.
inline double offered(const Spread& spread) {
  if (!(spread.found > 0.0)) return 0.0;
  const double wider = spread.found * std::exp(spread.found_sigma / spread.found);  // (91)
  return spread.arms < kDrawnArms ? std::max(wider, spread.drawn) : wider;
}

struct JointPriors {
  std::string joint;
  std::array<std::optional<Spread>, kSpreadKinds.size()>
      spreads;                      ///< by SpreadKind; empty: not learned
  double function_reach_rad = 0.0;  ///< of the joint's function, if that was learned

  std::optional<Spread>& of(SpreadKind kind) { return spreads[static_cast<std::size_t>(kind)]; }
  const std::optional<Spread>& of(SpreadKind kind) const {
    return spreads[static_cast<std::size_t>(kind)];
  }
};

struct FleetPriors {
  long version = 1;              ///< of this model's priors, counted by their author
  std::string made;              ///< ISO 8601 UTC
  std::string robot;             ///< model, of the robot file
  std::string nominal_geometry;  ///< SHA-256 (calib/files/robot_file.h)
  int arms = 0;                  ///< number of arms used
  std::vector<JointPriors> joints;
};

/// Reason for excluding a calibration from the priors.
enum class SetAsideKind {
  kUnreadable,            ///< not a readable calibration
  kWithheld,              ///< it was not published
  kOtherNominalGeometry,  ///< different nominal geometry
  kInconsistent,          ///< parameters and covariance contradict the stated priors
  kUninformative,         ///< determined by its priors only
  kSameArm,               ///< another calibration of the same arm counts
  kTooFar,                ///< farther from nominal than the other arms' spread allows
  kTooNear                ///< nearer than chance allows
};
/// "other_nominal_geometry"
constexpr const char* to_string(SetAsideKind kind) { return own_name(kind); }

struct SetAside {
  std::string name;  ///< of the calibration, as given
  SetAsideKind kind = SetAsideKind::kUnreadable;
  std::string other = {};  ///< kSameArm: the calibration that counts; kUnreadable: the error
  double chi2 = 0.0;       ///< kTooFar, kTooNear: of its errors under the arms' spread
  int directions = 0;      ///< likewise: degrees of freedom
};

}  // namespace cellcal::calib
