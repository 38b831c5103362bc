#pragma once
// A disk that stalls: an SQLite file system whose sync waits until released.

namespace cellcal::daemon::testing {

/// Databases opened during its lifetime are on such a disk. One at a time.
class StallingDisk {
 public:
  StallingDisk();
  ~StallingDisk();
  StallingDisk(const StallingDisk&) = delete;
  StallingDisk& operator=(const StallingDisk&) = delete;

  /// From now on every sync waits for release().
  void stall();
  void release();
  /// Returns when a sync waits.
  void wait_until_stalled();
};

}  // namespace cellcal::daemon::testing
