#pragma once
// RSI adapter without sockets, threads or clock: inputs are datagrams and times, outputs are
// replies.
//
// Model: the controller adds the last accepted correction to the pose at RSI_ON (#ABSOLUTE,
// HOLDON=1) and reports the arm's position at the instant of IPOC. Fails safe if that does not
// hold: an arm that does not follow the command is stopped, and the axis reported.
//
// Not thread-safe. on_datagram() and on_tick() neither allocate, lock, log nor throw.

#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>

#include "drivers/contact.h"
#include "drivers/kuka/moves/move_queue.h"
#include "drivers/kuka/rsi/rsi_config.h"
#include "drivers/kuka/rsi/rsi_report.h"
#include "drivers/robot.h"

namespace cellcal::drivers {

/// As a drivers::Robot in the caller's thread, whose owner passes the datagrams of the controller: for virtual time.
class RsiCore final : public Robot {
 public:
  /// Throws ConfigError. `guard` may be null: searches are then refused. It must outlive the core.
  RsiCore(RsiConfig config, ContactGuard* guard);
  ~RsiCore() override;

  /// One packet of the controller, arrived at t_rx. Returns the reply to be sent immediately, valid
  /// until the next call; empty: no reply must be sent.
  std::string_view on_datagram(std::string_view bytes, TimePoint t_rx);
  /// Detects silence. To be called at least once per cycle, with or without packets.
  void on_tick(TimePoint now);

  void open() override {}
  RobotState state() const override;
  // These take effect with the next datagram or tick.
  void rereference() override;
  void begin(const Move& move) override;
  void stop() override;
  std::optional<MoveResult> poll() override;
  /// Rest, then 'Stop' in every reply until the controller is silent.
  void close() override;
  bool end_sent() const;  ///< at least one reply with 'Stop' was output

  /// Result without sentences, for the cycle's own thread.
  std::optional<CoreResult> next_result();
  const CoreState& core_state() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::drivers
