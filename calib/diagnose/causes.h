#pragma once
// Which mistake explains a result that is withheld. The mistakes that are made again and again when
// a cell is set up are tried one by one (mistakes.h): if the touches suddenly make sense without
// one, that is the likely cause.

#include <optional>
#include <vector>

#include "calib/diagnose/other_robots.h"
#include "calib/estimate/options.h"
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

}  // namespace cellcal::calib
