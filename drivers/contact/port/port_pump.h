#pragma once
// Transfers bytes between an open port and the queues, on two threads of its own: the only code
// that reads, writes or polls a port.
//
// Separate from the robot's thread, because reading and polling a terminal wait for the kernel's
// worker that fills it (n_tty_read, n_tty_poll: __flush_work), which has normal priority. Two
// threads, because the reader may wait there while the computer is busy, and the keep-alive must be
// sent meanwhile.

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <thread>

#include "drivers/contact/port/port.h"
#include "drivers/contact/port/port_queues.h"

namespace cellcal::drivers {

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
  void tell(const PortNews& news);
  void send_queued();

  const std::unique_ptr<Port> port_;
  const PortPumpOptions options_;
  PortQueues& queues_;
  const std::function<void()> lost_;
  std::atomic<bool> stop_{false};
  Call stop_reading_;
  std::thread reader_, writer_;
};

}  // namespace cellcal::drivers
