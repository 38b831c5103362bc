#pragma once
// The RSI adapter as a drivers::Robot: on a UDP socket of the robot's I/O thread, and, for virtual
// time, in the caller's own thread.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/contact.h"
#include "drivers/kuka/rsi/reply_histogram.h"
#include "drivers/kuka/rsi/rsi_config.h"
#include "drivers/kuka/rsi/rsi_core.h"
#include "drivers/robot.h"

namespace boost::asio {
class io_context;
}

namespace cellcal::drivers {

/// Threads: the socket and the core live on the io_context's thread; the calls of Robot come from
/// one other thread and cross through lock-free queues. The guard is asked on the io_context's
/// thread, so it has to live there too (the contact sensor on the same context does).
class RsiRobot final : public Robot {
 public:
  /// Throws ConfigError. Context and guard must outlive the robot, and the context must run until
  /// the robot is destroyed.
  RsiRobot(boost::asio::io_context& context, RsiConfig config, ContactGuard* guard);
  ~RsiRobot() override;

  /// Binds exclusively. Throws DriverError naming address and port. Again after close(): allowed.
  void open() override;
  RobotState state() const override;
  void rereference() override;
  void begin(const Move& move) override;
  void stop() override;
  std::optional<MoveResult> poll() override;
  /// Rest, Stop, then replies until the controller is silent (at most 2 s); returns at once.
  void close() override;

  bool is_open() const;        ///< until the close has ended
  std::uint16_t port() const;  ///< bound port, 0 while closed
  /// Datagram taken from the socket to reply handed back to it. Any thread.
  const ReplyHistogram& reply_times() const;
  std::uint64_t foreign_packets() const;  ///< from other addresses than the first: ignored
  /// What state() is made of: for figures that only RSI has.
  CoreState core_state() const;
  /// Address of the controller that is listened to; empty before its first packet.
  std::string sender() const;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

/// The same in one thread: whoever owns the emulated controller passes its datagrams in.
class RsiRobotInline final : public Robot {
 public:
  RsiRobotInline(RsiConfig config, ContactGuard* guard) : core_(std::move(config), guard) {}

  std::string_view on_datagram(std::string_view bytes, TimePoint t_rx) {
    return core_.on_datagram(bytes, t_rx);
  }
  void on_tick(TimePoint now) { core_.on_tick(now); }

  void open() override {}
  RobotState state() const override { return core_.state(); }
  void rereference() override { core_.rereference(); }
  void begin(const Move& move) override { core_.begin(move); }
  void stop() override { core_.stop(); }
  std::optional<MoveResult> poll() override { return core_.poll(); }
  void close() override { core_.end_session(); }

 private:
  RsiCore core_;
};

}  // namespace cellcal::drivers
