#pragma once

#include <stdexcept>

namespace cellcal::daemon {

/// Something could not be put on disk or read from it. Names the file and says what to do.
struct JournalError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A session's rows are not as they were written, by their checksums, however often they are read again. A file that is
/// "malformed" to SQLite is none: it says the same of a disk that is away (EIO, its SQLITE_IOERR_CORRUPTFS).
struct DamagedError : JournalError {
  using JournalError::JournalError;
};

/// For want of room, which may be made.
struct DiskFullError : JournalError {
  using JournalError::JournalError;
};

}  // namespace cellcal::daemon
