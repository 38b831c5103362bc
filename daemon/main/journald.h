#pragma once
// Lines of the log with their fields, to systemd's journal.

#include <spdlog/sinks/sink.h>

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/files/log_context.h"

namespace cellcal::daemon {

/// "PRIORITY=6", "MESSAGE=...", "CELLCAL_SESSION=7", ...: a message's fields as sd_journal_sendv(3) takes them. The
/// message is one line without control characters.
std::vector<std::string> journal_fields(spdlog::level::level_enum level, std::string_view message,
                                        const LogContext& context);

/// Whether standard error goes to the journal ($JOURNAL_STREAM names it).
bool stderr_is_journal();

/// What cannot be handed to the journal goes to standard error, with its priority in front.
std::shared_ptr<spdlog::sinks::sink> make_journal_sink();

}  // namespace cellcal::daemon
