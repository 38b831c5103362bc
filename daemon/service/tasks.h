#pragma once
// What the worker does for a real session: calib's planning and identification, and the files of
// the result.

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/journal/journal.h"
#include "daemon/service/options.h"
#include "daemon/runner/runner.h"

namespace cellcal::daemon {

struct TaskInputs {
  calib::Cell cell;
  SessionInputs files;
  SessionOptions options;
  std::vector<calib::Touch> made;        ///< before the session was interrupted
  std::optional<Compared> compared;      ///< what the result is held against
  std::optional<double> axis_reach_rad;  ///< as the backend's
  std::int64_t session = 0;
  std::string started;
  std::filesystem::path results_dir;
  std::function<std::string()> utc_now;
  /// Of this session, as they were made; from the journal.
  std::function<std::vector<RecordReading>()> readings;
  /// Puts the calibration into the journal.
  std::function<void(const std::string& json)> store;
  /// Harmless ones after which the session went on by itself; null: none.
  std::function<int()> interruptions;
  std::function<std::vector<std::pair<std::string, std::string>>(const calib::Calibration&)> truth;
};

Tasks make_tasks(TaskInputs inputs);

/// Hexadecimal digest of everything in a plan that the arm will do.
std::string plan_hash(const calib::Plan& plan);

}  // namespace cellcal::daemon
