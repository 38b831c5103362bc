#include "tests/experiments/program_reasons.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "calib/export/machine_data.h"
#include "calib/files/input_file.h"
#include "calib/model/error.h"
#include "calib/model/linear.h"
#include "daemon/krl/correct_program.h"
#include "daemon/krl/run_time_program.h"
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
    calib::Robot robot = arm_of_controller(data);
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

std::string outcome(const std::vector<daemon::krl::Refusal>& refusals, int corrected) {
  if (!refusals.empty()) return name_of(refusals.front().why);
  return corrected > 0 ? "corrected" : "homes alone";
}

/// By reason: offline, at run time, and for modules that neither way corrects, at run time.
struct Reasons {
  std::map<std::string, int> offline, run_time, neither;
  int modules = 0,
      whole = 0;  ///< with motions to other points than homes; those corrected either way

  void add(const Reasons& other) {
    for (const auto& [reason, number] : other.offline) offline[reason] += number;
    for (const auto& [reason, number] : other.run_time) run_time[reason] += number;
    for (const auto& [reason, number] : other.neither) neither[reason] += number;
    modules += other.modules;
    whole += other.whole;
  }
  void print() const {
    const auto list = [](const char* name, const std::map<std::string, int>& all) {
      fmt::print("  {}\n", name);
      for (const auto& [reason, number] : all) fmt::print("  {:>5}  {}\n", number, reason);
    };
    list("offline", offline);
    list("at run time", run_time);
    if (!neither.empty()) list("neither offline nor at run time", neither);
    if (modules > 0)
      fmt::print("  {} of {} modules ({:.1f} %) corrected whole\n", whole, modules,
                 100.0 * whole / modules);
  }
};

void count(const fs::path& backup, bool verbose, Reasons& reasons) {
  std::string words;
  calib::Cell cell = calib::testing::demo_cell();
  cell.robot = arm_of(backup, words);
  fmt::print("{}: {}\n", backup.filename().string(), words);
  calib::Random random(1);
  daemon::krl::CorrectionOptions options;
  options.anywhere = true;
  const auto files = files_of(backup);
  const auto offline =
      correct_backup(calib::testing::random_calibration(cell, random, 1.0), files, options);
  const auto run_time = rewrite_motions(files, {});
  std::map<std::string, const daemon::krl::RewrittenModule*> rewritten;
  for (const auto& module : run_time.modules) rewritten[module.src] = &module;
  for (const auto& module : offline.modules) {
    const auto found = rewritten.find(module.src);
    if (module.motions == 0 || found == rewritten.end()) continue;  // none, or the controller's own
    const daemon::krl::RewrittenModule& fixed = *found->second;
    const std::string before =
        module.kukas ? "the controller's own" : outcome(module.refusals, module.points);
    const std::string running = outcome(fixed.refusals, fixed.corrected);
    ++reasons.offline[before];
    ++reasons.run_time[running];
    if (running == "homes alone") continue;
    ++reasons.modules;
    if (before == "corrected" || running == "corrected")
      ++reasons.whole;
    else
      ++reasons.neither[running];
    if (running != "corrected" && verbose)
      fmt::print("    {}\n", daemon::krl::words(fixed.refusals.front(), cell.robot));
  }
}

}  // namespace

int print_reasons(const fs::path& folder, bool verbose) {
  Reasons all;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (!entry.is_directory()) continue;
    Reasons reasons;
    try {
      count(entry.path(), verbose, reasons);
    } catch (const calib::FileError& error) {
      fmt::print("  {}\n", error.what());
    }
    reasons.print();
    all.add(reasons);
  }
  fmt::print("all\n");
  all.print();
  return 0;
}

}  // namespace cellcal::experiments
