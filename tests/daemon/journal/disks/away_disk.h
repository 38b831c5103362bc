#pragma once
// A disk under this process that gives nothing back for a while, and then all of it again.
//
// Stands in front of the system's library (pread), linked into a test. What SQLite still has in its cache (2 MB) it does not ask for.

#include <filesystem>

namespace cellcal::daemon::testing {

/// Every reading of a file below this directory is an input/output error (EIO), in this process, as long as this lives.
class AwayDisk {
 public:
  explicit AwayDisk(const std::filesystem::path& directory);
  ~AwayDisk();
  AwayDisk(const AwayDisk&) = delete;
  AwayDisk& operator=(const AwayDisk&) = delete;
};

}  // namespace cellcal::daemon::testing
