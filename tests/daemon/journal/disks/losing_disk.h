#pragma once
// A disk of this process that is cut off at some write: the process is killed there, and data not
// synchronized by then is lost, in part or completely.
//
// Interposes the system library's calls (write, pwrite, ftruncate, fsync, rename, unlink), linked
// into a test or preloaded into a program ($LOSING_DISK_DIR, _AT, _SEED). Names are kept, as on a
// file system that journals them; data are not. A synchronization takes no time.

#include <filesystem>
#include <functional>

namespace cellcal::daemon::testing {

struct Cut {
  std::filesystem::path directory;  ///< files below it
  long at = 0;                      ///< the nth call that changes one of them, from 0
  /// Unsynchronized data is kept (only the process is killed), lost, or lost sector by sector with
  /// even chances, by this seed.
  enum class Unsynced { kStays, kLost, kTorn } unsynced = Unsynced::kStays;
  unsigned seed = 1;
};

/// Runs `act` in a child process with that disk. True: it was cut off. False: it completed, or
/// failed, which is an error of the test.
bool is_cut_in(const Cut& cut, const std::function<void()>& act);

/// During its lifetime every change from the nth one on below this directory fails with this error
/// number (ENOSPC, EROFS), in this process.
class FailingDisk {
 public:
  FailingDisk(const std::filesystem::path& directory, long at, int error);
  ~FailingDisk();
  FailingDisk(const FailingDisk&) = delete;
  FailingDisk& operator=(const FailingDisk&) = delete;
  /// True once it has failed.
  bool has_failed() const;
};

}  // namespace cellcal::daemon::testing
