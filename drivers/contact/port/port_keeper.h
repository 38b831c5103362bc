#pragma once
// Owns the port: opens it, has its bytes transferred to and from the queues, and after a loss
// closes and reopens it with back-off. Opening and closing a device can take longer than the
// robot's cycle; both happen on threads other than the robot's.

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "drivers/contact/port/port.h"
#include "drivers/contact/port/port_pump.h"
#include "drivers/contact/port/port_queues.h"

namespace cellcal::drivers {

struct PortKeeperOptions {
  PortOptions port;
  std::chrono::milliseconds first, longest;  ///< pauses between attempts
};

class PortKeeper {
 public:
  /// The queues must outlive this object.
  PortKeeper(PortKeeperOptions options, PortQueues& queues);
  ~PortKeeper();
  PortKeeper(const PortKeeper&) = delete;
  PortKeeper& operator=(const PortKeeper&) = delete;

  /// Number of the next opening: PortNews of it and of later ones have at least this number.
  std::uint32_t next_opening() const;
  /// Opens the port, which must be closed, on this thread. Throws DriverError.
  void open();
  /// Sends queued frames, closes the port, and stops reopening.
  void close();
  /// Error of the last attempt; empty if there was none since the loss of the port.
  std::string last_error() const;
  /// Warning of the port as last opened.
  std::string warning() const;

 private:
  void run();
  std::unique_ptr<PortPump> open_now();

  const PortKeeperOptions options_;
  PortQueues& queues_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::unique_ptr<PortPump> pump_;
  std::uint32_t openings_ = 0;
  std::string last_error_, warning_;
  bool stop_ = false, wanted_ = false, lost_ = false, busy_ = false;
  std::thread thread_;
};

}  // namespace cellcal::drivers
