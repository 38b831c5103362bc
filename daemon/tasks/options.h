#pragma once
// Options of a session: as requested, and as stored with it as JSON, so that it can be planned again.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "calib/model/enum_table.h"
#include "calib/model/robot.h"
#include "calib/plan/touch_sequence.h"
#include "calib/result/calibration.h"
#include "daemon/journal/journal.h"
#include "daemon/result/contact_delay.h"
#include "daemon/session/touch_policy.h"

namespace cellcal::daemon {

/// Purpose of a session.
enum class SessionKind {
  kCalibrate,  ///< touches of all targets, an estimate, a verdict
  kQualify,    ///< a few places of one sphere at several speeds: quality of the contacts
  kCheck,      ///< a few touches that test whether a calibration still holds
  kFind,       ///< touches that locate the spheres
  kDryRun      ///< the complete path of a calibration, slowly, without contact
};
/// "dry-run"
constexpr const char* to_string(SessionKind kind) { return own_name<'-'>(kind); }
/// None: unknown kind.
constexpr std::optional<SessionKind> session_kind(std::string_view name) {
  return by_own_name<SessionKind, '-'>(name);
}

inline constexpr int kMostChosen = 200;

/// Request for a session.
struct RunRequest {
  SessionKind kind = SessionKind::kCalibrate;
  std::string target;  ///< of a qualification; empty: the first sphere of the cell
  /// Session of the calibration to check; none: the newest published one (of `cell` where given).
  std::optional<std::int64_t> calibration;
  std::optional<double> temperature_c;  ///< of a check: cell temperature [deg C]
  std::vector<std::string> mastered;    ///< of a check: joints mastered anew by the calibration
  std::string load;                     ///< held in all touches: id in the cell file; empty: none
  std::filesystem::path cell;           ///< absolute; empty only when resuming or checking
  std::optional<int> fit_touches;       ///< none: kUsualTouches, or at most kMostChosen with a goal
  int check_touches = calib::kUsualChecks;
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

/// Keys of the body of POST /v1/run, in both directions: `visit` is called with each key and its member.
template <typename Request, typename Visitor>
void each_run_key(Request& request, Visitor visit) {
  visit("cell", request.cell);
  visit("kind", request.kind);
  visit("target", request.target);
  visit("calibration", request.calibration);
  visit("mastered", request.mastered);
  visit("temperature_c", request.temperature_c);
  visit("load", request.load);
  visit("touches", request.fit_touches);
  visit("goal_mm", request.goal_mm);
  visit("region", request.region);
  visit("find", request.find);
  visit("update", request.update);
  visit("accept_change", request.accept_change);
  visit("check", request.check_touches);
  visit("seed", request.seed);
  visit("resume", request.resume);
}

struct SessionOptions {
  SessionKind kind = SessionKind::kCalibrate;
  std::string target;                   ///< kQualify: the sphere; empty: the first
  std::int64_t against = 0;             ///< kCheck: session of the checked calibration
  std::optional<double> temperature_c;  ///< kCheck: stated temperature of the cell
  std::vector<std::string> mastered;  ///< kCheck: joints mastered by the calibration's zeros since
  calib::PlanOptions plan;
  std::string region = "workspace";  ///< as in `cellcal plan --region`
  std::string load;                  ///< held in all touches: id in the cell file; empty: none
  /// Touches are chosen one by one until the goal is reached; otherwise planned beforehand.
  bool one_by_one = false;
  calib::Goal goal;
  bool find = false;  ///< all spheres are located by touching first
  /// A few touches on top of the last calibration, assuming a single change since.
  bool update = false;
  double months = 0.0;         ///< update: age of that calibration
  bool accept_change = false;  ///< the arm may have been exchanged since its last calibration
  bool emulated = false;       ///< the daemon's own emulated cell: no real arm was touched
  TouchPolicy touch;
};

std::string options_to_json(const SessionOptions& options);
/// Throws std::runtime_error naming the key.
SessionOptions options_from_json(std::string_view json);
/// None for a damaged row, or one of another version.
std::optional<SessionOptions> options_in(const SessionInputs& inputs);

// Input files of a session: read once at its start, stored as text in the journal, and read from that text
// afterwards, so that later changes of the files have no effect on the session.

/// Reads the cell file and its robot file. Throws calib::FileError.
SessionInputs read_inputs(const std::filesystem::path& cell_file);

/// The cell from stored text. Throws calib::FileError.
calib::Cell cell_of(const SessionInputs& inputs);

// Latch delay of each session from its recorded readings, compared with the previous one.

/// Throws JournalError.
std::optional<ContactDelay> delay_of(Journal& journal, std::int64_t session);
/// From the newest earlier session with the same robot file that has one. Throws JournalError.
std::optional<ContactDelay> delay_before(Journal& journal, std::int64_t session);
/// Records the delay, and its faults, in the session's events and in the log. Never throws.
void watch_delay(Journal& journal, std::int64_t session, const std::string& utc);

// Computes a session's result from its records: identical to the bit with the same version.

/// Identifies, judges the result against the earlier one, and records its basis. Throws calib::IdentifyError,
/// calib::FileError (an unreadable earlier one).
calib::Calibration estimate(const calib::Cell& cell, const SessionInputs& inputs,
                            const std::vector<calib::Touch>& touches,
                            const std::optional<Compared>& compared);

/// The same for an update, based on the calibration `last`. `not_found`: targets with a touch without
/// contact.
calib::Calibration estimate_update(const SessionInputs& inputs,
                                   const std::vector<calib::Touch>& touches, const Compared& last,
                                   double months, const std::vector<std::string>& not_found);

}  // namespace cellcal::daemon
