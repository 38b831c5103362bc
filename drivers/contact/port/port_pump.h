#pragma once
// Carries bytes between an open port and the queues, on two threads of its own: the only code that
// reads, writes or polls a port.
//
// Why not on the robot's thread: reading and polling a terminal wait for the kernel's worker that
// fills it (n_tty_read, n_tty_poll: __flush_work), and that worker has normal priority. Why two:
// the reader may wait there for as long as the computer is busy, and the keep-alive must go out
// meanwhile.

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <thread>

#include "drivers/contact/port/port.h"
#include "drivers/contact/port/port_queues.h"

namespace cellcal::drivers {

struct PortPumpOptions {
  std::uint32_t opening = 0;  ///< number under which the robot's thread knows this opening
  /// SCHED_FIFO for both threads; 0: none. Above the robot's thread, so that bytes are there before
  /// the packet that comes at the same time is answered. They wait nearly always, and what they
  /// do is bounded: see the budget in the .cc.
  int priority = 0;
};

class PortPump {
 public:
  /// `lost` is called once, on the reader's thread, when the port is lost; nothing is read or sent
  /// from then on. The queues must outlive this.
  PortPump(std::unique_ptr<Port> port, const PortPumpOptions& options, PortQueues& queues,
           std::function<void()> lost);
  /// What is queued goes out, both threads end, the port is closed.
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
