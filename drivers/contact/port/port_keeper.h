#pragma once
// Owns the port: opens it, has its bytes transferred to and from the queues, and after a loss
// closes and reopens it with back-off. Opening and closing a device can take longer than the
// robot's cycle; both happen on threads other than the robot's.

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "drivers/contact/port/port.h"
#include "drivers/contact/port/port_queues.h"

namespace cellcal::drivers {

// Transfers bytes between an open port and the queues, on two threads of its own: the only code
// that reads, writes or polls a port.
//
// Separate from the robot's thread, because reading and polling a terminal wait for the kernel's
// worker that fills it (n_tty_read, n_tty_poll: __flush_work), which has normal priority. Two
// threads, because the reader may wait there while the computer is busy, and the keep-alive must be
// sent meanwhile.

struct PortPumpOptions {
  std::uint32_t opening = 0;  ///< number of this opening for the robot's thread
  /// SCHED_FIFO priority of both threads; 0: none. Above the robot's thread, so that bytes are
  /// available before a simultaneous packet is answered. They are mostly idle, and their load is
  /// bounded: see the budget in the .cc.
  int priority = 0;
};

class PortPump {
 public:
  /// `lost` is called once, on the reader's thread, when the port is lost; nothing is read or sent
  /// from then on. The queues must outlive this object.
  PortPump(std::unique_ptr<Port> port, const PortPumpOptions& options, PortQueues& queues,
           std::function<void()> lost);
  /// Sends queued frames, joins both threads, closes the port.
  ~PortPump();
  PortPump(const PortPump&) = delete;
  PortPump& operator=(const PortPump&) = delete;

 private:
  void read_port();
  void write_port();
  void tell(const PortUpdate& news);
  void send_queued();

  const std::unique_ptr<Port> port_;
  const PortPumpOptions options_;
  PortQueues& queues_;
  const std::function<void()> lost_;
  std::atomic<bool> stop_{false};
  Call stop_reading_;
  std::thread reader_, writer_;
};

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

  /// Number of the next opening: PortUpdate of it and of later ones have at least this number.
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
