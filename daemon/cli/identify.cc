#include "calib/identify/identify.h"

#include <cstdio>

#include "calib/files/calibration_json.h"
#include "calib/files/files.h"
#include "calib/identify/change.h"
#include "calib/identify/paper.h"
#include "daemon/cli/exit_status.h"
#include "daemon/cli/offline.h"
#include "daemon/cli/tables.h"
#include "daemon/session/atomic_file.h"

namespace cellcal::daemon {

namespace {

calib::InputFile input(const char* role, const std::filesystem::path& path) {
  return {role, path.string(), calib::sha256(calib::read_file(path))};
}

}  // namespace

void put(const std::string& text, const std::filesystem::path& output) {
  if (!output.empty()) {
    write_atomically(output, text);
    return;
  }
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) {
    throw std::runtime_error("standard output cannot be written");
  }
}

int identify(const IdentifyCommand& command) {
  const calib::Cell cell = calib::load_cell(command.cell);
  const std::vector<calib::Touch> touches = calib::load_touches(command.touches, cell);
  calib::Calibration calibration = command.method == "paper" ? calib::identify_paper(cell, touches)
                                                             : calib::identify(cell, touches);
  calibration.inputs = {input("cell", command.cell),
                        input("robot", calib::robot_file_of(command.cell)),
                        input("touches", command.touches)};
  if (!command.last.empty()) {
    calib::judge_change(calib::load_calibration(command.last), command.last.filename().string(),
                        command.accept_change, touches, calibration);
    calibration.inputs.push_back(input("last", command.last));
  }
  const std::string json = calib::calibration_to_json(calibration);
  if (!command.output.empty()) put(json, command.output);
  put(command.json ? json : result_words(calibration), {});
  return calibration.verdict.publish ? kSuccess : kNotPublishable;
}

}  // namespace cellcal::daemon
