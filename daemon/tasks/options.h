#pragma once
// What a session was asked to do. Stored with it as JSON, so that it can be planned again.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "calib/model/robot.h"
#include "calib/plan/touch_sequence.h"
#include "daemon/journal/journal.h"
#include "daemon/session/touch_policy.h"

namespace cellcal::daemon {

/// What a session is for.
enum class SessionKind {
  kCalibrate,  ///< touches all around, an estimate, a verdict
  kQualify,    ///< few places of one sphere, at several speeds: how good the contacts are
  kCheck,      ///< few touches that tell whether a calibration still holds
  kFind,       ///< touches that tell where the spheres are
  kDryRun      ///< the whole way of a calibration, slowly, without one contact
};
const char* to_string(SessionKind kind);
/// Of the robot file's axis speeds; slower where the configuration says so.
inline constexpr double kDryRunSpeed = 0.1;
/// None: no such kind.
std::optional<SessionKind> session_kind(std::string_view name);

struct SessionOptions {
  SessionKind kind = SessionKind::kCalibrate;
  std::string target;                   ///< kQualify: which sphere; empty: the first
  std::int64_t against = 0;             ///< kCheck: the session whose calibration is checked
  std::optional<double> temperature_c;  ///< kCheck: of the cell, as stated
  calib::PlanOptions plan;
  std::string region = "workspace";  ///< as `cellcal plan --region` takes it
  /// Touches are chosen one by one until the goal is reached; else `plan` is made beforehand.
  bool one_by_one = false;
  calib::Goal goal;
  bool find = false;  ///< all spheres are found by touching first
  /// Few touches on top of the last calibration; one thing may have changed since.
  bool update = false;
  double months = 0.0;         ///< update: since that calibration
  bool accept_change = false;  ///< the arm may be another since its last calibration
  bool emulated = false;       ///< the daemon's own emulated cell: no real arm was touched
  TouchPolicy touch;
};

std::string options_to_json(const SessionOptions& options);
/// Throws std::runtime_error naming the key.
SessionOptions options_from_json(std::string_view json);

// The files of a session: read once at its start, kept as text in the journal, and read from that
// text ever after, so that a session means the same when the files have changed.

/// Reads the cell file and the robot file that it names. Throws calib::FileError.
SessionInputs read_inputs(const std::filesystem::path& cell_file);

/// The cell from stored text. Throws calib::FileError.
calib::Cell cell_of(const SessionInputs& inputs);

}  // namespace cellcal::daemon
