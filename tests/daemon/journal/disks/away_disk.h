#pragma once
// A disk of this process that is temporarily unreadable, and then completely readable again.
//
// Interposes the system library's calls (pread), linked into a test. Data in SQLite's cache (2 MB) is not read.

#include <filesystem>

namespace cellcal::daemon::testing {

/// During its lifetime every read of a file below this directory fails with EIO, in this process.
class AwayDisk {
 public:
  explicit AwayDisk(const std::filesystem::path& directory);
  ~AwayDisk();
  AwayDisk(const AwayDisk&) = delete;
  AwayDisk& operator=(const AwayDisk&) = delete;
};

}  // namespace cellcal::daemon::testing
