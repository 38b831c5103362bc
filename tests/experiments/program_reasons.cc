#include "tests/experiments/program_reasons.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "calib/files/input_file.h"
#include "calib/model/error.h"
#include "calib/model/random.h"
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

KrlFile read(const fs::path& path) { return {path.string(), calib::read_file(path)}; }

bool has_motions(const KrlFile& file) {
  static const std::set<std::string> motions = {"PTP",     "LIN",     "CIRC",    "SPTP",
                                                "SLIN",    "SCIRC",   "SPL",     "PTP_REL",
                                                "LIN_REL", "CIRC_REL"};
  const auto lines = daemon::krl::read_lines(file);
  return std::any_of(lines.begin(), lines.end(), [](const auto& line) {
    return line.tokens.size() > 1 && motions.count(line.tokens[0].word) > 0;
  });
}

std::string outcome(const calib::Calibration& calibration, const fs::path& src,
                    const std::vector<KrlFile>& controller,
                    const std::vector<KrlFile>& modules) {
  daemon::krl::ProgramFiles files;
  files.src = read(src);
  for (const auto& entry : fs::directory_iterator(src.parent_path()))
    if (lower(entry.path().filename().string()) == lower(src.stem().string()) + ".dat")
      files.dat = read(entry.path());
  files.controller = controller;
  for (const KrlFile& one : modules)
    if (one.name != files.src.name) files.modules.push_back(one);
  daemon::krl::CorrectionOptions options;
  options.anywhere = true;
  const auto result = correct_program(calibration, files, options);
  if (!result.refusals.empty()) return name_of(result.refusals.front().why);
  return result.points.empty() ? "nothing to correct" : "corrected";
}

void count(const fs::path& backup, std::map<std::string, int>& reasons) {
  calib::Random random(1);
  const calib::Calibration calibration =
      calib::testing::random_calibration(calib::testing::demo_cell(), random, 1.0);
  std::vector<KrlFile> controller;
  for (const fs::path& one : files_below(backup, "$config.dat"))
    if (lower(one.string()).find("steu") == std::string::npos) controller.push_back(read(one));
  std::vector<KrlFile> modules;
  for (const fs::path& src : files_below(backup, ".src")) modules.push_back(read(src));
  for (const KrlFile& src : modules) {
    try {
      if (has_motions(src)) ++reasons[outcome(calibration, src.name, controller, modules)];
    } catch (const std::exception& error) {
      ++reasons["unreadable"];
      fmt::print(stderr, "{}\n", error.what());
    }
  }
}

}  // namespace

int print_reasons(const fs::path& folder) {
  std::map<std::string, int> all;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (!entry.is_directory()) continue;
    std::map<std::string, int> reasons;
    count(entry.path(), reasons);
    fmt::print("{}\n", entry.path().filename().string());
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
