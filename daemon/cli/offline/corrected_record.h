#pragma once
// WELD.corrected.json beside a corrected WELD.src: what was changed, by which calibration. Whoever corrects a
// program twice sends the arm as far to the other side, and the program itself carries no mark.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "daemon/krl/correct_program.h"

namespace cellcal::daemon {

std::filesystem::path record_beside(std::filesystem::path src);

/// Throws calib::FileError where the record beside the program says that `files` are what a correction wrote, and where
/// it cannot be read: nobody knows then.
void refuse_corrected(const krl::ProgramFiles& files);

/// The report with the SHA-256 of each file as it was read and as it was written.
nlohmann::json corrected_record(nlohmann::json report, const krl::ProgramFiles& read,
                                const std::vector<krl::KrlFile>& written);

}  // namespace cellcal::daemon
