#pragma once
// A disk under this process that is cut off at some write: the process is killed there, and what was
// not synchronized by then is lost, in part or wholly.
//
// Stands in front of the system's library (write, pwrite, ftruncate, fsync, rename, unlink), linked
// into a test or preloaded into a program ($LOSING_DISK_DIR, _AT, _SEED). Names are kept, as on a
// file system that journals them; data are not. A synchronization takes no time.

#include <filesystem>
#include <functional>

namespace cellcal::daemon::testing {

struct Cut {
  std::filesystem::path directory;  ///< files below it
  long at = 0;                      ///< the nth call that changes one of them, from 0
  /// What was not synchronized stays (the process alone was killed), is lost, or is lost sector by
  /// sector with even chances, by this seed.
  enum class Unsynced { kStays, kLost, kTorn } unsynced = Unsynced::kStays;
  unsigned seed = 1;
};

/// Runs `act` in a child process with that disk. True: it was cut. False: it went through, or failed,
/// which is an error of the test.
bool is_cut_in(const Cut& cut, const std::function<void()>& act);

/// From the nth change below this directory on each one fails with this error number (ENOSPC, EROFS),
/// in this process, as long as this lives.
class FailingDisk {
 public:
  FailingDisk(const std::filesystem::path& directory, long at, int error);
  ~FailingDisk();
  FailingDisk(const FailingDisk&) = delete;
  FailingDisk& operator=(const FailingDisk&) = delete;
  /// It has failed by now.
  bool has_failed() const;
};

}  // namespace cellcal::daemon::testing
