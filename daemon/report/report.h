#pragma once
// The calibration report: one self-contained HTML file for the people who have to trust, use or
// refuse a calibration. No script, no external resource; it reads the same in ten years.

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "calib/model/touch.h"
#include "calib/plan/plan.h"
#include "calib/result/calibration.h"

namespace cellcal::daemon {

/// Everything that the report shows. All strings are UTF-8 and may come from users' files; they
/// are escaped. Empty strings and sets are left out or named as missing, never an error.
struct ReportInput {
  calib::Calibration calibration;
  /// As measured, in order; Calibration::residuals and ::outliers index into it.
  std::vector<calib::Touch> touches;
  std::string session_id;
  std::string started;   ///< ISO 8601
  std::string finished;  ///< ISO 8601
  std::string cell_name;
  std::string software;             ///< e.g. calib::software_version()
  std::vector<std::string> notes;   ///< conditions in the operator's words, one line each
  std::optional<calib::Plan> plan;  ///< where the touches were planned
  double planned_s = 0.0;           ///< robot time that it foresaw; 0: not known
  /// Simulated cells only: figure and value against the hidden truth, shown as such.
  std::vector<std::pair<std::string, std::string>> truth;
};

/// The whole document, UTF-8, from "<!doctype html>" to the last newline. Never throws for what
/// the input says: a number that is not finite is shown as a dash and counted in words.
std::string html_report(const ReportInput& input);

}  // namespace cellcal::daemon
