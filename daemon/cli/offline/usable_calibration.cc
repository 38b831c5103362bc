#include <fmt/format.h>

#include <cstdio>

#include "calib/export/corrector.h"
#include "calib/files/calibration_json.h"
#include "calib/files/input_file.h"
#include "calib/model/error.h"
#include "calib/result/finding.h"
#include "daemon/cli/offline/offline.h"

namespace cellcal::daemon {

namespace {

std::string withheld_words(const std::string& command, const std::filesystem::path& calibration,
                           const calib::Verdict& verdict) {
  std::string words = fmt::format(
      "cellcal {}: {}: this calibration was withheld and must not be used. Calibrate again; "
      "--withheld accepts it for inspection only\n",
      command, calibration.string());
  for (const std::string& reason : calib::words(verdict.findings)) words += "  - " + reason + "\n";
  return words;
}

}  // namespace

calib::Calibration read_calibration(const std::filesystem::path& file) {
  const std::string text = calib::read_file(file);
  calib::Calibration calibration = calib::calibration_from_json(text, file.string());
  if (!calib::states_sum(text))
    fmt::print(
        stderr,
        "warning: {}: has no sum: written by an earlier version, or taken out. A changed value "
        "does not show. Compare it with its session: 'cellcal export ID DIR'\n",
        file.string());
  return calibration;
}

void refuse_far(const calib::Calibration& calibration, const std::filesystem::path& file) {
  if (const auto far = calib::far_correction(calibration))
    throw calib::FileError(
        file.string(),
        fmt::format(": {}: not of this arm, or altered. Take the file from its session again: "
                    "'cellcal export ID DIR'",
                    calib::words(*far)));
}

std::optional<calib::Calibration> usable_calibration(const std::string& command,
                                                     const std::filesystem::path& file,
                                                     bool withheld) {
  calib::Calibration calibration = read_calibration(file);
  if (!calibration.verdict.publish && !withheld) {
    fmt::print(stderr, "{}", withheld_words(command, file, calibration.verdict));
    return std::nullopt;
  }
  // What withheld it may be just this; whoever asks for it has been told.
  if (calibration.verdict.publish) refuse_far(calibration, file);
  return calibration;
}

}  // namespace cellcal::daemon
