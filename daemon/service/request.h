#pragma once
// Request for a session, and its validation before any file is read.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "daemon/runner/backend.h"
#include "daemon/session/state.h"
#include "daemon/tasks/options.h"

namespace cellcal::daemon {

/// A session is under way.
struct BusyError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The request cannot be carried out: wrong file, or nothing to resume.
struct RequestError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

inline constexpr int kPlannedTouches = 50, kMostChosen = 200;

struct RunRequest {
  SessionKind kind = SessionKind::kCalibrate;
  std::string target;  ///< of a qualification; empty: the first sphere of the cell
  /// Session of the calibration to check; none: the newest published one (of `cell` where given).
  std::optional<std::int64_t> calibration;
  std::optional<double> temperature_c;  ///< of a check: cell temperature [deg C]
  std::vector<std::string> mastered;  ///< of a check: joints that were mastered anew by the calibration
  std::string load;                     ///< held in all touches: id in the cell file; empty: none
  std::filesystem::path cell;           ///< absolute; empty only when resuming or checking
  std::optional<int> fit_touches;  ///< none: kPlannedTouches, or at most kMostChosen with a goal
  int check_touches = 10;
  /// Target u95 [mm], mean over the region: touches are chosen one by one until it is reached.
  std::optional<double> goal_mm;
  std::string region = "workspace";
  /// Locate the spheres by touching first; implied for spheres without a centre.
  bool find = false;
  bool update = false;         ///< a few touches on top of the last calibration of that cell file
  bool accept_change = false;  ///< publish although the arm has changed since its last calibration
  unsigned seed = 1;
  bool resume = false;
  /// Originator of an unattended session, recorded in its events. Empty: a person.
  std::string unattended;
  /// Starts only if SessionService::aborts() still returns this value.
  std::optional<std::uint64_t> unless_aborted;
};

/// Throws RequestError.
void check(const RunRequest& request);

// Settings that a session takes from the configuration when it begins.

struct SessionSettings {
  TouchPolicy touch;
  Timeouts timeouts;
  int retries = 0;  ///< automatic continuations after harmless interruptions
  /// Limits of the current link: a resumed session keeps its own touch policy.
  SearchLimits search_limits{};
  BusyRepeats repeats{};        ///< after lateness of this computer; also of today's configuration
  double speed_fraction = 1.0;  ///< share of the robot file's axis speeds in transits
  double hand_speed_m_s = 0.0;  ///< HandSpeed::Bound; 0: none
  double positioner_speed_rad_s = 0.0;  ///< likewise; 0: the controller bounds it
};

/// `most_speed`: upper bound of the share of the robot file's axis speeds, whatever the configuration allows.
/// `load`: held by the emulated tools.
using MakeBackend = std::function<std::unique_ptr<Backend>(const calib::Cell&, double most_speed,
                                                           const std::string& load)>;

}  // namespace cellcal::daemon
