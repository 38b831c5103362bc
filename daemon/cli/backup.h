#pragma once
// The KRL files of a controller's backup.

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "calib/export/krl_text.h"
#include "calib/export/machine_data.h"

namespace cellcal::daemon {

/// All .src, .sub and .dat files of a folder or ZIP archive, by their path in it, in order of the
/// paths; without .dat files of options that are no KRL, whose paths go to `others`. Throws calib::FileError if it
/// cannot be read, or has more files than a controller.
std::vector<calib::krl::KrlFile> read_backup(const std::filesystem::path& place,
                                             std::vector<std::string>* others = nullptr);

/// True for paths below STEU, which has its own $machine.dat and $config.dat, and for templates of
/// new programs.
bool is_of_the_controllers_side(const std::string& path);

/// True for files of system variables, of the controller's side for $option.dat (KR C2: $ABS_ACCUR), $custom.dat
/// ($DEACTIVATE_ABS_ACCUR) and $machine.dat alone.
bool may_state_accuracy(const std::string& path);

/// $machine.dat, $robcor.dat, $config.dat, $custom.dat and $option.dat of folders, archives and files; of the
/// controller's side what its files state on absolute accuracy alone. Throws calib::FileError if a place has two of the
/// same name; warns of files of two robots.
calib::MachineData read_machine_files(const std::vector<std::filesystem::path>& places);

// Files out of a ZIP archive.

struct ZippedFile {
  std::string path, text;
};

/// Files whose path, with '/', is wanted. Throws calib::FileError with `name` for archives and files that are damaged,
/// encrypted, of an unsupported method, or larger than `most_bytes` in all.
std::vector<ZippedFile> unzip(std::string_view archive, const std::string& name,
                              const std::function<bool(std::string_view)>& wanted,
                              std::size_t most_bytes);

}  // namespace cellcal::daemon
