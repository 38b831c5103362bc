#include "daemon/cli/backup.h"

#include <algorithm>
#include <map>
#include <set>

#include "calib/files/input_file.h"
#include "calib/model/error.h"
#include "daemon/cli/zip_file.h"

namespace cellcal::daemon {

namespace {

namespace fs = std::filesystem;
using calib::krl::KrlFile;

constexpr std::size_t kMostBackupFiles = 10000, kMostBackupBytes = 256u << 20;

std::string in_lower_case(std::string text) {
  for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return text;
}

bool is_krl(std::string_view path) {
  const std::string name = in_lower_case(std::string(path));
  return name.ends_with(".src") || name.ends_with(".dat") || name.ends_with(".sub");
}

std::vector<KrlFile> read_folder(const fs::path& folder) {
  std::vector<KrlFile> files;
  std::size_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!is_krl(entry.path().string()) || !entry.is_regular_file()) continue;
    files.push_back({fs::relative(entry.path(), folder).string(),
                     calib::read_file(entry.path(), calib::krl::kMostBytes + 1)});
    bytes += files.back().text.size();
    if (files.size() > kMostBackupFiles || bytes > kMostBackupBytes)
      throw calib::FileError(folder.string(), ": more than 10000 KRL files, or 256 MB of them");
  }
  return files;
}

std::vector<KrlFile> read_zip(const fs::path& path) {
  std::vector<KrlFile> files;
  for (ZippedFile& one :
       unzip(calib::read_file(path, kMostBackupBytes), path.string(), is_krl, kMostBackupBytes))
    files.push_back({std::move(one.path), std::move(one.text)});
  return files;
}

}  // namespace

std::string lower_name(const std::string& path) {
  const auto slash = path.find_last_of("/\\");
  return in_lower_case(slash == std::string::npos ? path : path.substr(slash + 1));
}

bool is_of_the_controllers_side(const std::string& path) {
  const std::string all = "/" + in_lower_case(path);
  return all.find("/steu/") != std::string::npos || all.find("\\steu\\") != std::string::npos;
}

std::vector<KrlFile> read_backup(const fs::path& place) {
  auto files = fs::is_directory(place) ? read_folder(place) : read_zip(place);
  std::sort(files.begin(), files.end(),
            [](const KrlFile& a, const KrlFile& b) { return a.name < b.name; });
  return files;
}

std::vector<KrlFile> machine_files(const std::vector<fs::path>& places) {
  static const std::set<std::string> names = {"$machine.dat", "$robcor.dat", "$config.dat"};
  std::vector<KrlFile> all;
  for (const fs::path& place : places) {
    const bool archive = lower_name(place.string()).ends_with(".zip");
    if (!archive && !fs::is_directory(place)) {
      all.push_back({place.string(), calib::read_file(place)});
      continue;
    }
    std::map<std::string, std::string> seen;
    for (KrlFile& file : read_backup(place)) {
      if (names.count(lower_name(file.name)) == 0 || is_of_the_controllers_side(file.name))
        continue;
      const auto [first, fresh] = seen.emplace(lower_name(file.name), file.name);
      if (!fresh)
        throw calib::FileError(place.string(), ": both " + first->second + " and " + file.name +
                                                   ". Name the files of one robot");
      all.push_back(std::move(file));
    }
    if (seen.empty())
      throw calib::FileError(place.string(), ": no $machine.dat, $robcor.dat or $config.dat in it");
  }
  return all;
}

}  // namespace cellcal::daemon
