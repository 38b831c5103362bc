// cellcal correct --at-run-time and --restore.

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "calib/files/input_file.h"
#include "calib/files/text.h"
#include "calib/model/error.h"
#include "daemon/cli/backup.h"
#include "daemon/cli/commands.h"
#include "daemon/cli/correct.h"
#include "daemon/cli/offline.h"
#include "daemon/files/atomic_file.h"
#include "daemon/krl/fix_lines.h"
#include "daemon/krl/fix_module.h"
#include "daemon/krl/krl_calls.h"
#include "daemon/krl/run_time_program.h"

namespace cellcal::daemon {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using krl::FixModule;
using krl::KrlFile;
using krl::RewrittenModule;
using krl::RewrittenPrograms;

/// Error of the module's REAL of 32 bits, tested (tests/daemon/krl/fix_module_test.cc).
constexpr double kRoundingMm = 0.02;

krl::BackupFiles one_program(const CorrectCommand& command) {
  krl::ProgramFiles files = read_program_files(command.program, command.dat, command.controller);
  std::vector<KrlFile> own = {files.src};
  if (files.dat) own.push_back(*files.dat);
  refuse_corrected(command, {}, own);
  krl::require_routine(files.src);
  krl::BackupFiles all;
  all.controller = std::move(files.controller);
  files.controller.clear();
  all.modules.push_back(std::move(files));
  return all;
}

/// Warnings of called routines that stay uncorrected; none of a backup, which has all modules.
std::vector<calib::Phrase> callees_beside(const CorrectCommand& command,
                                          const krl::BackupFiles& files) {
  if (!command.backup.empty()) return {};
  return uncorrected_callees(files, correction_options(command, nullptr).still);
}

const char* state_of_module(const RewrittenModule& module) {
  if (!module.refusals.empty()) return "refused";
  if (module.corrected > 0) return "corrected";
  return module.motions > 0 ? "left" : "no motion";
}

Json report_json(const RewrittenPrograms& result, const FixModule& fix, int serial,
                 const calib::Robot& robot) {
  Json modules = Json::array(), tools = Json::array();
  for (const RewrittenModule& module : result.modules) {
    Json left = Json::array();
    for (const auto& [name, why] : module.left) left.push_back({{"name", name}, {"why", why}});
    modules.push_back({{"src", module.src},
                       {"state", state_of_module(module)},
                       {"motions", module.motions},
                       {"corrected", module.corrected},
                       {"left", left},
                       {"refusals", refusals_json(module.refusals, robot)}});
    if (module.corrected > 0) modules.back()["load"] = kOwnLoad;
    if (module.corrected > 0 && !module.other_load.empty())
      modules.back()["other_load"] = {{"name", module.other_load},
                                      {"line", module.other_load_line}};
  }
  for (const krl::FixTool& tool : fix.tools)
    tools.push_back({{"xyz_mm", tool.stated.xyz_mm},
                     {"abc_deg", tool.stated.abc_deg},
                     {"of_the_cell", tool.cells}});
  return {{"modules", modules},
          {"written", Json::array()},
          {"fix_module",
           {{"serial", serial},
            {"most_mm", fix.most_mm},
            {"most_deg", fix.most_deg},
            {"rounding_mm", kRoundingMm},
            {"table_mm", fix.table_mm},
            {"tools", tools}}}};
}

calib::Phrase what_of_module(const RewrittenModule& module) {
  if (!module.refusals.empty()) return refused_phrase(module.refusals.size());
  if (module.kukas) return "say.correct.module.kukas";
  return {
      module.other_load.empty() ? "say.correct.module.motions" : "say.correct.module.other_load",
      {{"n", module.corrected},
       {"all", module.motions},
       {"load", module.other_load},
       {"line", module.other_load_line}}};
}

std::string report_words(const RewrittenPrograms& result, const FixModule& fix) {
  std::string text;
  int moving = 0, corrected = 0, motions = 0;
  std::map<std::string, std::string> left;
  for (const RewrittenModule& module : result.modules) {
    if (module.motions == 0) continue;
    ++moving;
    text += module_line(state_of_module(module), module.src, what_of_module(module));
    if (!module.refusals.empty()) continue;
    left.insert(module.left.begin(), module.left.end());
    corrected += module.corrected > 0 ? 1 : 0;
    motions += module.corrected;
  }
  for (const auto& [name, why] : left)
    text += said({"say.correct.left", {{"name", calib::shown(name)}, {"why", why}}});
  const auto cells = std::ranges::count_if(fix.tools, &krl::FixTool::cells);
  const calib::Phrase lines[] = {
      {"say.correct.run_time.sum", {{"n", corrected}, {"all", moving}, {"motions", motions}}},
      {"say.correct.run_time.within", {{"mm", kRoundingMm}, {"table", fix.table_mm}}},
      {"say.correct.run_time.holds", {{"mm", fix.most_mm}, {"deg", fix.most_deg}}},
      {cells > 1 ? "say.correct.run_time.tools.both" : "say.correct.run_time.tools",
       {{"n", std::ssize(fix.tools) - cells}}}};
  for (const calib::Phrase& line : lines) text += said(line);
  return text;
}

/// The modules' folder: R1/Program of a backup.
fs::path folder_of_module(const CorrectCommand& command, const RewrittenPrograms& result) {
  if (command.backup.empty()) return {};
  for (const KrlFile& file : result.files) {
    fs::path folder;
    for (const fs::path& part : fs::path(file.name).parent_path()) {
      folder /= part;
      if (calib::krl::lower_name(part.string()) == "program") return folder;
    }
  }
  return {};
}

FixModule module_for(const CorrectCommand& command, const calib::Calibration& calibration,
                     const std::vector<KrlFile>& controller) {
  if (command.serial <= 0)
    throw calib::FileError("--at-run-time needs --serial, the robot's $KR_SERIALNO");
  if (!calibration.verdict.workspace && !command.anywhere)
    throw calib::FileError(
        command.calibration.string(),
        ": holds near its targets only, which the running program cannot know. --anywhere corrects "
        "everywhere, with its u95");
  krl::Data data;
  for (const KrlFile& file : controller) read_data(file, data);
  return fix_module(
      calibration, data,
      {command.serial, calib::sha256(calib::read_file(command.calibration)), command.anywhere});
}

}  // namespace

