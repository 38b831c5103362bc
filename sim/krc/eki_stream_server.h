#pragma once
// EkiStream in real time: a thread, a clock, and a TCP listener or UDP socket per channel file.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "sim/krc/eki_stream.h"

namespace cellcal::sim {

struct EkiStreamServerOptions {
  std::string address = "127.0.0.1";
  bool free_ports = false;  ///< any free ports instead of the files'
  bool realtime = false;    ///< SCHED_FIFO for the clock, if permitted
};

class EkiStreamServer {
 public:
  using CycleHook = std::function<void(EkiStream&, drivers::TimePoint now)>;

  EkiStreamServer(EkiStreamConfig config, EkiStreamServerOptions options, CycleHook on_cycle = {});
  ~EkiStreamServer();
  EkiStreamServer(const EkiStreamServer&) = delete;
  EkiStreamServer& operator=(const EkiStreamServer&) = delete;

  /// Opens the ports and starts the clock. Throws drivers::DriverError.
  void start();
  void stop();  ///< Idempotent; joins the thread.
  /// Runs `use` between two cycles, with exclusive access to the controller. Must be short.
  void with(const std::function<void(EkiStream&)>& use);
  std::uint16_t port(std::size_t channel) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::sim
