#pragma once
// The EKI adapter as a drivers::Robot: a TCP client on the robot's I/O thread, and, for virtual
// time, in the caller's thread.

#include <cstdint>
#include <memory>
#include <optional>

#include "drivers/contact.h"
#include "drivers/kuka/eki/eki_config.h"
#include "drivers/kuka/eki/eki_core.h"
#include "drivers/robot.h"

namespace boost::asio {
class io_context;
}

namespace cellcal::drivers {

/// Threads: the socket and the core live on the io_context's thread; the functions of Robot are
/// called from one other thread and communicate through lock-free queues. The guard is polled on
/// the io_context's thread and has to live there.
///
/// A broken or failed connection is retried every half second. Nothing moves on a new connection
/// before rereference().
class EkiRobot final : public Robot {
 public:
  /// Throws ConfigError. Context and guard must outlive the robot, and the context must run until
  /// the robot is destroyed.
  EkiRobot(boost::asio::io_context& context, EkiConfig config, ContactGuard* guard);
  ~EkiRobot() override;

  /// Starts connecting. Throws DriverError for an invalid address. May be called again after
  /// close().
  void open() override;
  RobotState state() const override;
  void rereference() override;
  void begin(const Move& move) override;
  void stop() override;
  std::optional<MoveResult> poll() override;
  /// Rest and a bye (at most 3 s), then the connection is closed; returns immediately.
  void close() override;

  bool is_open() const;  ///< until the close has completed
  /// Source of state(), for EKI-specific figures.
  EkiCoreState core_state() const;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

/// Single-threaded variant: the owner of the emulated controller passes connections and bytes.
class EkiRobotInline final : public EkiCore {
 public:
  using EkiCore::EkiCore;

  /// Open but not connected: the caller has to connect and call on_connected().
  bool wants_connection() const { return open_ && !core_state().connected; }
  bool wants_close() const { return EkiCore::wants_close() || (!open_ && ended()); }
  void on_connected(TimePoint now) { EkiCore::on_connected(++session_, now); }

  void open() override { open_ = true; }
  void close() override {
    open_ = false;
    EkiCore::close();
  }

 private:
  bool open_ = false;
  std::uint32_t session_ = 1000;
};

}  // namespace cellcal::drivers
