#pragma once
// The mistakes that are made again and again when a cell is set up: how the session would read
// without each, and which one it is then. Whether the touches make sense so is asked by who goes
// through them: causes.cc through all, mistakes.cc through those of a contradicted length.

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "calib/identify/identify.h"
#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// The mistake, by the calibration without it; none where it is none after all.
using FindingOf = std::function<std::optional<Finding>(const Calibration&)>;

/// A session without one mistake.
struct Hypothesis {
  Cell cell;
  std::vector<Touch> touches;
  FindingOf cause = {};
  /// The nominal arm is to be no farther from the touches so, which is quickly asked.
  bool no_farther = false;
  std::optional<MovedTarget> moved = {};  ///< a target, and nothing else
  std::size_t changes = 1;                ///< made at once
};

/// The session as it was, and who asks whether the touches make sense without a mistake.
struct Asked {
  const Cell& cell;
  const std::vector<Touch>& touches;
  std::function<void(const Hypothesis&)> ask;
  std::span<const std::size_t> among = {};  ///< of each touch its index among all
  OtherRobots other_robots = {};
  double nominal_off_m = 0.0;                  ///< of the nominal arm from the touches
  const LengthResult* contradicted = nullptr;  ///< the length that all else contradicts most

  /// With what the files state changed, or each touch.
  void with_cell(const std::function<void(Cell&)>& change, FindingOf cause) const;
  void with_touches(const std::function<void(Touch&)>& change, FindingOf cause,
                    bool no_farther = false) const;
};

/// Asks for all that one kind of mistake may have been.
using Mistake = void (*)(const Asked&);

namespace mistakes {

// What was read or written otherwise than it was made.
void radians(const Asked& asked);
void axis_signs(const Asked& asked);
void mastering(const Asked& asked);
void exchanged_columns(const Asked& asked);
void target_names(const Asked& asked);
void readings(const Asked& asked);
void moved(const Asked& asked);
// The geometry of arm and tool.
void tool_unit(const Asked& asked);
void tool_tip(const Asked& asked);
void dimensions(const Asked& asked);
void other_robot(const Asked& asked);
void axis_convention(const Asked& asked);
void gravity(const Asked& asked);
// What the cell file states of its artefacts.
void diameters(const Asked& asked);
void certified_lengths(const Asked& asked);
void stated_centres(const Asked& asked);
// Of a contradicted length: it itself; whole targets' names; one of its ends, which may stand
// elsewhere than when it was measured; all lengths.
void contradicted_length(const Asked& asked);
void names_by_lengths(const Asked& asked);
void lengths_of_an_end(const Asked& asked);
void all_lengths(const Asked& asked);

}  // namespace mistakes

/// A mistake that is the same whatever the calibration without it.
inline auto always(Finding finding) {
  return [finding = std::move(finding)](const Calibration&) { return std::optional(finding); };
}

/// Of the many pairs and targets of a large cell so many are asked.
inline constexpr std::size_t kMostPairs = 28, kMostTargets = 12;
/// Both indices of each pair, up to the most.
void for_each_pair(std::size_t size, const std::function<void(std::size_t, std::size_t)>& ask);

}  // namespace cellcal::calib