int correct_at_run_time(const CorrectCommand& command, const calib::Calibration& calibration) {
  Backup backup;
  if (!command.backup.empty()) backup = read_backup(command.backup);
  const krl::BackupFiles files =
      command.backup.empty() ? one_program(command) : programs_of(command, backup);
  const FixModule fix = module_for(command, calibration, files.controller);
  const calib::Robot& robot = calibration.cell.robot;
  const RewrittenPrograms result = rewrite_motions(
      files, correction_options(command, nullptr).leave, krl::external_names(robot));
  Json report = report_json(result, fix, command.serial, robot);
  krl::Corrected unread;
  unread.left = files_left(backup);
  unread.robroot_stated = true;  // read while it runs
  report["left"] = left_json(unread.left);
  report["warnings"] = warned(callees_beside(command, files), command, robot, {});
  std::vector<KrlFile> read, module;
  for (const krl::ProgramFiles& one : files.modules) read.push_back(one.src);
  const fs::path folder = folder_of_module(command, result);
  for (const KrlFile* file : {&fix.src, &fix.dat})
    module.push_back({(folder / file->name).string(), file->text});
  const std::string written = write_corrected(command, read, result.files, module, report);
  std::string text = stated_words(unread) + report_words(result, fix) + written;
  if (written.empty() && !result.files.empty()) text += said("say.correct.run_time.not_written");
  put(command.json ? json_text(report) : text, {});
  const auto moving = refusals_of_moving(result.modules);
  const int status = print_refused_modules(moving, robot, true);
  if (!result.files.empty() || moving.empty()) return status;
  return status == kSuccess ? kNotPublishable : kJobFailed;
}

int restore_program(const CorrectCommand& command) {
  const KrlFile src{command.restore.string(),
                    calib::read_file(command.restore, krl::kMostBytes + 1)};
  const std::string text = krl::restored(src);
  if (command.output.empty()) throw calib::FileError("--restore needs -o FOLDER");
  const fs::path place = command.output / command.restore.filename();
  refuse_to_replace(command, place);
  fs::create_directories(command.output);
  write_atomically(place, text);
  put(said({"say.correct.restored", {{"file", place.string()}}}), {});
  return kSuccess;
}

}  // namespace cellcal::daemon
