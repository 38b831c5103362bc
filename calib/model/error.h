#pragma once
// What calib throws.

#include <cstddef>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

namespace cellcal::calib {

/// A file that cannot be used. The message names the file and, where they exist, line and key or
/// column, and says what to do.
struct FileError : std::runtime_error {
  /// The message is the file's name and, right behind it, `rest`: ":12: a_mm: must be a number".
  FileError(std::string about, const std::string& rest)
      : std::runtime_error(about + rest), file(std::move(about)) {}
  /// About a value that stands in no file, or in one that is not known here.
  explicit FileError(const std::string& words) : std::runtime_error(words) {}

  std::string file;  ///< as messages name it; empty: none is known
};

/// Touches and cell are well formed but do not determine a calibration (no touches of a target,
/// no touches at all, a solver that did not converge).
struct IdentifyError : std::runtime_error {
  /// By what can be done about it.
  enum class Kind {
    kUndetermined,  ///< the touches and what is stated leave it open: touch more, or state more
    kTouches,       ///< some cannot be used for this: leave them out, or make others
    kCell,          ///< cell or robot file contradicts touches or itself: correct it
    kCalibration,   ///< the one that it stands on does not carry it: take another
    kOptions,       ///< ask otherwise
    kNotSolved      ///< the computation led nowhere: are these files and touches of one arm?
  };
  IdentifyError(Kind of, const std::string& words) : std::runtime_error(words), kind(of) {}
  IdentifyError(Kind of, std::string about, const std::string& words)
      : std::runtime_error(words), kind(of), target(std::move(about)) {}

  Kind kind;
  std::string target;                ///< id; empty: it is about none
  std::optional<std::size_t> touch;  ///< index among those given, where it is about one
};

/// No plan can be made; the message names target, direction and limit.
struct PlanError : std::runtime_error {
  /// By what can be done about it.
  enum class Kind {
    kRequest,      ///< no plan is what was asked for: ask otherwise
    kCell,         ///< cell or robot file states too little or what cannot be: correct it
    kCalibration,  ///< the one to plan with knows too little: calibrate
    kOutOfReach,   ///< beyond the limits of joints or controller: move the target, or widen them
    kInTheWay,     ///< no clear way: move the target or what is in the way
    kTooFew,       ///< touches that can be made: plan fewer, or move the targets
    kArmStands,    ///< where no way begins: jog it free
    kNotFound,     ///< a sphere is not where it was sought: correct its place or diameter
    kDefect        ///< of the planner: report it
  };
  PlanError(Kind of, const std::string& words) : std::runtime_error(words), kind(of) {}
  PlanError(Kind of, std::string about, const std::string& words)
      : std::runtime_error(words), kind(of), target(std::move(about)) {}

  Kind kind;
  std::string target;  ///< id; empty: it is about none
  std::string joint;   ///< name, where it is about one
};

}  // namespace cellcal::calib
