#include <dlfcn.h>

#include <array>
#include <cstdlib>
#include <system_error>
#include <utility>

#include "calib/files/files.h"
#include "calib/files/robot_place.h"
#include "calib/syntax/shown.h"

namespace cellcal::calib {
namespace {

/// The file that this code is in: the shared library, else the program.
std::filesystem::path own_file() {
  std::error_code none;
  Dl_info info{};
  static const int here = 0;
  if (dladdr(&here, &info) != 0 && info.dli_fname != nullptr) {
    // Of the program itself this is what it was called by, which leads nowhere from another folder.
    const std::filesystem::path file = info.dli_fname;
    if (file.is_absolute() && file.string().find(".so") != std::string::npos) return file;
  }
  return std::filesystem::read_symlink("/proc/self/exe", none);
}

bool holds_robots(const std::filesystem::path& folder) {
  std::error_code none;
  for (std::filesystem::directory_iterator at(folder, none), end; !none && at != end;
       at.increment(none)) {
    if (at->path().extension() == ".toml") return true;
  }
  return false;
}

std::string nowhere_of(const std::string& name) { return "no robot file \"" + shown(name) + "\""; }

std::string list_of(const std::vector<std::filesystem::path>& places) {
  constexpr std::size_t kShownPath = 300;
  std::string list;
  for (const auto& path : places) list += "\n  " + shown(path.string(), kShownPath);
  return list;
}

}  // namespace

std::vector<std::filesystem::path> robots_directories() {
  std::vector<std::filesystem::path> result;
  if (const char* set = std::getenv("CELLCAL_ROBOTS"); set != nullptr && *set != '\0')
    result.emplace_back(set);
  const std::array<std::filesystem::path, 2> places = {"share/cellcal/robots", "calib/robots"};
  const std::filesystem::path file = own_file();
  for (auto folder = file.parent_path(); folder.has_relative_path(); folder = folder.parent_path()) {
    for (const auto& place : places) {
      if (holds_robots(folder / place)) result.push_back(folder / place);
    }
  }
  const std::filesystem::path usual = "/usr/share/cellcal/robots";
  if (result.empty() || result.back() != usual) result.push_back(usual);
  return result;
}

UnknownRobot::UnknownRobot(std::string asked_for, std::vector<std::filesystem::path> places)
    : FileError(nowhere_of(asked_for) + "; looked for" + list_of(places)),
      name(std::move(asked_for)),
      looked_for(std::move(places)) {}

std::string UnknownRobot::nowhere() const { return nowhere_of(name); }

std::filesystem::path find_robot_file(const std::string& name,
                                      const std::filesystem::path& folder) {
  const std::filesystem::path given(name);
  std::vector<std::filesystem::path> tried{folder / given};  // an absolute path stays absolute
  for (const auto& directory : robots_directories()) {
    tried.push_back(directory / given);
    if (given.extension() != ".toml") tried.push_back(directory / (name + ".toml"));
  }
  for (const auto& path : tried) {
    std::error_code ignored;  // "cannot look" counts as "not there"; the message lists the place
    if (std::filesystem::is_regular_file(path, ignored)) return path;
  }
  throw UnknownRobot(name, std::move(tried));
}

}  // namespace cellcal::calib
