#pragma once

#include <stdexcept>

namespace cellcal::daemon {

/// Something could not be put on disk or read from it. Names the file and says what to do.
struct JournalError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// For want of room, which may be made.
struct DiskFullError : JournalError {
  using JournalError::JournalError;
};

}  // namespace cellcal::daemon
