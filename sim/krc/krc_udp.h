#pragma once
// The emulated controller in real time: its own thread, a hard clock, and a UDP socket to the PC.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

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

class KrcUdp {
 public:
  /// Of replies to packets.
  struct ReplyTimes {
    std::size_t replies = 0;
    double median_ms = 0.0, p99_ms = 0.0, worst_ms = 0.0;
  };
  /// Called after each tick on the controller's thread: a physical cell computes the contacts
  /// between `now` and the next tick (Controller::actual_rad_at).
  using CycleHook = std::function<void(Controller&, drivers::TimePoint now)>;

  KrcUdp(ControllerConfig config, KrcUdpOptions options, CycleHook on_cycle = {});
  ~KrcUdp();
  KrcUdp(const KrcUdp&) = delete;
  KrcUdp& operator=(const KrcUdp&) = delete;

  /// Opens the socket, RSI_ON, starts the clock. Throws drivers::DriverError.
  void start();
  void stop();  ///< Idempotent; joins the thread.

  /// Runs `use` between two cycles, with exclusive access to the controller. Must be short.
  void with(const std::function<void(Controller&)>& use);
  /// Cable disconnected: neither packets nor replies pass while true; the clock continues.
  void unplug(bool unplugged);
  /// From packet to reply, over all sessions. After stop().
  ReplyTimes reply_times() const;
  bool realtime_granted() const;   ///< requested and permitted
  std::uint64_t overruns() const;  ///< ticks more than half a cycle late

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::sim
