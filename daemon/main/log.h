#pragma once
// Lines of the log with their fields, to systemd's journal.

#include <spdlog/sinks/sink.h>

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/files/log_context.h"

namespace cellcal::daemon {

/// Logs to systemd's journal, with fields, where standard error is connected to it; otherwise to standard error:
/// with the journal's priorities where $JOURNAL_STREAM is set, with time and level where not. A message is
/// one line, whatever words of others are in it.
void set_up_log(bool verbose);
/// Every step of a session as well, or not. Any thread.
void set_log_level(bool verbose);

/// "PRIORITY=6", "MESSAGE=...", "CELLCAL_SESSION=7", ...: a message's fields as sd_journal_sendv(3) takes them. The
/// message is one line without control characters.
std::vector<std::string> journal_fields(spdlog::level::level_enum level, std::string_view message,
                                        const LogContext& context);

/// Whether standard error goes to the journal ($JOURNAL_STREAM names it).
bool stderr_is_journal();

/// What cannot be handed to the journal goes to standard error, with its priority in front.
std::shared_ptr<spdlog::sinks::sink> make_journal_sink();

}  // namespace cellcal::daemon
