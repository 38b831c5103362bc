#pragma once
// Reference calibration of a check, and the touches of earlier checks of it.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "calib/result/calibration.h"
#include "daemon/journal/journal.h"

namespace cellcal::daemon {

/// No calibration to check; the text gives reason and remedy.
struct NothingToCheck : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Session of the calibration: the given one, or the one in use (active_calibration.h), of this cell file
/// where given. Throws NothingToCheck; NotUsable where it exists but must not be used; JournalError.
SessionRecord published_session(Journal& journal, const std::filesystem::path& cell,
                                std::optional<std::int64_t> session);

/// Calibration of the session from published_session(). Throws NotUsable, JournalError.
calib::Calibration calibration_of(Journal& journal, std::int64_t session);

/// Touches of the checks of that calibration completed before this session, oldest first.
std::vector<std::vector<calib::Touch>> checks_before(Journal& journal, std::int64_t calibrated,
                                                     std::int64_t before);

// Earlier calibration that a session's result is compared with.

/// Calibration of the same cell file in use before that session (active_calibration.h); `accepted`: option of
/// the session, with which an unusable one is skipped and logged. Throws NotUsable, JournalError.
std::optional<Compared> last_calibration(Journal& journal, const std::string& cell_name,
                                         std::int64_t before, bool accepted);

// File compared.json of an export.

std::string compared_to_json(const Compared& compared);
/// Throws std::runtime_error.
Compared compared_from_json(const std::string& text);

}  // namespace cellcal::daemon
