#include "tests/experiments/program_reasons.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "calib/export/machine_data.h"
#include "calib/files/input_file.h"
#include "calib/model/error.h"
#include "calib/model/linear.h"
#include "daemon/krl/correct_program.h"
#include "tests/calib/random_calibration.h"
#include "tests/calib/simulate.h"

namespace cellcal::experiments {

namespace {

namespace fs = std::filesystem;
using daemon::krl::KrlFile;

std::string lower(std::string text) {
  for (char& c : text) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return text;
}

/// Of one ending, or of one name.
std::vector<fs::path> files_below(const fs::path& folder, const std::string& ending) {
  std::vector<fs::path> all;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file() && lower(entry.path().filename().string()).ends_with(ending))
      all.push_back(entry.path());
  std::sort(all.begin(), all.end());
  return all;
}

bool of_the_other_side(const fs::path& path) {
  return lower(path.string()).find("/steu/") != std::string::npos;
}

KrlFile read(const fs::path& path) { return {path.string(), calib::read_file(path)}; }

/// The arm of the controller's machine data, or where they are not there the demo cell's.
calib::Robot arm_of(const fs::path& backup, std::string& words) {
  calib::MachineData data;
  try {
    for (const char* name : {"$machine.dat", "$robcor.dat"})
      for (const fs::path& one : files_below(backup, name))
        if (!of_the_other_side(one)) read_machine_data(calib::read_file(one), one.string(), data);
    calib::Robot robot = robot_of(data);
    for (calib::Joint& joint : robot.joints) {
      joint.tolerance_length_m = 0.7e-3;
      joint.tolerance_angle_rad = 6e-4;
    }
    words = robot.name;
    return robot;
  } catch (const calib::FileError& error) {
    words = std::string("demo cell's arm: ") + error.what();
    return calib::testing::demo_cell().robot;
  }
}

daemon::krl::BackupFiles files_of(const fs::path& backup) {
  daemon::krl::BackupFiles files;
  std::map<std::string, std::size_t> by_stem;
  const auto stem = [](const fs::path& path) {
    return lower((path.parent_path() / path.stem()).string());
  };
  for (const fs::path& one : files_below(backup, ".src")) {
    if (of_the_other_side(one)) continue;
    by_stem.emplace(stem(one), files.modules.size());
    files.modules.push_back({read(one), {}, {}, {}});
  }
  for (const fs::path& one : files_below(backup, ".dat")) {
    const std::string name = lower(one.filename().string());
    if (of_the_other_side(one) ||
        (name.starts_with("$") && name != "$config.dat" && name != "$machine.dat"))
      continue;
    const auto module = by_stem.find(stem(one));
    if (name == "$config.dat" || name == "$machine.dat")
      files.controller.push_back(read(one));
    else if (module == by_stem.end())
      files.data.push_back(read(one));
    else
      files.modules[module->second].dat = read(one);
  }
  return files;
}

std::string outcome(const daemon::krl::CorrectedModule& module) {
  if (!module.refusals.empty()) return name_of(module.refusals.front().why);
  if (module.kukas) return "the controller's own";
  return module.points > 0 ? "corrected" : "homes alone";
}

/// All kinds of refusal of a module: one mended reason often uncovers the next.
std::string kinds_of(const daemon::krl::CorrectedModule& module) {
  std::set<std::string> kinds;
  for (const auto& one : module.refusals) kinds.insert(name_of(one.why));
  return fmt::format("{}", fmt::join(kinds, "+"));
}

void count(const fs::path& backup, bool verbose, std::map<std::string, int>& reasons) {
  std::string words;
  calib::Cell cell = calib::testing::demo_cell();
  cell.robot = arm_of(backup, words);
  fmt::print("{}: {}\n", backup.filename().string(), words);
  calib::Random random(1);
  daemon::krl::CorrectionOptions options;
  options.anywhere = true;
  const auto result = correct_backup(calib::testing::random_calibration(cell, random, 1.0),
                                     files_of(backup), options);
  for (const auto& module : result.modules) {
    if (module.motions == 0) continue;
    ++reasons[outcome(module)];
    if (!module.refusals.empty() && verbose)
      fmt::print("    {}: {}\n", kinds_of(module),
                 daemon::krl::words(module.refusals.front(), cell.robot));
  }
}

}  // namespace

int print_reasons(const fs::path& folder, bool verbose) {
  std::map<std::string, int> all;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (!entry.is_directory()) continue;
    std::map<std::string, int> reasons;
    try {
      count(entry.path(), verbose, reasons);
    } catch (const calib::FileError& error) {
      fmt::print("  {}\n", error.what());
    }
    for (const auto& [reason, number] : reasons) {
      fmt::print("  {:>5}  {}\n", number, reason);
      all[reason] += number;
    }
  }
  fmt::print("all\n");
  for (const auto& [reason, number] : all) fmt::print("  {:>5}  {}\n", number, reason);
  return 0;
}

}  // namespace cellcal::experiments
