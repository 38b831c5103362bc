#pragma once
// Log lines with fields, for systemd's journal.

#include <spdlog/sinks/sink.h>

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/files/log_context.h"

namespace cellcal::daemon {

/// Logs to systemd's journal with fields, where standard error is connected to it; otherwise to standard
/// error: with journal priorities if $JOURNAL_STREAM is set, with time and level if not. Each message is one
/// line, whatever foreign text it contains.
void set_up_log(bool verbose);
/// Verbose logs every step of a session. Thread-safe.
void set_log_level(bool verbose);

/// "PRIORITY=6", "MESSAGE=...", "CELLCAL_SESSION=7", ...: fields for sd_journal_sendv(3). The message is one
/// line without control characters.
std::vector<std::string> journal_fields(spdlog::level::level_enum level, std::string_view message,
                                        const LogContext& context);

/// True if standard error goes to the journal (named by $JOURNAL_STREAM).
bool stderr_is_journal();

/// Lines that the journal does not accept go to standard error, with a priority prefix.
std::shared_ptr<spdlog::sinks::sink> make_journal_sink();

}  // namespace cellcal::daemon
