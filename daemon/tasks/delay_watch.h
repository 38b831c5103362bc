#pragma once
// The latch's delay of each session, by its journalled readings, beside that of the one before.

#include <cstdint>
#include <optional>
#include <string>

#include "daemon/journal/journal.h"
#include "daemon/qualification/contact_delay.h"

namespace cellcal::daemon {

/// Throws JournalError.
std::optional<ContactDelay> delay_of(Journal& journal, std::int64_t session);
/// Of the newest earlier session with the same robot file that has one. Throws JournalError.
std::optional<ContactDelay> delay_before(Journal& journal, std::int64_t session);
/// Notes the delay in the session's events and in the log, and what is wrong with it. Throws
/// nothing.
void watch_delay(Journal& journal, std::int64_t session, const std::string& utc);

}  // namespace cellcal::daemon
