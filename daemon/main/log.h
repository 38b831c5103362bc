#pragma once

namespace cellcal::daemon {

/// Logs to standard error: with the journal's priorities where systemd's journal listens, otherwise
/// with time and level. A message is one line, whatever words of others are in it.
void set_up_log(bool verbose);

}  // namespace cellcal::daemon
