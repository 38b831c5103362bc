#pragma once

namespace cellcal::daemon {

/// Logs to systemd's journal, with fields, where standard error is connected to it; otherwise to standard error:
/// with the journal's priorities where $JOURNAL_STREAM is set, with time and level where not. A message is
/// one line, whatever words of others are in it.
void set_up_log(bool verbose);
/// Every step of a session as well, or not. Any thread.
void set_log_level(bool verbose);

}  // namespace cellcal::daemon
