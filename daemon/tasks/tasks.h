#pragma once
// What the worker does for a real session: calib's planning and identification, and the files of
// the result.

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/journal/journal.h"
#include "daemon/runner/runner.h"
#include "daemon/tasks/options.h"

namespace cellcal::daemon {

struct TaskInputs {
  calib::Cell cell;
  SessionInputs files;
  SessionOptions options;
  std::vector<calib::Touch> made;             ///< before the session was interrupted
  std::optional<Compared> compared;           ///< what the result is held against
  std::optional<calib::SearchUnderWay> left;  ///< unfinished, by the session before
  /// Of a check: what is checked, and the touches of those before it, oldest first.
  std::shared_ptr<const calib::Calibration> against;
  std::vector<std::vector<calib::Touch>> checks_before;
  std::optional<double> axis_reach_rad;  ///< as the backend's
  std::int64_t session = 0;
  std::string started;
  std::filesystem::path results_dir;
  std::function<std::string()> utc_now;
  /// Of this session, as they were made; from the journal.
  std::function<std::vector<RecordReading>()> readings;
  /// One line of the session's log.
  std::function<void(const std::string& words)> note;
  /// Puts the calibration into the journal.
  std::function<void(const std::string& json)> store;
  /// Harmless ones after which the session went on by itself; null: none.
  std::function<InterruptionCounts()> interruptions;
  std::function<std::vector<std::pair<std::string, std::string>>(const calib::Calibration&)> truth;
};

Tasks make_tasks(TaskInputs inputs);

/// All touches of a session that does not choose them one by one. Throws calib::PlanError.
Tasks::Planned plan_beforehand(const TaskInputs& inputs);

/// Throws calib::PlanError where touches from `next` on lie farther from `begin`, where the controller's session began,
/// than it allows: the driver would refuse in mid-session.
void refuse_beyond_reach(const TaskInputs& inputs, const calib::Plan& plan, std::size_t next,
                         const calib::JointVector& begin);

/// Hexadecimal digest of everything in a plan that the arm will do.
std::string plan_hash(const calib::Plan& plan);

}  // namespace cellcal::daemon
