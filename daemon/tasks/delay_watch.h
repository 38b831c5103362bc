#pragma once
// Latch delay of each session from its recorded readings, compared with the previous one.

#include <cstdint>
#include <optional>
#include <string>

#include "daemon/journal/journal.h"
#include "daemon/qualification/contact_delay.h"

namespace cellcal::daemon {

/// Throws JournalError.
std::optional<ContactDelay> delay_of(Journal& journal, std::int64_t session);
/// From the newest earlier session with the same robot file that has one. Throws JournalError.
std::optional<ContactDelay> delay_before(Journal& journal, std::int64_t session);
/// Records the delay, and its faults, in the session's events and in the log. Never throws.
void watch_delay(Journal& journal, std::int64_t session, const std::string& utc);

}  // namespace cellcal::daemon
