// cellcal correct --backup: all programs of a controller together.

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "calib/files/input_file.h"
#include "calib/files/text.h"
#include "calib/model/error.h"
#include "daemon/cli/backup.h"
#include "daemon/cli/commands.h"
#include "daemon/cli/correct.h"
#include "daemon/cli/offline.h"

namespace cellcal::daemon {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using krl::CorrectedBackup;
using krl::CorrectedModule;
using krl::KrlFile;

std::string stem_path(const std::string& path) { return path.substr(0, path.find_last_of('.')); }

const char* state_of(const CorrectedModule& module) {
  if (!module.refusals.empty()) return "refused";
  if (module.points > 0) return "corrected";
  return module.motions > 0 ? "left" : "no motion";
}

/// Follows the module's name.
calib::Phrase what_of(const CorrectedModule& module, const calib::Robot& robot) {
  // Those of modules that move follow on standard error.
  if (!module.refusals.empty() && module.motions == 0)
    return {"say.correct.module.why", {{"why", phrase(module.refusals.front(), robot)}}};
  if (!module.refusals.empty()) return refused_phrase(module.refusals.size());
  if (module.points > 0) return {"say.correct.module.points", {{"n", module.points}}};
  return module.kukas ? "say.correct.module.kukas" : "say.correct.module.stays";
}

Json module_json(const CorrectedModule& module, const calib::Robot& robot) {
  Json one = {{"src", module.src},
              {"state", state_of(module)},
              {"motions", module.motions},
              {"points", module.points},
              {"refusals", refusals_json(module.refusals, robot)}};
  for (const krl::ToolUsed& tool : module.tools) {
    one["loads"].push_back(tool_json(tool));
    one["loads"].back()["tool"] = tool.number;
  }
  return one;
}

struct Counts {
  int corrected = 0, moving = 0;
};
Counts counts_of(const CorrectedBackup& result) {
  Counts counts;
  for (const CorrectedModule& module : result.modules) {
    counts.moving += module.motions > 0 ? 1 : 0;
    counts.corrected += module.points > 0 ? 1 : 0;
  }
  return counts;
}

std::string report(const CorrectedBackup& result, const calib::Robot& robot) {
  std::string text;
  for (const char* state : {"corrected", "left", "refused"})
    for (const CorrectedModule& module : result.modules)
      if (state == std::string(state_of(module)))
        text += module_line(state, module.src, what_of(module, robot));
  text += stated_words(result);
  const Counts counts = counts_of(result);
  return text +
         said(
             {"say.correct.backup.sum",
              {{"n", counts.corrected}, {"all", counts.moving}, {"points", result.points.size()}}});
}

Json backup_json(const CorrectedBackup& result, const calib::Robot& robot) {
  Json all = {{"modules", Json::array()},
              {"points", Json::array()},
              {"left", left_json(result.left)},
              {"written", Json::array()},
              {"robroot_stated", result.robroot_stated}};
  for (const CorrectedModule& module : result.modules)
    all["modules"].push_back(module_json(module, robot));
  for (const krl::CorrectedPoint& point : result.points) all["points"].push_back(point_json(point));
  return all;
}

}  // namespace

krl::BackupFiles modules_of(std::vector<KrlFile> files) {
  krl::BackupFiles all;
  std::map<std::string, std::size_t> by_stem;
  std::vector<KrlFile> data;
  for (KrlFile& file : files) {
    const std::string name = calib::krl::lower_name(file.name);
    if (is_of_the_controllers_side(file.name)) continue;
    if (name == "$config.dat" || name == "$machine.dat") {
      all.controller.push_back(std::move(file));
    } else if (name.ends_with(".src") || name.ends_with(".sub")) {
      by_stem.emplace(calib::krl::lower_case(stem_path(file.name)), all.modules.size());
      all.modules.push_back({std::move(file), {}, {}, {}});
    } else if (name.ends_with(".dat") && !name.starts_with("$")) {
      data.push_back(std::move(file));
    }
  }
  for (KrlFile& file : data) {
    const auto module = by_stem.find(calib::krl::lower_case(stem_path(file.name)));
    if (module == by_stem.end())
      all.data.push_back(std::move(file));
    else
      all.modules[module->second].dat = std::move(file);
  }
  return all;
}

krl::BackupFiles programs_of(const CorrectCommand& command, Backup& backup) {
  const std::vector<KrlFile> given = controller_files(command);
  refuse_corrected(command, command.backup, backup.files);
  refuse_corrected(command, {}, given);
  krl::BackupFiles all = modules_of(backup.files);
  if (all.modules.empty())
    throw calib::FileError(
        command.backup.string(),
        ": no KRL program (.src) in it" +
            (backup.archive.empty() ? "" : ". Unpack " + backup.archive + " and give that"));
  for (const KrlFile& file : given) {
    if (std::ranges::find(backup.files, file.text, &KrlFile::text) != backup.files.end()) continue;
    all.controller.push_back(file);
    backup.files.push_back(file);
  }
  return all;
}

std::vector<krl::LeftPoint> files_left(const Backup& backup) {
  std::vector<krl::LeftPoint> left;
  for (const std::string& file : backup.others) left.push_back({file, "no readable KRL"});
  for (const std::string& file : backup.large) left.push_back({file, "above 16 MB"});
  return left;
}

int correct_backup_files(const CorrectCommand& command, const calib::Calibration& calibration,
                         const calib::Calibration* from) {
  Backup backup = read_backup(command.backup);
  const krl::BackupFiles programs = programs_of(command, backup);
  CorrectedBackup result = correct_backup(calibration, programs, correction_options(command, from));
  for (krl::LeftPoint& file : files_left(backup)) result.left.push_back(std::move(file));
  const calib::Robot& robot = calibration.cell.robot;
  Json all = backup_json(result, robot);
  all["warnings"] = warned(result.warnings, command, robot, result.points);
  const std::string written = write_corrected(command, backup.files, result.files, {}, all);
  std::string text = report(result, robot) + written;
  if (written.empty() && !result.files.empty()) text += said("say.correct.backup.not_written");
  put(command.json ? json_text(all) : text, {});
  const int status = print_refused_modules(refusals_of_moving(result.modules), robot);
  const Counts counts = counts_of(result);
  if (counts.moving == 0 || counts.corrected > 0) return status;
  fmt::print(stderr, "{}\n", say({"say.correct.backup.none", {{"n", counts.moving}}}));
  return kNotPublishable;
}

}  // namespace cellcal::daemon
