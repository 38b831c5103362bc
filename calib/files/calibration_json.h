#pragma once
// "cellcal.calibration/1": self-contained for prediction.

#include <filesystem>
#include <string>
#include <string_view>

#include "calib/result/calibration.h"

namespace cellcal::calib {

std::string calibration_to_json(const Calibration& calibration);
/// Throws FileError, also if the content does not match its `sum`; files of earlier versions have none.
Calibration calibration_from_json(std::string_view text, const std::string& name);
Calibration load_calibration(const std::filesystem::path& path);
/// True if the document carries a checksum. False for text that is not JSON.
bool states_sum(std::string_view calibration);

/// "0.1.0 (abc1234)".
std::string software_version();

}  // namespace cellcal::calib
