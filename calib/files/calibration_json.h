#pragma once
// "cellcal.calibration/1": everything that predict needs is inside.

#include <filesystem>
#include <string>
#include <string_view>

#include "calib/result/calibration.h"

namespace cellcal::calib {

std::string calibration_to_json(const Calibration& calibration);
/// Throws FileError, also where the content is not that of its `sum`; files of earlier versions have none.
Calibration calibration_from_json(std::string_view text, const std::string& name);
Calibration load_calibration(const std::filesystem::path& path);
/// Whether a changed value in it would show. Of text that is no JSON: no.
bool states_sum(std::string_view calibration);

/// "0.1.0 (abc1234)".
std::string software_version();

}  // namespace cellcal::calib
