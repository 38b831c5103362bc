#pragma once
// Worker tasks of a session: planning and identification by calib, and the result files.

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calib/check/controller_model.h"
#include "calib/result/drift_chart.h"
#include "daemon/journal/journal.h"
#include "daemon/runner/runner.h"
#include "daemon/tasks/options.h"

namespace cellcal::daemon {

struct ReportInput;

struct TaskInputs {
  calib::Cell cell;
  SessionInputs files;
  SessionOptions options;
  std::vector<calib::Touch> made;             ///< before the session was interrupted
  std::optional<Compared> compared;           ///< calibration that the result is compared with
  std::optional<calib::SearchUnderWay> left;  ///< unfinished search of the previous session
  /// Check only: the checked calibration, and the touches of earlier checks, oldest first.
  std::shared_ptr<const calib::Calibration> against;
  std::vector<std::vector<calib::Touch>> checks_before;
  std::optional<double> axis_reach_rad;  ///< as in Backend
  std::int64_t session = 0;
  std::string started;
  std::filesystem::path results_dir;
  std::function<std::string()> utc_now;
  /// Readings of this session in order, from the journal.
  std::function<std::vector<RecordReading>()> readings;
  /// One line of the session's log.
  std::function<void(const std::string& words)> note;
  /// Stores the calibration in the journal.
  std::function<void(const std::string& json)> store;
  /// Harmless interruptions after which the session continued; null: none.
  std::function<InterruptionCounts()> interruptions;
  /// Checks of the cell's calibrations and its changes so far; null: not known. Called once, for the report.
  std::function<std::optional<calib::DriftChart>()> checks_so_far;
  /// The controller's model of the arm by the postures so far; null: not compared.
  std::function<calib::ControllerModel()> controller_model;
  std::function<std::vector<std::pair<std::string, std::string>>(const calib::Calibration&)> truth;
};

using SharedInputs = std::shared_ptr<const TaskInputs>;

/// Planning, choice and path of touches planned at once or chosen one by one. `planned`: receives the plan, for the
/// report; planning and report are jobs of one worker. `only_find`: ends when all spheres are found.
Tasks touching_tasks(const SharedInputs& inputs,
                     const std::shared_ptr<std::optional<calib::Plan>>& planned,
                     bool only_find = false);
/// Adds the path from the arm's current position to the plan's next touch.
Tasks with_route(Tasks tasks, const SharedInputs& inputs);
/// Compares the controller's model at each touch, and adds its finding to the result.
Tasks with_controller_model(Tasks tasks, const SharedInputs& inputs);

/// All touches of a session with a planned sequence. Throws calib::PlanError.
Tasks::Planned plan_beforehand(const TaskInputs& inputs);

/// Throws calib::PlanError where touches from `next` on exceed the controller's limit around `begin`, the
/// start of its session: the driver would reject them during the session.
void refuse_beyond_reach(const TaskInputs& inputs, const calib::Plan& plan, std::size_t next,
                         const calib::JointVector& begin);

/// Hexadecimal digest of all motion-relevant content of a plan.
std::string plan_hash(const calib::Plan& plan);

// The files of a session: touches, result, report; and the calibration in the journal.

/// `plan`: the executed plan, for the report. Throws where they cannot be written.
void write_results(const TaskInputs& inputs, const calib::Calibration& calibration,
                   const std::vector<calib::Touch>& touches,
                   const std::optional<calib::Plan>& plan);
/// Report of a session whose files were lost, such as by a restored journal: without the plan and earlier checks.
/// The record has a calibration. Throws calib::FileError where it cannot be read.
ReportInput report_from_journal(Journal& journal, const SessionRecord& record);
/// touches.csv and, as `name`, the document of a result that is no calibration. Throws where they cannot be written.
void write_document(const TaskInputs& inputs, const SessionResult& result,
                    const std::vector<calib::Touch>& touches, const char* name);

}  // namespace cellcal::daemon
