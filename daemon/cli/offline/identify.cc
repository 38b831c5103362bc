#include "calib/identify/identify.h"

#include <fmt/format.h>

#include <cstdio>
#include <fstream>
#include <stdexcept>

#include "calib/files/calibration_json.h"
#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/files/robot_file.h"
#include "calib/plan/cell_check.h"
#include "calib/seed_paper/paper.h"
#include "calib/verdict/change.h"
#include "daemon/cli/offline/exit_status.h"
#include "daemon/cli/offline/offline.h"
#include "daemon/cli/offline/tables.h"
#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {

namespace {

calib::InputFile input(const char* role, const std::string& name, const std::string& text) {
  return {role, name, calib::sha256(text)};
}

/// A link stays one, and a pipe or device is written to.
void write_output(const std::filesystem::path& output, const std::string& text) {
  namespace fs = std::filesystem;
  const std::string& name = output.native();
  std::error_code ignored;
  const fs::file_status status = fs::status(output, ignored);
  if (name.starts_with("/dev/") || name.starts_with("/proc/") ||
      (fs::exists(status) && !fs::is_regular_file(status))) {
    std::ofstream stream(output, std::ios::binary);
    if (!(stream << text << std::flush)) throw std::runtime_error(name + ": cannot be written");
    return;
  }
  constexpr int kMostLinks = 40;
  fs::path file = output;
  for (int k = 0; k < kMostLinks && fs::is_symlink(file); ++k)
    file = file.parent_path() / fs::read_symlink(file);
  write_atomically(file, text);
}

/// The touches are there: what the cell file says against itself is a warning now.
void warn_of_cell(const calib::Cell& cell) {
  try {
    for (const calib::CellFault& fault : calib::faults_of(cell))
      fmt::print(stderr, "warning: {}\n", words(fault));
  } catch (const calib::PlanError&) {  // of no robot that sessions move
  }
}

}  // namespace

void put(const std::string& text, const std::filesystem::path& output) {
  if (!output.empty()) {
    write_output(output, text);
    return;
  }
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) {
    if (errno == EPIPE) return;  // the reader has what it wanted: `| head`
    throw std::runtime_error("standard output cannot be written");
  }
}

int identify(const IdentifyCommand& command) {
  const calib::CellText files = calib::read_cell_text(command.cell);
  const calib::Cell cell = calib::parse_cell(files);
  warn_of_cell(cell);
  const std::string csv = calib::read_file(command.touches);
  const std::vector<calib::Touch> touches =
      calib::parse_touches(csv, command.touches.string(), cell);
  calib::Calibration calibration =
      command.method == "paper"
          ? calib::identify_paper(cell, touches)
          : calib::identify(cell, touches, {.region_poses = calib::kStatedPoses},
                            calib::shipped_robots);
  calibration.inputs = {input("cell", files.cell_name, files.cell_text),
                        input("robot", files.robot_name, files.robot_text),
                        input("touches", command.touches.string(), csv)};
  if (!command.last.empty()) {
    const std::string last = calib::read_file(command.last);
    calib::judge_change(calib::calibration_from_json(last, command.last.string()),
                        command.last.filename().string(), command.accept_change, touches,
                        calibration);
    calibration.inputs.push_back(input("last", command.last.string(), last));
  }
  const std::string json = calib::calibration_to_json(calibration);
  if (!command.output.empty()) put(json, command.output);
  if (command.json) {
    put(json, {});
  } else if (command.verbose) {
    put(result_words(calibration, touches, Detail::kAll), {});
  } else {
    put(result_words(calibration, touches) + "all findings, noise, correlations: --verbose\n", {});
  }
  return calibration.verdict.publish ? kSuccess : kNotPublishable;
}

}  // namespace cellcal::daemon
