#pragma once
// What a session's result is held against.

#include <cstdint>
#include <optional>
#include <string>

#include "daemon/journal/journal.h"

namespace cellcal::daemon {

/// The one of the same cell file that was in use before that session (active_calibration.h); `accepted` as the
/// session has it: then one that cannot be used is left out, which the log says. Throws NotUsable, JournalError.
std::optional<Compared> last_calibration(Journal& journal, const std::string& cell_name,
                                         std::int64_t before, bool accepted);

}  // namespace cellcal::daemon
