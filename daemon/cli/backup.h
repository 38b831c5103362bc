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

/// All .src, .sub and .dat files of a folder or ZIP archive, by their path in it, in order of the paths.
struct Backup {
  std::vector<calib::krl::KrlFile> files;
  std::vector<std::string> others;  ///< paths of those that are no KRL, as options have
  std::vector<std::string> large;   ///< paths of .dat files above the limit of KRL that are no program's
  std::string archive;              ///< a ZIP archive in it; empty: none
};
/// Throws calib::FileError if it cannot be read, has more files than a controller, or two $config.dat, $machine.dat or
/// the like of the arm.
Backup read_backup(const std::filesystem::path& place);

/// True for paths below STEU, which has its own $machine.dat and $config.dat, and for templates of
/// new programs.
bool is_of_the_controllers_side(const std::string& path);

/// True for files of system variables, of the controller's side for $option.dat (KR C2: $ABS_ACCUR), $custom.dat
/// ($DEACTIVATE_ABS_ACCUR) and $machine.dat alone.
bool may_state_accuracy(const std::string& path);

/// $machine.dat, $robcor.dat, $config.dat, $custom.dat and $option.dat of folders, archives and files; of the
/// controller's side what its files state on absolute accuracy alone. Throws calib::FileError as read_backup() does;
/// warns of files of two robots.
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
