#pragma once
// Calibration report: one self-contained HTML file for those who rely on, use or reject a calibration. No
// script and no external resource, so that it remains readable for years.

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "calib/model/touch.h"
#include "calib/plan/plan.h"
#include "calib/result/calibration.h"

namespace cellcal::daemon {

/// Content of the report. All strings are UTF-8, may come from users' files, and are escaped. Empty strings
/// and sets are omitted or reported as missing, never an error.
struct ReportInput {
  calib::Calibration calibration;
  /// As measured, in order; Calibration::residuals and ::outliers index into it.
  std::vector<calib::Touch> touches;
  std::string session_id;
  std::string started;   ///< ISO 8601
  std::string finished;  ///< ISO 8601
  std::string cell_name;
  std::string software;             ///< e.g. calib::software_version()
  std::vector<std::string> notes;   ///< remarks of the operator on the conditions, one line each
  std::optional<calib::Plan> plan;  ///< where the touches were planned
  double planned_s = 0.0;           ///< predicted robot time [s]; 0: unknown
  /// Simulated cells only: name and deviation from the hidden truth, labelled as such.
  std::vector<std::pair<std::string, std::string>> truth;
};

/// The complete document, UTF-8. Never throws for invalid input: a non-finite number is shown as a dash and
/// counted in the text.
std::string html_report(const ReportInput& input);

}  // namespace cellcal::daemon
