#pragma once
// The emulated EKI controller in real time: its own thread, its own clock, and a TCP server.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "sim/krc/eki_controller.h"

namespace cellcal::sim {

struct EkiServerOptions {
  std::string address = "127.0.0.1";
  /// 0: a free one. Empty: from the channel file.
  std::optional<std::uint16_t> port;
  bool realtime = false;  ///< SCHED_FIFO for the clock, if permitted
};

class EkiServer {
 public:
  /// Called after each cycle on the controller's thread: a physical cell computes the contacts
  /// between `now` and the next cycle.
  using CycleHook = std::function<void(EkiController&, drivers::TimePoint now)>;

  EkiServer(EkiControllerConfig config, EkiServerOptions options, CycleHook on_cycle = {});
  ~EkiServer();
  EkiServer(const EkiServer&) = delete;
  EkiServer& operator=(const EkiServer&) = delete;

  /// Listens, starts the program and the clock. Throws drivers::DriverError.
  void start();
  void stop();  ///< Idempotent; joins the thread.

  /// Runs `use` between two cycles, with exclusive access to the controller. Must be short.
  void with(const std::function<void(EkiController&)>& use);
  /// Cable disconnected: no data in either direction while true, without notification.
  void unplug(bool unplugged);
  std::uint16_t port() const;
  std::uint64_t refused_clients() const;  ///< while another one was connected

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::sim
