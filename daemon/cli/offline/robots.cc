// Which robots a cell file may name.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <system_error>

#include "calib/files/cell_file.h"
#include "calib/files/files.h"
#include "calib/model/units.h"
#include "daemon/cli/offline/exit_status.h"
#include "daemon/cli/offline/offline.h"

namespace cellcal::daemon {

namespace {

struct Listed {
  std::filesystem::path file;
  std::string model;
  std::size_t joints = 0;
  std::optional<double> reach_m;
  std::string wrong;  ///< why it cannot be read; empty: it can
};

/// From the axis of A1 to the wrist centre, the arm stretched, as KUKA's data sheets have it; of arms of that build alone.
std::optional<double> reach_m(const calib::Robot& robot) {
  constexpr std::size_t kAxes = 6;
  if (robot.joints.size() != kAxes) return std::nullopt;
  const auto& j = robot.joints;
  return std::abs(j[0].a_m) + std::abs(j[1].a_m) + std::hypot(j[2].a_m, j[3].d_m);
}

/// By name; of two of one name the one that is found first.
std::map<std::string, Listed> all_robots() {
  std::map<std::string, Listed> robots;
  for (const std::filesystem::path& folder : calib::robots_directories()) {
    std::error_code none;
    for (std::filesystem::directory_iterator at(folder, none), end; !none && at != end;
         at.increment(none)) {
      if (at->path().extension() != ".toml") continue;
      const auto [one, is_new] = robots.try_emplace(at->path().stem().string());
      if (!is_new) continue;
      one->second.file = at->path();
      try {
        const calib::Robot robot = calib::load_robot(at->path());
        one->second.model = robot.name;
        one->second.joints = robot.joints.size();
        one->second.reach_m = reach_m(robot);
      } catch (const calib::FileError& wrong) {
        one->second.wrong = wrong.what();
      }
    }
  }
  return robots;
}

bool is_own(const std::filesystem::path& file) {
  const char* set = std::getenv("CELLCAL_ROBOTS");
  std::error_code none;
  return set != nullptr && *set != '\0' &&
         std::filesystem::equivalent(file.parent_path(), set, none);
}

std::string as_json(const std::map<std::string, Listed>& robots) {
  nlohmann::json list = nlohmann::json::array(), places = nlohmann::json::array();
  for (const auto& [name, one] : robots)
    list.push_back(
        {{"name", name},
         {"model", one.model},
         {"joints", one.joints},
         {"reach_mm",
          one.reach_m ? nlohmann::json(*one.reach_m * calib::kMmPerM) : nlohmann::json(nullptr)},
         {"own", is_own(one.file)},
         {"file", one.file.string()},
         {"error", one.wrong.empty() ? nlohmann::json(nullptr) : nlohmann::json(one.wrong)}});
  for (const auto& folder : calib::robots_directories()) places.push_back(folder.string());
  return nlohmann::json{{"robots", list}, {"looked_for_in", places}}.dump(
             1, ' ', false, nlohmann::json::error_handler_t::replace) +
         "\n";
}

}  // namespace

int robots(const RobotsCommand& command) {
  const std::map<std::string, Listed> all = all_robots();
  if (command.json) {
    put(as_json(all), {});
    return kSuccess;
  }
  std::string text = fmt::format("{:<24}{:<30}{:>6}{:>10}\n", "name", "model", "axes", "reach");
  for (const auto& [name, one] : all) {
    if (!one.wrong.empty()) {
      text += fmt::format("{:<24}cannot be read: {}\n", name, one.wrong);
      continue;
    }
    const std::string reach =
        one.reach_m ? fmt::format("{:.0f} mm", *one.reach_m * calib::kMmPerM) : "-";
    text += fmt::format("{:<24}{:<30}{:>6}{:>10}{}\n", name, one.model, one.joints, reach,
                        is_own(one.file) ? "  own" : "");
  }
  text +=
      "looked for in this order (a folder of your own first: environment variable CELLCAL_ROBOTS):\n";
  for (const auto& folder : calib::robots_directories()) text += "  " + folder.string() + "\n";
  put(text, {});
  return kSuccess;
}

}  // namespace cellcal::daemon
