#pragma once
// "cellcal.calibration/1": self-contained for prediction.

#include <filesystem>
#include <string>
#include <string_view>

#include "calib/result/calibration.h"
#include "calib/result/drift_chart.h"
#include "calib/result/tcp_check.h"
#include "calib/words/phrase.h"

namespace cellcal::calib {

std::string calibration_to_json(const Calibration& calibration);
/// Throws FileError, also if the content does not match its `sum`; files of earlier versions have none.
Calibration calibration_from_json(std::string_view text, const std::string& name);
Calibration load_calibration(const std::filesystem::path& path);
/// True if the document carries a checksum. False for text that is not JSON.
bool states_sum(std::string_view calibration);

/// "0.1.0 (abc1234)".
std::string software_version();

// A check as a document: "cellcal.check/1", millimetres and degrees, with its sentences.

std::string check_to_json(const TcpCheck& check);

// A control chart as a document: "cellcal.drift/1", millimetres, with its sentences.

/// `language`: of its events' words.
std::string drift_to_json(const DriftChart& chart, const Language& language = {});

}  // namespace cellcal::calib
