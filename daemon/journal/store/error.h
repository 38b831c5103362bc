#pragma once

#include <stdexcept>

namespace cellcal::daemon {

/// A failed read or write of the journal. The message names the file and the remedy.
struct JournalError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The checksums of a session's rows do not match; permanent. SQLite's "malformed" is not a
/// DamagedError, because it is also returned for an unavailable disk (EIO, SQLITE_IOERR_CORRUPTFS).
struct DamagedError : JournalError {
  using JournalError::JournalError;
};

/// No space on the disk; a retry may succeed after space has been freed.
struct DiskFullError : JournalError {
  using JournalError::JournalError;
};

}  // namespace cellcal::daemon
