#include "daemon/cli/correct.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <tuple>

#include "calib/export/corrector.h"
#include "calib/export/machine_data.h"
#include "calib/files/input_file.h"
#include "calib/files/text.h"
#include "calib/model/error.h"
#include "calib/model/units.h"
#include "calib/result/finding_phrase.h"
#include "daemon/cli/commands.h"
#include "daemon/cli/controller_data.h"
#include "daemon/cli/offline.h"

namespace cellcal::daemon {

namespace {

namespace fs = std::filesystem;
using krl::CorrectedPoint;
using krl::CorrectedProgram;
using krl::KrlFile;

KrlFile read(const fs::path& path) {
  return {path.string(), calib::read_file(path, krl::kMostBytes + 1)};
}

/// weld.dat for weld.src, WELD.DAT for WELD.SRC; empty if it does not exist.
fs::path dat_beside(fs::path src) {
  for (const char* ending : {".dat", ".DAT", ".Dat"})
    if (fs::exists(src.replace_extension(ending))) return src;
  return {};
}

/// The submit interpreter's programs (.sub), too.
bool is_src(const fs::path& path) {
  const std::string ending = calib::krl::lower_case(path.extension().string());
  return ending == ".src" || ending == ".sub";
}

/// Other programs of the folder, which may contain called routines. Empty if there are more than a
/// controller has.
std::vector<KrlFile> modules_beside(const fs::path& program) {
  constexpr std::size_t kMostFiles = 1000;
  std::vector<fs::path> paths;
  std::error_code none;
  const fs::path folder = program.has_parent_path() ? program.parent_path() : fs::path(".");
  for (const auto& entry : fs::directory_iterator(folder, none))
    if (is_src(entry.path()) && entry.is_regular_file(none) &&
        !fs::equivalent(entry.path(), program, none))
      paths.push_back(entry.path());
  if (paths.size() > kMostFiles) paths.clear();
  std::sort(paths.begin(), paths.end());
  std::vector<KrlFile> all;
  for (const fs::path& path : paths) try {
      all.push_back(read(path));
    } catch (const calib::FileError&) {  // unreadable: its routines remain unknown
    }
  return all;
}

/// TOOL_DATA[n] or BASE_DATA[n]; below 0: written out in the program.
std::string frame_words(int number) {
  return fmt::format("{:>6}", number < 0 ? say("say.correct.text") : std::to_string(number));
}

std::string point_words(const CorrectedPoint& p) {
  return say(
      {p.status_changed ? "say.correct.point.status" : "say.correct.point",
       {{"name", fmt::format("{:<16}", p.name)},
        {"line", p.line},
        {"tool", frame_words(p.tool)},
        {"base", p.axes ? fmt::format("{:>6}", say("say.correct.axes")) : frame_words(p.base)},
        {"x", p.shift_mm.x()},
        {"y", p.shift_mm.y()},
        {"z", p.shift_mm.z()},
        {"shift", p.shift_mm.norm()},
        {"turn", p.turn_deg},
        {"u95", p.u95_mm}}});
}

calib::Phrase name_of_tool(int number) {
  return number < 0 ? calib::Phrase("say.correct.tool.text")
                    : calib::Phrase("say.correct.tool", {{"n", number}});
}

std::string tool_words(const krl::ToolUsed& tool) {
  const calib::Phrase tool_name = name_of_tool(tool.number);
  const calib::Phrase name = tool.cells && tool.other_load()
                                 ? calib::Phrase("say.correct.tool.and_load",
                                                 {{"tool", tool_name}, {"load", load_name(tool)}})
                                 : tool_name;
  return said({tool.cells        ? "say.correct.tool.cells"
               : tool.load_known ? "say.correct.tool.load"
                                 : "say.correct.tool.no_load",
               {{"tool", name}, {"load", tool.load_name.empty() ? "LOAD_DATA" : tool.load_name}}});
}

/// Largest u95 of each tool's points.
std::string bounds_words(const std::vector<CorrectedPoint>& points) {
  std::map<int, std::pair<int, double>> bounds;
  for (const CorrectedPoint& point : points) {
    auto& [count, u95_mm] = bounds[point.tool];
    ++count;
    u95_mm = std::max(u95_mm, point.u95_mm);
  }
  std::string text;
  for (const auto& [tool, bound] : bounds)
    text += said({"say.correct.tool.u95",
                  {{"mm", bound.second}, {"n", bound.first}, {"tool", name_of_tool(tool)}}});
  return text;
}

std::string report(const CorrectedProgram& result, const std::string& written) {
  std::string text = said("say.correct.head");
  for (const CorrectedPoint& p : result.points) text += point_words(p) + "\n";
  text += stated_words(result);
  const CorrectedPoint* largest = result.largest();
  text += said(largest == nullptr
                   ? calib::Phrase("say.correct.no_point")
                   : calib::Phrase("say.correct.largest", {{"n", result.points.size()},
                                                           {"mm", largest->shift_mm.norm()},
                                                           {"name", largest->name},
                                                           {"file", largest->file},
                                                           {"line", largest->line}}));
  text += written;
  if (written.empty() && largest != nullptr) text += said("say.correct.nothing_written");
  return text;
}

nlohmann::json json_of(const CorrectedProgram& result, const calib::Robot& robot) {
  nlohmann::json all = {
      {"points", nlohmann::json::array()},  {"left", left_json(result.left)},
      {"tools", nlohmann::json::array()},   {"refusals", refusals_json(result.refusals, robot)},
      {"written", nlohmann::json::array()}, {"robroot_stated", result.robroot_stated}};
  for (const CorrectedPoint& p : result.points) all["points"].push_back(point_json(p));
  if (const CorrectedPoint* largest = result.largest()) all["largest"] = point_json(*largest);
  for (const krl::ToolUsed& tool : result.tools) {
    all["tools"].push_back(tool_json(tool));
    all["tools"].back()["number"] = tool.number;
  }
  return all;
}

/// True if the point or its frame is computed while the program runs.
bool known_at_run_time(const krl::Refusal& refusal) {
  using enum krl::Why;
  constexpr krl::Why kComputedThere[] = {kComputed,       kArray,        kGeometricOperator,
                                         kRelativeMotion, kToolNotKnown, kBaseNotKnown,
                                         kFrameChanged,   kTwoFrames};
  return std::ranges::find(kComputedThere, refusal.why) != std::end(kComputedThere);
}

/// Remedy; empty: none.
calib::Phrase instead_of(const std::vector<krl::Refusal>& offline) {
  return std::ranges::any_of(offline, known_at_run_time) ? "say.correct.refused.at_run_time" : "";
}

void name_refusals(const CorrectedProgram& result, const calib::Robot& robot) {
  print_refusals(result.refusals, robot);
  fmt::print(stderr, "{}\n",
             say({"say.correct.refused.nothing", {{"instead", instead_of(result.refusals)}}}));
}

/// Arm and accuracy by the given files of the controller; of a backup by all that could state them.
calib::MachineData stated_arm(const CorrectCommand& command) {
  calib::MachineData data;
  const auto scan = [&](const KrlFile& file) {
    (is_of_the_controllers_side(file.name) ? calib::read_absolute_accuracy : calib::read_arm)(
        file.text, file.name, data);
  };
  for (const fs::path& path : command.controller)
    if (!is_src(path)) scan(read(path));
  if (!command.backup.empty())
    for (const KrlFile& file : read_backup(command.backup).files)
      if (may_state_accuracy(file.name)) scan(file);
  return data;
}

/// Points with the bit of absolute accuracy, where nothing states whether the controller computes by it.
calib::Phrase taught_by_another_model(const CorrectCommand& command, const calib::Robot& robot,
                                      const std::vector<CorrectedPoint>& points) {
  const auto first = std::ranges::find_if(points, &CorrectedPoint::taught_accurately);
  if (first == points.end() || command.nominal_controller ||
      robot.absolute_accuracy != calib::AbsoluteAccuracy::kNotStated ||
      stated_arm(command).absolute_accuracy() != calib::AbsoluteAccuracy::kNotStated)
    return {};
  return {"say.correct.taught_accurately",
          {{"n", std::ranges::count_if(points, &CorrectedPoint::taught_accurately)},
           {"name", calib::shown(first->name)},
           {"file", calib::shown(first->file, 120)},
           {"line", first->line}}};
}

/// Lengths that differ: "$LENGTH_A 350.000 mm (260.000)"; empty: none that the files state.
std::string other_lengths(const calib::MachineData& data, const calib::Robot& robot) {
  if (!has_an_arm(data) || robot.joints.size() - robot.first_turning() != data.axes.size())
    return {};
  std::string all;
  for (const calib::LengthDifference& one : calib::differences(data, robot)) {
    // An arm that such lengths do not describe has none to compare.
    if (one.variable.empty() && !calib::differences({}, robot).empty()) return {};
    const auto mm = [](double m) { return fmt::format("{:.3f}", m * calib::kMmPerM); };
    all += (all.empty() ? "" : ", ") +
           (one.variable.empty()
                ? "$AXIS_DIR"
                : one.variable + " " + mm(one.controller_m) + " mm (" + mm(one.robot_m) + ")");
  }
  return all;
}

/// Why the controller would not go to corrected points by the robot file's model; empty: it does.
calib::Phrase other_model(const CorrectCommand& command, const calib::Calibration& calibration) {
  const calib::Robot& robot = calibration.cell.robot;
  const auto because = [](calib::Phrase why) {
    return calib::Phrase{"say.correct.other_model", {{"why", std::move(why)}}};
  };
  const auto& findings = calibration.verdict.findings;
  if (const auto* found = calib::first(findings, calib::FindingKind::kControllerModel))
    return because(calib::phrase(*found));
  if (robot.absolute_accuracy == calib::AbsoluteAccuracy::kActive)
    return because("say.correct.other_model.robot_file");
  if (robot.absolute_accuracy == calib::AbsoluteAccuracy::kInFile) return {};
  const calib::MachineData stated = stated_arm(command);
  if (stated.absolute_accuracy() == calib::AbsoluteAccuracy::kActive)
    return because("say.correct.other_model.controller");
  const std::string lengths = other_lengths(stated, robot);
  if (lengths.empty()) return {};
  return {"say.correct.other_arm", {{"lengths", lengths}, {"robot", robot.name}}};
}

/// Corrected points are those to which the nominal arm's inverse leads; angles are not concerned.
bool refused_by_model(const CorrectCommand& command, const calib::Calibration& calibration) {
  if (command.nominal_controller || !command.poses.empty()) return false;
  const calib::Phrase why = other_model(command, calibration);
  if (why.empty()) return false;
  fmt::print(stderr, "{}\n", say(why));
  return true;
}

/// Corrects KRL programs taught on an arm that is not the nominal one.
int correct_taught(const CorrectCommand& command, const calib::Calibration& calibration,
                   const calib::Calibration* from) {
  return command.backup.empty() ? correct_krl(command, calibration, from)
                                : correct_backup_files(command, calibration, from);
}

}  // namespace

std::vector<std::string> upper(std::vector<std::string> names) {
  for (std::string& name : names) name = calib::krl::upper_case(std::move(name));
  return names;
}

krl::ProgramFiles read_program_files(const fs::path& program, const fs::path& dat,
                                     const std::vector<fs::path>& controller) {
  krl::ProgramFiles files;
  files.src = read(program);
  const fs::path points = dat.empty() ? dat_beside(program) : dat;
  if (!points.empty()) files.dat = read(points);
  for (const fs::path& one : controller)
    (is_src(one) ? files.modules : files.controller).push_back(read(one));
  for (KrlFile& one : modules_beside(program)) files.modules.push_back(std::move(one));
  return files;
}

std::vector<KrlFile> controller_files(const CorrectCommand& command) {
  std::vector<KrlFile> files;
  for (const fs::path& path : command.controller) {
    if (is_src(path))
      throw calib::FileError(path.string(),
                             ": a program, and --backup corrects those in the backup alone");
    files.push_back(read(fs::absolute(path)));
  }
  return files;
}

krl::CorrectionOptions correction_options(const CorrectCommand& command,
                                          const calib::Calibration* from) {
  krl::CorrectionOptions options;
  options.from = from;
  options.anywhere = command.anywhere;
  options.leave = upper(command.leave);
  options.still = upper(command.still);
  return options;
}

std::string stated_words(const krl::Corrected& result) {
  std::string text;
  for (const krl::ToolUsed& tool : result.tools) text += tool_words(tool);
  text += bounds_words(result.points);
  for (const krl::LeftPoint& one : result.left)
    text += said({"say.correct.left", {{"name", calib::shown(one.name)}, {"why", one.why}}});
  return result.robroot_stated ? text : text + said("say.correct.robroot");
}

nlohmann::json left_json(const std::vector<krl::LeftPoint>& left) {
  nlohmann::json all = nlohmann::json::array();
  for (const krl::LeftPoint& one : left) all.push_back({{"name", one.name}, {"why", one.why}});
  return all;
}

nlohmann::json tool_json(const krl::ToolUsed& tool) {
  return {{"of_the_cell", tool.cells}, {"load_known", tool.load_known}, {"load", load_name(tool)}};
}

std::string module_line(const std::string& state, const std::string& src,
                        const calib::Phrase& what) {
  const std::string id = state == "no motion" ? "no_motion" : state;
  return said({"say.correct.module",
               {{"state", fmt::format("{:<10}", say("say.correct.state." + id))},
                {"src", calib::shown(src, 120)},
                {"what", what}}});
}

calib::Phrase refused_phrase(std::size_t refusals) {
  return {refusals == 1 ? "say.correct.module.refused.one" : "say.correct.module.refused",
          {{"n", refusals}}};
}

std::string load_name(const krl::ToolUsed& tool) {
  if (!tool.other_load()) return kOwnLoad;
  return tool.load_name.empty() ? fmt::format("LOAD_DATA[{}]", tool.load) : tool.load_name;
}

nlohmann::json point_json(const CorrectedPoint& p) {
  return {{"name", p.name},
          {"file", p.file},
          {"line", p.line},
          {"kind", p.axes ? "axes" : "pose"},
          {"tool", p.tool},
          {"base", p.base},
          {"shift_mm", {p.shift_mm.x(), p.shift_mm.y(), p.shift_mm.z()}},
          {"shift_norm_mm", p.shift_mm.norm()},
          {"turn_deg", p.turn_deg},
          {"u95_mm", p.u95_mm},
          {"left_mm", p.left_mm},
          {"status_changed", p.status_changed}};
}

nlohmann::json refusals_json(const std::vector<krl::Refusal>& refusals, const calib::Robot& robot) {
  nlohmann::json all = nlohmann::json::array();
  for (const krl::Refusal& one : refusals)
    all.push_back({{"why", name_of(one.why)},
                   {"file", one.file},
                   {"line", one.line},
                   {"what", one.what},
                   {"words", words(one, robot)}});
  return all;
}

void print_refusals(const std::vector<krl::Refusal>& refusals, const calib::Robot& robot) {
  constexpr std::size_t kInWords = 30;
  for (std::size_t i = 0; i < std::min(kInWords, refusals.size()); ++i)
    fmt::print(stderr, "cellcal correct: {}\n", say(phrase(refusals[i], robot)));
  if (refusals.size() > kInWords)
    fmt::print(stderr, "{}\n",
               say({"say.correct.refused.more", {{"n", refusals.size() - kInWords}}}));
}

int print_refused_modules(const std::vector<std::vector<krl::Refusal>>& of_moving,
                          const calib::Robot& robot, bool at_run_time) {
  std::vector<krl::Refusal> all;
  std::size_t refused = 0;
  std::set<std::tuple<std::string, int, std::string, krl::Why>> seen;  // one point of several
  for (const auto& module : of_moving) {
    refused += module.empty() ? 0 : 1;
    for (const krl::Refusal& one : module)
      if (seen.emplace(one.file, one.line, one.what, one.why).second) all.push_back(one);
  }
  if (refused == 0) return kSuccess;
  print_refusals(all, robot);
  fmt::print(stderr, "{}\n",
             say({"say.correct.backup.refused",
                  {{"n", refused},
                   {"all", of_moving.size()},
                   {"instead", at_run_time ? "" : instead_of(all)}}}));
  return kNotPublishable;
}

nlohmann::json warned(std::vector<calib::Phrase> warnings, const CorrectCommand& command,
                      const calib::Robot& robot, const std::vector<CorrectedPoint>& points) {
  if (auto one = taught_by_another_model(command, robot, points); !one.empty())
    warnings.push_back(std::move(one));
  nlohmann::json all = nlohmann::json::array();
  for (const calib::Phrase& one : warnings) {
    fmt::print(stderr, "{}\n", say(one));
    all.push_back(calib::words(one));
  }
  return all;
}

int correct_krl(const CorrectCommand& command, const calib::Calibration& calibration,
                const calib::Calibration* from) {
  const krl::ProgramFiles files =
      read_program_files(command.program, command.dat, command.controller);
  std::vector<KrlFile> read = {files.src};
  if (files.dat) read.push_back(*files.dat);
  refuse_corrected(command, {}, read);
  const CorrectedProgram result =
      correct_program(calibration, files, correction_options(command, from));
  const calib::Robot& robot = calibration.cell.robot;
  if (!result.refusals.empty()) {
    name_refusals(result, robot);
    if (command.json) put(json_text(json_of(result, robot)), {});
    return kJobFailed;
  }
  const bool nothing = result.motions > 0 && result.points.empty();
  nlohmann::json all = json_of(result, robot);
  all["warnings"] = warned(result.warnings, command, robot, result.points);
  const std::string written = nothing ? "" : write_corrected(command, read, result.files, {}, all);
  put(command.json ? json_text(all) : report(result, written), {});
  if (nothing)
    fmt::print(stderr, "{}\n", say({"say.correct.no_motion_point", {{"n", result.motions}}}));
  return nothing ? kNotPublishable : kSuccess;
}

int correct(const CorrectCommand& command) {
  if (!command.restore.empty()) return restore_program(command);
  const auto calibration = usable_calibration("correct", command.calibration, command.withheld);
  if (!calibration) return kNotPublishable;
  if (refused_by_model(command, *calibration)) return kJobFailed;
  if (command.at_run_time) return correct_at_run_time(command, *calibration);
  if (command.upload) {
    const calib::Calibration drawn = krl::as_drawn(*calibration);
    return correct_taught(command, drawn, &*calibration);
  }
  if (!command.from.empty()) {
    const auto from = usable_calibration("correct", command.from, command.withheld);
    return from ? correct_taught(command, *calibration, &*from) : kNotPublishable;
  }
  if (!command.backup.empty()) return correct_backup_files(command, *calibration);
  return command.poses.empty() ? correct_krl(command, *calibration)
                               : correct_poses(command, *calibration);
}

}  // namespace cellcal::daemon
