#include "tests/experiments/program_reasons.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "calib/export/machine_data.h"
#include "calib/model/error.h"
#include "calib/model/linear.h"
#include "daemon/cli/backup.h"
#include "daemon/cli/correct.h"
#include "daemon/krl/correct_program.h"
#include "daemon/krl/run_time_program.h"
#include "tests/calib/random_calibration.h"
#include "tests/calib/simulate.h"

namespace cellcal::experiments {

namespace {

namespace fs = std::filesystem;

/// The arm of the controller's machine data; without them the demo cell's.
calib::Robot arm_of(const fs::path& backup, std::string& words) {
  try {
    calib::Robot robot = arm_of_controller(daemon::read_machine_files({backup}));
    words = robot.name;
    return robot;
  } catch (const calib::FileError& error) {
    words = std::string("demo cell's arm: ") + error.what();
    return calib::testing::demo_cell().robot;
  }
}

std::string outcome(const std::vector<daemon::krl::Refusal>& refusals, int corrected) {
  if (!refusals.empty()) return name_of(refusals.front().why);
  return corrected > 0 ? "corrected" : "homes alone";
}

/// By reason: offline, at run time, and at run time for modules that are not corrected either way.
struct Reasons {
  std::map<std::string, int> offline, run_time, neither;
  int modules = 0,
      whole = 0;  ///< with motions to points other than homes; those corrected either way

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
  const auto files = daemon::modules_of(daemon::read_backup(backup).files);
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
