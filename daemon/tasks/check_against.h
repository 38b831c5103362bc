#pragma once
// Which calibration a check is held against, and what earlier checks of it touched.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "calib/result/calibration.h"
#include "daemon/journal/journal.h"

namespace cellcal::daemon {

/// Why there is none: in words, with what to do.
struct NothingToCheck : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The session of the calibration: that one, or the one that is in use (active_calibration.h), of this cell file where
/// one is given. Throws NothingToCheck; NotUsable where there is one, and it must not be used; JournalError.
SessionRecord published_session(Journal& journal, const std::filesystem::path& cell,
                                std::optional<std::int64_t> session);

/// The calibration of what published_session() gave. Throws NotUsable, JournalError.
calib::Calibration calibration_of(Journal& journal, std::int64_t session);

/// Touches of the checks of that calibration which came to their end before this session, oldest first.
std::vector<std::vector<calib::Touch>> checks_before(Journal& journal, std::int64_t calibrated,
                                                     std::int64_t before);

// What a session's result is held against.

/// The one of the same cell file that was in use before that session (active_calibration.h); `accepted` as the
/// session has it: then one that cannot be used is left out, which the log says. Throws NotUsable, JournalError.
std::optional<Compared> last_calibration(Journal& journal, const std::string& cell_name,
                                         std::int64_t before, bool accepted);

// compared.json of an export.

std::string compared_to_json(const Compared& compared);
/// Throws std::runtime_error.
Compared compared_from_json(const std::string& text);

}  // namespace cellcal::daemon
