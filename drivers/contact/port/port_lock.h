#pragma once
// One process per serial device: a lock file, held by flock so that a crash releases it.

#include <string>

namespace cellcal::drivers {

class PortLock {
 public:
  /// Locks the device of this path (symlinks already followed). Throws DriverError if another
  /// process, or another port of this one, holds it.
  explicit PortLock(const std::string& device);
  ~PortLock();
  PortLock(const PortLock&) = delete;
  PortLock& operator=(const PortLock&) = delete;

 private:
  int fd_ = -1;
};

/// Lock file's name for a device: LCK..ttyUSB0, LCK..pts-3 (the names that minicom and others use).
std::string lock_name(const std::string& device);

}  // namespace cellcal::drivers
