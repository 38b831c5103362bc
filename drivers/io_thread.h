#pragma once
// One io_context on one thread: it owns the robot's socket and the contact sensor's protocol. The
// sensor's bytes arrive through a queue, since reading a port can block.
//
// Real time if the machine permits it: SCHED_FIFO keeps the reply below 1 ms under CPU load, locked
// memory avoids page faults on the cycle. If not permitted the thread runs without it and reports
// each missing permission once.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace boost::asio {
class io_context;
}

namespace cellcal::drivers {

/// SCHED_FIFO 1..99; above the kernel's threaded interrupts (50).
inline constexpr int kRobotPriority = 59;

struct IoThreadOptions {
  bool realtime = true;           ///< requests SCHED_FIFO and locked memory
  int priority = kRobotPriority;  ///< of SCHED_FIFO
  bool quiet = false;             ///< no logging; warnings() reports missing permissions
  std::string name = "robot-io";  ///< at most 15 characters, as shown by top and ps
};

/// Priority of the threads that transfer the contact sensor's bytes: just
/// above the robot's. The highest requested, and granted by the service's unit (LimitRTPRIO).
inline constexpr int kPortPriority = kRobotPriority + 1;

class IoThread {
 public:
  explicit IoThread(IoThreadOptions options = {});
  ~IoThread();

  /// Starts the thread. Returns when its scheduling is settled; warnings() is then complete.
  void start();
  /// Stops running handlers and joins the thread. Objects on the context must be closed before, or
  /// destroyed after. Idempotent.
  void stop();

  boost::asio::io_context& context();
  /// Incremented ten times a second while handlers run. A watchdog compares two values without
  /// interacting with the thread.
  std::uint64_t beats() const;
  /// Missing real-time permissions, each with its remedy. Also logged, once, by start().
  const std::vector<std::string>& warnings() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::drivers
