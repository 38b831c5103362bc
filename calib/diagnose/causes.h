#pragma once
// The mistakes that are made again and again when a cell is set up, tried one by one: if the
// touches suddenly make sense with it mended, that is the likely cause
// (calib/identify/likely_causes.h).

#include <optional>
#include <vector>

#include "calib/diagnose/other_robots.h"
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

}  // namespace cellcal::calib
