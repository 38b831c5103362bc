#pragma once
// Common parts of the benchmarks of the wires: a UDP socket on the loopback, a pseudo-terminal, and
// real-time priority for the threads that emulate hardware.

#include <cstdint>
#include <string>

#include "drivers/io_thread.h"

namespace cellcal::bench {

/// For threads that emulate hardware: their delays are not the driver's.
inline constexpr int kHardwarePriority = drivers::kRobotPriority + 10;
/// For a thread that is compared with the driver.
inline constexpr int kDriverPriority = drivers::IoThreadOptions{}.priority;

/// SCHED_FIFO for the calling thread. False if not permitted.
bool request_realtime(int priority);

/// Bound to a free port of 127.0.0.1. Throws std::runtime_error.
class Udp {
 public:
  Udp();
  ~Udp();
  Udp(const Udp&) = delete;
  Udp& operator=(const Udp&) = delete;
  /// All data are sent there, and received from there only.
  void connect(std::uint16_t port);
  std::uint16_t port() const;
  int fd() const { return fd_; }

 private:
  int fd_ = -1;
};

/// Raw, its master end non-blocking. The slave end is kept open, so that the end of a driver is no
/// hang-up. Throws std::runtime_error.
class Terminal {
 public:
  Terminal();
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;
  int master() const { return master_; }
  const std::string& path() const { return path_; }  ///< of the slave end

 private:
  int master_ = -1, slave_ = -1;
  std::string path_;
};

}  // namespace cellcal::bench
