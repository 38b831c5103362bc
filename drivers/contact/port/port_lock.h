#pragma once
// Exclusive use of a serial device per process: a lock file, held by flock so that a crash releases
// it.

#include <string>

namespace cellcal::drivers {

class PortLock {
 public:
  /// Locks the device of this path (symlinks resolved). Throws DriverError if another process, or
  /// another port of this one, holds it.
  explicit PortLock(const std::string& device);
  ~PortLock();
  PortLock(const PortLock&) = delete;
  PortLock& operator=(const PortLock&) = delete;

 private:
  int fd_ = -1;
};

/// Name of the lock file of a device: LCK..ttyUSB0, LCK..pts-3 (as used by minicom and others).
std::string lock_name(const std::string& device);

}  // namespace cellcal::drivers
