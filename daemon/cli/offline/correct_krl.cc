#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "calib/files/input_file.h"
#include "calib/model/error.h"
#include "daemon/cli/offline/correct.h"
#include "daemon/cli/offline/corrected_record.h"
#include "daemon/cli/offline/exit_status.h"
#include "daemon/cli/offline/offline.h"
#include "daemon/files/atomic_file.h"
#include "daemon/krl/correct_program.h"

namespace cellcal::daemon {

namespace {

namespace fs = std::filesystem;
using krl::CorrectedPoint;
using krl::CorrectedProgram;
using krl::KrlFile;

KrlFile read(const fs::path& path) {
  return {path.string(), calib::read_file(path, krl::kMostBytes + 1)};
}

/// weld.dat for weld.src, WELD.DAT for WELD.SRC; empty where there is none.
fs::path dat_beside(fs::path src) {
  for (const char* ending : {".dat", ".DAT", ".Dat"})
    if (fs::exists(src.replace_extension(ending))) return src;
  return {};
}

krl::ProgramFiles read_files(const CorrectCommand& command) {
  krl::ProgramFiles files;
  files.src = read(command.program);
  const fs::path dat = command.dat.empty() ? dat_beside(command.program) : command.dat;
  if (!dat.empty()) files.dat = read(dat);
  for (const fs::path& one : command.controller) files.controller.push_back(read(one));
  return files;
}

void refuse_to_replace(const CorrectCommand& command, const fs::path& path) {
  if (!command.force && fs::exists(path))
    throw calib::FileError(path.string(),
                           ": is there already; --force replaces it, or write to another folder");
}

/// Where the files go, the record last. All of them or an error: none may fall on a file that was read, on another one,
/// or unasked on any.
std::vector<fs::path> places(const CorrectCommand& command, const CorrectedProgram& result) {
  if (command.output.empty()) return {};
  std::vector<fs::path> all;
  for (const KrlFile& file : result.files) {
    all.push_back(command.output / fs::path(file.name).filename());
    if (fs::exists(all.back()) && fs::equivalent(all.back(), file.name))
      throw calib::FileError(all.back().string(),
                             ": is the program itself; write to another folder with -o");
    refuse_to_replace(command, all.back());
  }
  if (all.size() == 2 && all[0] == all[1])
    throw calib::FileError(all[0].string(), ": program and points have one name");
  all.push_back(record_beside(all.front()));
  refuse_to_replace(command, all.back());
  return all;
}

/// The record first: a program without it would pass for the original.
void write(const std::vector<fs::path>& places, const CorrectedProgram& result,
           const std::string& record) {
  fs::create_directories(places.front().parent_path());
  write_atomically(places.back(), record);
  for (std::size_t i = 0; i < result.files.size(); ++i)
    write_atomically(places[i], result.files[i].text);
}

std::string tool_words(const krl::ToolUsed& tool) {
  const std::string name =
      tool.number < 0 ? "tool in the text" : fmt::format("tool {}", tool.number);
  if (tool.cells) return name + ": the cell file's, with its bending\n";
  return fmt::format("{}: not the cell file's; taken as stated and stiff, load {}\n", name,
                     tool.load_known ? "from LOAD_DATA" : "of the cell's tool (no LOAD_DATA)");
}

/// TOOL_DATA[n] or BASE_DATA[n]; below 0: written out in the program.
std::string frame_words(int number) { return number < 0 ? "text" : std::to_string(number); }

std::string table(const CorrectedProgram& result) {
  std::string text =
      fmt::format("{:<16}{:>6}{:>6}{:>6}{:>10}{:>10}{:>10}{:>10}{:>10}{:>9}\n", "point", "line",
                  "tool", "base", "dx mm", "dy mm", "dz mm", "shift mm", "turn deg", "u95 mm");
  for (const CorrectedPoint& p : result.points)
    text += fmt::format(
        "{:<16}{:>6}{:>6}{:>6}{:>10.3f}{:>10.3f}{:>10.3f}{:>10.3f}{:>10.4f}{:>9.3f}{}\n", p.name,
        p.line, frame_words(p.tool), p.axes ? "axes" : frame_words(p.base), p.shift_mm.x(),
        p.shift_mm.y(), p.shift_mm.z(), p.shift_mm.norm(), p.turn_deg, p.u95_mm,
        p.status_changed ? "  S, T changed" : "");
  return text;
}

std::string report(const CorrectedProgram& result, const std::vector<fs::path>& written) {
  std::string text = table(result);
  for (const krl::ToolUsed& tool : result.tools) text += tool_words(tool);
  for (const krl::LeftPoint& one : result.left)
    text += fmt::format("left as it is: {} ({})\n", one.name, one.why);
  if (!result.robroot_stated)
    text += "$ROBROOT not in the given files: the robot is taken to be at the world's origin\n";
  const CorrectedPoint* largest = result.largest();
  text += largest == nullptr
              ? "no point to correct\n"
              : fmt::format("{} points corrected; the largest shift is {:.3f} mm: {} ({}:{})\n",
                            result.points.size(), largest->shift_mm.norm(), largest->name,
                            largest->file, largest->line);
  for (const fs::path& path : written) text += path.string() + " written\n";
  if (written.empty()) text += "nothing written; -o FOLDER writes the program\n";
  return text;
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

nlohmann::json json(const CorrectedProgram& result, const std::vector<fs::path>& written,
                    const calib::Robot& robot) {
  nlohmann::json all = {
      {"points", nlohmann::json::array()},  {"left", nlohmann::json::array()},
      {"tools", nlohmann::json::array()},   {"refusals", nlohmann::json::array()},
      {"written", nlohmann::json::array()}, {"robroot_stated", result.robroot_stated}};
  for (const CorrectedPoint& p : result.points) all["points"].push_back(point_json(p));
  if (const CorrectedPoint* largest = result.largest()) all["largest"] = point_json(*largest);
  for (const krl::LeftPoint& one : result.left)
    all["left"].push_back({{"name", one.name}, {"why", one.why}});
  for (const krl::ToolUsed& tool : result.tools)
    all["tools"].push_back(
        {{"number", tool.number}, {"of_the_cell", tool.cells}, {"load_known", tool.load_known}});
  for (const krl::Refusal& one : result.refusals)
    all["refusals"].push_back({{"why", name_of(one.why)},
                               {"file", one.file},
                               {"line", one.line},
                               {"what", one.what},
                               {"words", words(one, robot)}});
  for (const fs::path& path : written) all["written"].push_back(path.string());
  return all;
}

std::string text_of(const nlohmann::json& all) {
  // Paths are what the user typed, in any encoding.
  return all.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

void name_refusals(const CorrectedProgram& result, const calib::Robot& robot) {
  constexpr std::size_t kInWords = 30;
  for (std::size_t i = 0; i < std::min(kInWords, result.refusals.size()); ++i)
    fmt::print(stderr, "cellcal correct: {}\n", words(result.refusals[i], robot));
  if (result.refusals.size() > kInWords)
    fmt::print(stderr, "cellcal correct: {} more refusals\n", result.refusals.size() - kInWords);
  fmt::print(stderr, "cellcal correct: nothing written, since points are refused\n");
}

}  // namespace

int correct_krl(const CorrectCommand& command, const calib::Calibration& calibration) {
  krl::CorrectionOptions options;
  options.anywhere = command.anywhere;
  for (std::string name : command.leave) {
    for (char& c : name) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    options.leave.push_back(std::move(name));
  }
  const krl::ProgramFiles files = read_files(command);
  refuse_corrected(files);
  const CorrectedProgram result = correct_program(calibration, files, options);
  const calib::Robot& robot = calibration.cell.robot;
  if (!result.refusals.empty()) {
    name_refusals(result, robot);
    if (command.json) put(text_of(json(result, {}, robot)), {});
    return kJobFailed;
  }
  const std::vector<fs::path> written = places(command, result);
  const nlohmann::json all = json(result, written, robot);
  if (!written.empty()) {
    nlohmann::json record = corrected_record(all, files, result.files);
    record["calibration_sha256"] = calib::sha256(calib::read_file(command.calibration));
    write(written, result, text_of(record));
  }
  put(command.json ? text_of(all) : report(result, written), {});
  return kSuccess;
}

}  // namespace cellcal::daemon
