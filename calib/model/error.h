#pragma once
// Exceptions thrown by calib.

#include <cstddef>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

namespace cellcal::calib {

/// An unusable file. The message names the file and, if known, line and key or column, and states
/// the remedy.
struct FileError : std::runtime_error {
  /// The message is the file name directly followed by `rest`: ":12: a_mm: must be a number".
  FileError(std::string about, const std::string& rest)
      : std::runtime_error(about + rest), file(std::move(about)) {}
  /// Error of a value without a known file.
  explicit FileError(const std::string& words) : std::runtime_error(words) {}

  std::string file;  ///< name in messages; empty if unknown
};

/// Touches and cell are well formed but do not determine a calibration (no touches of a target, no
/// touches at all, no convergence).
struct IdentifyError : std::runtime_error {
  /// Classified by remedy.
  enum class Kind {
    kUndetermined,  ///< touches and stated values leave it open: touch more, or state more
    kTouches,       ///< some are unusable for this: leave them out, or make others
    kCell,          ///< cell or robot file contradicts touches or itself: correct it
    kCalibration,   ///< the underlying calibration is not sufficient: choose another
    kOptions,       ///< change the options
    kNotSolved      ///< did not converge: check that files and touches belong to one arm
  };
  IdentifyError(Kind of, const std::string& words) : std::runtime_error(words), kind(of) {}
  IdentifyError(Kind of, std::string about, const std::string& words)
      : std::runtime_error(words), kind(of), target(std::move(about)) {}

  Kind kind;
  std::string target;                ///< id; empty if not specific to one
  std::optional<std::size_t> touch;  ///< index of the given touches, if specific to one
};

/// Not possible yet for an arm on a linear unit. The message names both, and what to do.
struct LinearUnitError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Not possible yet for an arm with a positioner. The message names both, and what to do.
struct PositionerError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// No plan can be made; the message names target, direction and limit.
struct PlanError : std::runtime_error {
  /// Classified by remedy.
  enum class Kind {
    kRequest,      ///< the request has no plan: change it
    kCell,         ///< cell or robot file is incomplete or contradictory: correct it
    kCalibration,  ///< the calibration used for planning is too uncertain: calibrate
    kOutOfReach,   ///< beyond the limits of joints or controller: move the target, or widen them
    kInTheWay,     ///< no clear path: move the target or the obstacle
    kTooFew,       ///< too few feasible touches: plan fewer, or move the targets
    kArmStands,    ///< no clear path from the current position: jog the arm free
    kNotFound,     ///< a sphere was not found: correct its centre or diameter
    kDefect        ///< of the planner: report it
  };
  PlanError(Kind of, const std::string& words) : std::runtime_error(words), kind(of) {}
  PlanError(Kind of, std::string about, const std::string& words)
      : std::runtime_error(words), kind(of), target(std::move(about)) {}

  Kind kind;
  std::string target;  ///< id; empty if not specific to one
  std::string joint;   ///< name, if specific to one
};

}  // namespace cellcal::calib
