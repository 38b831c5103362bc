#pragma once
// The mistakes that are made again and again when a cell is set up: how the session would read
// without each, and which one it is then. Whether the touches make sense so is asked in causes.cc.

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "calib/diagnose/other_robots.h"
#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// A session without one mistake.
struct Hypothesis {
  Cell cell;
  std::vector<Touch> touches;
  /// The mistake, by the calibration without it; none where it is none after all.
  std::function<std::optional<Finding>(const Calibration&)> cause = {};
  /// The nominal arm is to be no farther from the touches so, which is quickly asked.
  bool no_farther = false;
  std::optional<MovedTarget> moved = {};  ///< a target, and nothing else
  std::size_t changes = 1;                ///< made at once
};

/// The session as it was.
struct Asked {
  const Cell& cell;
  const std::vector<Touch>& touches;
  const std::vector<std::size_t>& among;  ///< of each touch its index among all
  const OtherRobots& other_robots;
  double nominal_off_m = 0.0;  ///< of the nominal arm from the touches
};

using Ask = std::function<void(const Hypothesis&)>;
/// Asks for all that one kind of mistake may have been.
using Mistake = void (*)(const Asked&, const Ask&);

std::span<const Mistake> mistakes_of_touches();
std::span<const Mistake> mistakes_of_files();

/// Of the many pairs and targets of a large cell so many are asked.
inline constexpr std::size_t kMostPairs = 28, kMostTargets = 12;
/// Both indices of each pair, up to the most.
void for_each_pair(std::size_t size, const std::function<void(std::size_t, std::size_t)>& ask);

}  // namespace cellcal::calib
