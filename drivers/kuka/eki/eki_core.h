#pragma once
// The EKI adapter without sockets, threads or clock: bytes, connections and times go in, bytes come
// out.
//
// Model: the controller's submit program takes telegrams and sends a state every 20 ms or so, its
// robot program moves. Every state repeats what is known of the newest move, so nothing is lost
// with one state. Each connection has a session of its own: what was commanded in another one is
// void on both sides, so that neither a stale buffer nor a late telegram moves the arm.
//
// Not thread-safe. on_bytes() and on_tick() neither allocate, lock, log nor throw.

#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>

#include "drivers/contact.h"
#include "drivers/kuka/eki/eki_config.h"
#include "drivers/kuka/eki/eki_report.h"
#include "drivers/kuka/moves/core_result.h"
#include "drivers/robot.h"

namespace cellcal::drivers {

class EkiCore {
 public:
  /// Throws ConfigError. `guard` may be null: then searches are refused. It must outlive the core.
  EkiCore(EkiConfig config, ContactGuard* guard);
  ~EkiCore();
  EkiCore(const EkiCore&) = delete;
  EkiCore& operator=(const EkiCore&) = delete;

  /// A connection stands. `session`: 1..2^31-1, another one for each connection, hard to guess.
  void on_connected(std::uint32_t session, TimePoint now);
  void on_closed(TimePoint now);
  void on_bytes(std::string_view bytes, TimePoint t_rx);
  /// Asks the contact sensor, notices silence, sends beats. Every few milliseconds.
  void on_tick(TimePoint now);

  /// To be sent now, in order; `sent(n)` takes the first n of them away.
  std::string_view output() const;
  void sent(std::size_t count);
  /// The connection is of no more use: close it, then on_closed(), and connect again later.
  bool wants_close() const;

  /// As drivers::Robot. They take effect with the next tick.
  void begin(const Move& move);
  void stop();
  void rereference();
  /// Ends the session: rest, then a bye.
  void end_session();
  bool ended() const;  ///< the bye was handed out, or there is nobody to send it to

  std::optional<CoreResult> take_result();
  const EkiCoreState& core_state() const;
  std::optional<MoveResult> poll();
  RobotState state() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::drivers
