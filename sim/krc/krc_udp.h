#pragma once
// The emulated controller in real time: its own thread, a hard clock, and a UDP socket to the PC.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "sim/hard_clock.h"
#include "sim/krc/controller.h"

namespace cellcal::sim {

struct KrcUdpOptions {
  std::string pc_address = "127.0.0.1";
  std::uint16_t pc_port = 49152;
  /// Operator: seconds after RSI has stopped, by a fault or by STOP, until the program is
  /// restarted; empty: never.
  std::optional<double> restart_after_s;
  bool realtime = false;  ///< SCHED_FIFO for the clock, if permitted
};

class KrcUdp : public InRealTime<Controller> {
 public:
  /// Of replies to packets.
  struct ReplyTimes {
    std::size_t replies = 0;
    double median_ms = 0.0, p99_ms = 0.0, worst_ms = 0.0;
  };

  KrcUdp(ControllerConfig config, KrcUdpOptions options, CycleHook on_cycle = {});
  ~KrcUdp() override;

  /// Opens the socket, RSI_ON, starts the clock. Throws drivers::DriverError.
  void start();
  /// Cable disconnected: neither packets nor replies pass while true; the clock continues.
  void unplug(bool unplugged) { unplugged_ = unplugged; }
  /// From packet to reply, over all sessions. After stop().
  ReplyTimes reply_times() const;

 private:
  void open_socket();
  void cycle(drivers::TimePoint now) override;
  void read_replies();
  void operate(drivers::TimePoint now);

  class ReplyClock;
  KrcUdpOptions options_;
  int socket_ = -1;
  std::unique_ptr<ReplyClock> replies_;
  std::optional<drivers::TimePoint> stopped_at_;
  std::atomic<bool> unplugged_{false};
};

}  // namespace cellcal::sim
