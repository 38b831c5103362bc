#pragma once
// The RSI adapter without sockets, threads or clock: datagrams and times go in, replies come out.
//
// Model: the controller adds the last correction that it accepted to the pose at RSI_ON
// (#ABSOLUTE, HOLDON=1) and reports the arm's position at the instant of IPOC. Fails safe where
// that does not hold: an arm that does not follow what is commanded is stopped and named.
//
// Not thread-safe. on_datagram() and on_tick() neither allocate, lock, log nor throw.

#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>

#include "drivers/contact.h"
#include "drivers/kuka/moves/core_result.h"
#include "drivers/kuka/rsi/rsi_config.h"
#include "drivers/kuka/rsi/rsi_report.h"
#include "drivers/robot.h"

namespace cellcal::drivers {

class RsiCore {
 public:
  /// Throws ConfigError. `guard` may be null: then searches are refused. It must outlive the core.
  RsiCore(RsiConfig config, ContactGuard* guard);
  ~RsiCore();
  RsiCore(const RsiCore&) = delete;
  RsiCore& operator=(const RsiCore&) = delete;

  /// One packet of the controller, arrived at t_rx. Returns what to send back at once, valid until
  /// the next call, or empty: nothing must be sent.
  std::string_view on_datagram(std::string_view bytes, TimePoint t_rx);
  /// Notices silence. Call at least once per cycle, packets or not.
  void on_tick(TimePoint now);

  /// As drivers::Robot. They take effect with the next datagram or tick.
  void begin(const Move& move);
  void stop();
  void rereference();
  /// Ends the controller's session: rest, then 'Stop' in every reply until it falls silent.
  void end_session();
  bool end_sent() const;  ///< at least one reply with 'Stop' went out

  std::optional<MoveResult> poll();
  RobotState state() const;

  /// The same without words, for the cycle's own thread.
  std::optional<CoreResult> take_result();
  const CoreState& core_state() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::drivers
