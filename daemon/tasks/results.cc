#include "daemon/tasks/results.h"

#include <string>

#include "calib/files/calibration_json.h"
#include "calib/files/files.h"
#include "calib/plan/duration.h"
#include "daemon/files/atomic_file.h"
#include "daemon/report/report.h"
#include "daemon/result/outcome_json.h"

namespace cellcal::daemon {

namespace {

std::string finished_time(const std::vector<calib::Touch>& touches, const std::string& now) {
  return touches.empty() || touches.back().time.empty() ? now : touches.back().time;
}

void write_touches(const TaskInputs& inputs, const std::vector<calib::Touch>& touches) {
  std::filesystem::create_directories(inputs.results_dir);
  write_atomically(inputs.results_dir / "touches.csv",
                   calib::format_touches(touches, inputs.cell.robot));
}

}  // namespace

void write_document(const TaskInputs& inputs, const SessionResult& result,
                    const std::vector<calib::Touch>& touches, const char* name) {
  write_touches(inputs, touches);
  write_atomically(inputs.results_dir / name, document_of(result));
}

void write_results(const TaskInputs& inputs, const calib::Calibration& calibration,
                   const std::vector<calib::Touch>& touches,
                   const std::optional<calib::Plan>& plan) {
  const std::string json = calib::calibration_to_json(calibration);

  ReportInput report;
  report.calibration = calibration;
  report.touches = touches;
  report.session_id = std::to_string(inputs.session);
  report.started = inputs.started;
  report.finished = finished_time(touches, inputs.utc_now());
  report.cell_name = std::filesystem::path(inputs.files.cell_name).filename().string();
  report.software = calib::software_version();
  if (const InterruptionCounts counts =
          inputs.interruptions ? inputs.interruptions() : InterruptionCounts{};
      counts.total() > 0)
    report.notes.push_back("interruptions: " + words(counts) +
                           "; each resumed automatically, the touch under way repeated");
  if (calibration.update)
    report.notes.push_back("made on top of " + calibration.update->stands_on +
                           "; 'before' is that calibration, not the nominal arm");
  report.truth = inputs.truth(calibration);
  report.plan = plan;
  if (plan) report.planned_s = calib::duration_s(*plan, inputs.cell.robot, {});

  write_touches(inputs, touches);
  write_atomically(inputs.results_dir / "calibration.json", json);
  write_atomically(inputs.results_dir / "report.html", html_report(report));
  inputs.store(json);
}

}  // namespace cellcal::daemon
