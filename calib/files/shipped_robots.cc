#include "calib/files/shipped_robots.h"

#include <filesystem>
#include <system_error>

#include "calib/files/files.h"

namespace cellcal::calib {

std::vector<NamedRobot> shipped_robots() {
  std::vector<NamedRobot> robots;
  for (const std::filesystem::path& folder : robots_directories()) {
    std::error_code none;
    for (std::filesystem::directory_iterator at(folder, none), end; !none && at != end;
         at.increment(none)) {
      const auto& entry = *at;
      if (entry.path().extension() != ".toml") continue;
      try {
        robots.push_back({entry.path().stem().string(), load_robot(entry.path())});
      } catch (const FileError&) {
        continue;
      }
    }
    if (!robots.empty()) break;  // the others are the same again
  }
  return robots;
}

}  // namespace cellcal::calib
