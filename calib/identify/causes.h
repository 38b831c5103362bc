#pragma once
// Diagnosis of a withheld result: the usual set-up mistakes (mistakes.h) are tried one by one; one
// without which the touches are consistent is the likely cause.

#include <limits>
#include <optional>
#include <vector>

#include "calib/estimate/options.h"
#include "calib/identify/identify.h"
#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

struct Cause {
  double misfit;
  Finding finding;                        ///< of kind kLikelyCause
  std::optional<MovedTarget> moved = {};  ///< set if the mistake is a moved target
  std::size_t changes = 1;                ///< number of simultaneous changes
};

/// Causes, likeliest first, that explain the touches about as well as the first.
std::vector<Cause> causes_of(const Cell& cell, const std::vector<Touch>& touches,
                             const OtherRobots& other_robots = {});

/// Cause of a contradicted certified length or stated size: the most contradicted one, or another
/// mistake; nullopt if no single mistake explains it.
std::optional<Finding> wrong_measure(const Cell& cell, const std::vector<Touch>& touches,
                                     const IdentifyOptions& options,
                                     const Calibration& calibration);

/// Finding on targets whose touches, seen by the nominal arm, are too far apart for one target,
/// with at most half of them together (kScatteredTouches); nullopt if there are none.
std::optional<Finding> scattered_touches(const Cell& cell, const std::vector<Touch>& touches);

// Single identification of a session as recorded or without a mistake, with its consistency
// (causes.h), and a faster check by the nominal arm alone.

/// Misfit of the best arm, in squared sigmas, by touches and by values stated in the files; and
/// that arm.
struct Trial {
  double sum = std::numeric_limits<double>::infinity();
  int rows = 1;        ///< one per touch, three for points and trackers
  double worst = 0.0;  ///< largest of a single tolerance or certified length
  bool torn = false;   ///< most touches of a target are far off
  /// Median residual of the touches over that of the stated noise.
  double scatter = std::numeric_limits<double>::infinity();
  std::optional<Calibration> found;

  double misfit() const { return sum / rows; }
  /// Misfit beyond one per row.
  double excess() const { return sum - rows; }
  bool makes_sense() const;
};

/// Calibration by identified_or_why_not(); nullopt if there is none.
std::optional<Calibration> tried(const Cell& cell, const std::vector<Touch>& touches,
                                 const IdentifyOptions& options, bool richer = false);

/// Trial at the fullest level without play; the level does not matter for this purpose.
Trial fit_hypothesis(const Cell& cell, const std::vector<Touch>& touches);

/// Median distance [m] of the nominal arm's tips from the fit touches, each target placed to fit
/// its touches; infinite if the touches do not determine the place of a target.
double nominal_off_m(const Cell& cell, const std::vector<Touch>& touches);

}  // namespace cellcal::calib
