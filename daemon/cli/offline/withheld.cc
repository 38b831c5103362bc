#include <fmt/format.h>

#include "calib/words/finding_words.h"
#include "daemon/cli/offline/offline.h"

namespace cellcal::daemon {

std::string withheld_words(const std::string& command, const std::filesystem::path& calibration,
                           const calib::Verdict& verdict) {
  std::string words = fmt::format(
      "cellcal {}: {}: this calibration was withheld and must not be used. Calibrate again; "
      "--withheld accepts it for inspection only\n",
      command, calibration.string());
  for (const std::string& reason : calib::words(verdict.findings)) words += "  - " + reason + "\n";
  return words;
}

}  // namespace cellcal::daemon
