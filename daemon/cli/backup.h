#pragma once
// The KRL files of a controller's backup.

#include <filesystem>
#include <string>
#include <vector>

#include "calib/export/krl_text.h"

namespace cellcal::daemon {

/// All .src, .sub and .dat files of a folder or ZIP archive, by their path in it, in order of the paths.
/// Throws calib::FileError for what cannot be read, and for more than a controller holds.
std::vector<calib::krl::KrlFile> read_backup(const std::filesystem::path& place);

/// Of a path, in lower case: "$config.dat".
std::string lower_name(const std::string& path);
/// True below STEU, which has its own $machine.dat and $config.dat.
bool is_of_the_controllers_side(const std::string& path);

/// $machine.dat, $robcor.dat and $config.dat of folders, archives and files. Throws calib::FileError
/// where a place has two of one name.
std::vector<calib::krl::KrlFile> machine_files(const std::vector<std::filesystem::path>& places);

}  // namespace cellcal::daemon
