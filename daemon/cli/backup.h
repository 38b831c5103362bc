#pragma once
// The KRL files of a controller's backup.

#include <filesystem>
#include <string>
#include <vector>

#include "calib/export/krl_text.h"

namespace cellcal::daemon {

/// All .src, .sub and .dat files of a folder or ZIP archive, by their path in it, in order of the
/// paths. Throws calib::FileError if it cannot be read, or has more files than a controller.
std::vector<calib::krl::KrlFile> read_backup(const std::filesystem::path& place);

/// File name of a path in lower case: "$config.dat".
std::string lower_name(const std::string& path);
/// True for paths below STEU, which has its own $machine.dat and $config.dat.
bool is_of_the_controllers_side(const std::string& path);

/// $machine.dat, $robcor.dat and $config.dat of folders, archives and files. Throws
/// calib::FileError if a place has two of the same name.
std::vector<calib::krl::KrlFile> machine_files(const std::vector<std::filesystem::path>& places);

}  // namespace cellcal::daemon
