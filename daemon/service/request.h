#pragma once
// What a session is asked for, and whether that can be asked at all: looked at before anything is read.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>

#include "daemon/tasks/options.h"

namespace cellcal::daemon {

/// A session is under way.
struct BusyError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The request cannot be carried out as it stands: wrong file, nothing to resume.
struct RequestError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

inline constexpr int kPlannedTouches = 50, kMostChosen = 200;

struct RunRequest {
  SessionKind kind = SessionKind::kCalibrate;
  std::string target;  ///< of a qualification; empty: the cell's first sphere
  /// Of a check: the session of the calibration; none: the newest that is published, of `cell` where that is given.
  std::optional<std::int64_t> calibration;
  std::optional<double> temperature_c;  ///< of a check: of the cell, degrees Celsius
  std::filesystem::path cell;           ///< absolute; empty only when resuming or checking
  std::optional<int> fit_touches;       ///< none: kPlannedTouches, or at most kMostChosen of a goal
  int check_touches = 10;
  /// u95 in mm, mean over the region: touches are chosen one by one until it is reached.
  std::optional<double> goal_mm;
  std::string region = "workspace";
  bool find = false;    ///< spheres are found by touching first; those without a centre always are
  bool update = false;  ///< few touches on top of the last calibration of that cell file
  bool accept_change = false;  ///< publish though the arm changed since its last calibration
  unsigned seed = 1;
  bool resume = false;
  /// Who begins it where nobody is there; stands in its events. Empty: a person.
  std::string unattended;
  /// Only if nobody has aborted since SessionService::aborts() said this.
  std::optional<std::uint64_t> unless_aborted;
};

/// Throws RequestError.
void check(const RunRequest& request);

}  // namespace cellcal::daemon
