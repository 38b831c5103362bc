#pragma once
// The emulated sensor on Ethernet, in real time on a UDP socket: the firmware's core with its rule of
// one host at a time.

#include "sim/mcu/mcu_thread.h"

namespace cellcal::sim {

struct McuUdpOptions {
  McuOptions mcu;
  std::string address = "127.0.0.1";
  std::uint16_t port = 0;  ///< 0: a free one
  bool realtime = false;   ///< SCHED_FIFO, if permitted
};

/// Options of the board on Ethernet: 100 Mbit/s, datagrams.
McuOptions on_ethernet(McuOptions options);

/// Construction opens the socket and starts the thread; throws std::system_error. Destruction closes
/// it: the board has no supply.
class McuUdp final : public McuThread {
 public:
  explicit McuUdp(const McuUdpOptions& options);
  ~McuUdp() override { stop(); }

 private:
  int fd() const override { return socket_.get(); }
  void read_host() override;
  bool write_host(const Microcontroller::Output& output) override;

  Fd socket_;
};

}  // namespace cellcal::sim
