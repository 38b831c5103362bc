#pragma once
// "cellcal.calibration/1": everything that predict needs is inside.

#include <filesystem>
#include <string>

#include "calib/result/calibration.h"

namespace cellcal::calib {

std::string calibration_to_json(const Calibration& calibration);
/// Throws FileError.
Calibration calibration_from_json(std::string_view text, const std::string& name);
Calibration load_calibration(const std::filesystem::path& path);

/// "0.1.0 (abc1234)".
std::string software_version();

}  // namespace cellcal::calib
