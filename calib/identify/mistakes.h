#pragma once
// Usual mistakes in the set-up of a cell: the session without each of them, and the finding if that
// session is consistent. The callback `ask` tests the consistency: causes.cc for all mistakes,
// mistakes.cc for those of a contradicted length.

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

/// Finding by the calibration without the mistake; nullopt if it does not confirm the mistake.
using FindingOf = std::function<std::optional<Finding>(const Calibration&)>;

/// A session without one mistake.
struct Hypothesis {
  Cell cell;
  std::vector<Touch> touches;
  FindingOf cause = {};
  /// Requires the nominal arm to be no farther from the touches than before, a fast preliminary
  /// test.
  bool no_farther = false;
  std::optional<MovedTarget> moved = {};  ///< set if the mistake is a moved target
  std::size_t changes = 1;                ///< number of simultaneous changes
};

/// Session as recorded, and the callback that tests a hypothesis.
struct Asked {
  const Cell& cell;
  const std::vector<Touch>& touches;
  std::function<void(const Hypothesis&)> ask;
  std::span<const std::size_t> among = {};  ///< per touch its index among all
  std::span<const Touch> all = {};
  OtherRobots other_robots = {};
  double nominal_off_m = 0.0;                  ///< of the nominal arm from the touches, median
  const LengthResult* contradicted = nullptr;  ///< most contradicted length

  /// Tests the session with a change of the cell file, or of each touch.
  void with_cell(const std::function<void(Cell&)>& change, FindingOf cause) const;
  void with_touches(const std::function<void(Touch&)>& change, FindingOf cause,
                    bool no_farther = false) const;
};

/// Tests all hypotheses of one kind of mistake.
using Mistake = void (*)(const Asked&);

namespace mistakes {

// Recorded or entered data that differ from the measurement.
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
// Artefacts of the cell file.
void diameters(const Asked& asked);
void certified_lengths(const Asked& asked);
void stated_centres(const Asked& asked);
// Contradicted length: itself; whole targets' names; one of its ends, which may have moved since
// its certification; all lengths.
void contradicted_length(const Asked& asked);
void names_by_lengths(const Asked& asked);
void lengths_of_an_end(const Asked& asked);
void all_lengths(const Asked& asked);

}  // namespace mistakes

/// Finding that does not depend on the calibration without the mistake.
inline auto always(Finding finding) {
  return [finding = std::move(finding)](const Calibration&) { return std::optional(finding); };
}

// Touches under a wrong target's name. A few of them are outliers that lie on another target
// (calib/verdict/residuals.h); if all of a target's touches or nearly all touches are affected, the
// positions seen by the nominal arm show it.

/// Permutation of whole targets' names: the actual target of the touches of each target of the
/// cell.
struct Names {
  explicit Names(const Cell& cell);  ///< identity
  std::vector<std::size_t> of;
  std::size_t changed() const;
  std::vector<Touch> given_to(const Cell& cell, std::vector<Touch> touches) const;
  /// kTargetNames
  Finding cause(const Cell& cell) const;
};
/// Permutation for which the positions seen by the nominal arm agree clearly best with certified
/// lengths and stated centres, with the fewest changes among equally good ones. nullopt if there is
/// none, or if the stated names agree as well. For three to seven targets with a centre that their
/// touches determine.
std::optional<Names> better_names(const Cell& cell, const std::vector<Touch>& touches);

/// Maximum number of pairs and targets that are tested in a large cell.
inline constexpr std::size_t kMostPairs = 28, kMostTargets = 12;
/// Calls `ask` with both indices of each pair, up to kMostPairs.
void for_each_pair(std::size_t size, const std::function<void(std::size_t, std::size_t)>& ask);

}  // namespace cellcal::calib
