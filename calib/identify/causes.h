#pragma once
// Which mistake explains a result that is withheld. The mistakes that are made again and again when
// a cell is set up are tried one by one (mistakes.h): if the touches suddenly make sense without
// one, that is the likely cause.

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
  std::optional<MovedTarget> moved = {};  ///< a target, and nothing else
  std::size_t changes = 1;                ///< made at once
};

/// The likeliest first; those that explain the touches about as well as that.
std::vector<Cause> causes_of(const Cell& cell, const std::vector<Touch>& touches,
                             const OtherRobots& other_robots = {});

/// Where a certified length or a size that the cell file states is contradicted: what is wrong. The
/// one of them that all else contradicts most, or another; none where nothing alone mends it.
std::optional<Finding> wrong_measure(const Cell& cell, const std::vector<Touch>& touches,
                                     const IdentifyOptions& options,
                                     const Calibration& calibration);

// One identification of a session as it was, or as it would be without a mistake: how much of it
// makes sense (causes.h). And a quicker look, at the nominal arm alone.

/// What the best arm leaves unexplained: squared sigmas, of touches and of what the files state;
/// and that arm.
struct Trial {
  double sum = std::numeric_limits<double>::infinity();
  int rows = 1;        ///< one for each touch, three of points and trackers
  double worst = 0.0;  ///< of what the files state, one tolerance or certified length
  /// Median of what the touches are off, in what it is of noise as stated.
  double scatter = std::numeric_limits<double>::infinity();
  std::optional<Calibration> found;

  double misfit() const { return sum / rows; }
  /// Beyond one for each row.
  double excess() const { return sum - rows; }
  bool makes_sense() const;
};

/// The calibration as stated; none where the touches lead to none, which explains nothing.
std::optional<Calibration> tried(const Cell& cell, const std::vector<Touch>& touches,
                                 const IdentifyOptions& options);

/// At the fullest level without play; which one it is does not matter for that.
Trial fit_hypothesis(const Cell& cell, const std::vector<Touch>& touches);

/// How far the nominal arm is from meeting the fit touches, each target put where they lie best:
/// median [m]; infinite where they do not say where a target is.
double nominal_off_m(const Cell& cell, const std::vector<Touch>& touches);

}  // namespace cellcal::calib
