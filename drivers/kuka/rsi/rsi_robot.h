#pragma once
// The RSI adapter as a drivers::Robot: on a UDP socket of the robot's I/O thread, and, for virtual
// time, in the caller's thread.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "drivers/contact.h"
#include "drivers/kuka/rsi/rsi_config.h"
#include "drivers/kuka/rsi/rsi_core.h"
#include "drivers/kuka/rsi/rsi_report.h"
#include "drivers/robot.h"

namespace boost::asio {
class io_context;
}

namespace cellcal::drivers {

/// Threads: the socket and the core live on the io_context's thread; the functions of Robot are
/// called from one other thread and communicate through lock-free queues. The guard is polled on
/// the io_context's thread and has to live there (the contact sensor on the same context does).
class RsiRobot final : public Robot {
 public:
  /// Throws ConfigError. Context and guard must outlive the robot, and the context must run until
  /// the robot is destroyed.
  RsiRobot(boost::asio::io_context& context, RsiConfig config, ContactGuard* guard);
  ~RsiRobot() override;

  /// Binds exclusively. Throws DriverError naming address and port. May be called again after
  /// close().
  void open() override;
  RobotState state() const override;
  void rereference() override;
  void begin(const Move& move) override;
  void stop() override;
  std::optional<MoveResult> poll() override;
  /// Rest, Stop, then replies until the controller is silent (at most 2 s); returns immediately.
  void close() override;

  bool is_open() const;        ///< until the close has completed
  std::uint16_t port() const;  ///< bound port, 0 while closed
  /// Time from reading a datagram from the socket to writing the reply. Any thread.
  const ReplyHistogram& reply_times() const;
  std::uint64_t foreign_packets() const;  ///< from addresses other than the first: ignored
  /// Source of state(), for RSI-specific figures.
  CoreState core_state() const;
  /// Address of the controller; empty before its first packet.
  std::string sender() const;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

/// Single-threaded variant.
using RsiRobotInline = RsiCore;

}  // namespace cellcal::drivers
