#pragma once
// Owns the port: opens it, has its bytes carried to and from the queues, and when it is lost closes
// it and opens it again with back-off. Opening and closing a device can take longer than the
// robot's cycle lasts; all of it happens on other threads than the robot's.

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
  std::chrono::milliseconds first, longest;  ///< pauses before it is tried again
};

class PortKeeper {
 public:
  /// The queues must outlive this.
  PortKeeper(PortKeeperOptions options, PortQueues& queues);
  ~PortKeeper();
  PortKeeper(const PortKeeper&) = delete;
  PortKeeper& operator=(const PortKeeper&) = delete;

  /// The number of the next opening: PortNews of it, and of all that follow, bear this or more.
  std::uint32_t next_opening() const;
  /// Opens the port, which must be closed, on this thread. Throws DriverError.
  void open();
  /// What is queued goes out, the port is closed, and nothing is tried again.
  void close();
  /// Why the last attempt failed; empty when there was none since the port was lost.
  std::string last_error() const;
  /// Of the port as it was last opened.
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
