#pragma once
// The EKI adapter as a drivers::Robot: a TCP client on the robot's I/O thread, and, for virtual
// time, in the caller's own thread.

#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>

#include "drivers/contact.h"
#include "drivers/kuka/eki/eki_config.h"
#include "drivers/kuka/eki/eki_core.h"
#include "drivers/robot.h"

namespace boost::asio {
class io_context;
}

namespace cellcal::drivers {

/// Threads: the socket and the core live on the io_context's thread; the calls of Robot come from
/// one other thread and cross through lock-free queues. The guard is asked on the io_context's
/// thread, so it has to live there too.
///
/// A connection that breaks, or that cannot be had, is tried again every half second. Nothing moves
/// on a new connection before rereference().
class EkiRobot final : public Robot {
 public:
  /// Throws ConfigError. Context and guard must outlive the robot, and the context must run until
  /// the robot is destroyed.
  EkiRobot(boost::asio::io_context& context, EkiConfig config, ContactGuard* guard);
  ~EkiRobot() override;

  /// Begins to connect. Throws DriverError where the address is none. Again after close(): allowed.
  void open() override;
  RobotState state() const override;
  void rereference() override;
  void begin(const Move& move) override;
  void stop() override;
  std::optional<MoveResult> poll() override;
  /// Rest and a bye (at most 3 s), then the connection is closed; returns at once.
  void close() override;

  bool is_open() const;  ///< until the close has ended
  /// What state() is made of: for figures that only EKI has.
  EkiCoreState core_state() const;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

/// The same in one thread: whoever owns the emulated controller passes connections and bytes.
class EkiRobotInline final : public Robot {
 public:
  EkiRobotInline(EkiConfig config, ContactGuard* guard) : core_(std::move(config), guard) {}

  /// Open, and not connected: connect, then on_connected().
  bool wants_connection() const { return open_ && !core_.core_state().connected; }
  bool wants_close() const { return core_.wants_close() || (!open_ && core_.ended()); }
  void on_connected(TimePoint now) { core_.on_connected(++session_, now); }
  void on_closed(TimePoint now) { core_.on_closed(now); }
  void on_bytes(std::string_view bytes, TimePoint t_rx) { core_.on_bytes(bytes, t_rx); }
  void on_tick(TimePoint now) { core_.on_tick(now); }
  std::string_view output() const { return core_.output(); }
  void sent(std::size_t count) { core_.sent(count); }

  void open() override { open_ = true; }
  RobotState state() const override { return core_.state(); }
  void rereference() override { core_.rereference(); }
  void begin(const Move& move) override { core_.begin(move); }
  void stop() override { core_.stop(); }
  std::optional<MoveResult> poll() override { return core_.poll(); }
  void close() override {
    open_ = false;
    core_.end_session();
  }

 private:
  EkiCore core_;
  bool open_ = false;
  std::uint32_t session_ = 1000;
};

}  // namespace cellcal::drivers
