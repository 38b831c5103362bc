#pragma once
// EKI adapter without sockets, threads or clock: inputs are bytes, connection events and times,
// outputs are bytes.
//
// Model: the controller's submit program receives telegrams and sends a state about every 20 ms;
// its robot program moves. Every state repeats all information on the newest move, so that the loss
// of one state loses no information. Each connection has its own session: commands of another
// session are void on both sides, so that neither a stale buffer nor a late telegram moves the arm.
//
// Not thread-safe. on_bytes() and on_tick() neither allocate, lock, log nor throw.

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>

#include "drivers/contact.h"
#include "drivers/kuka/eki/eki_config.h"
#include "drivers/kuka/eki/eki_report.h"
#include "drivers/kuka/moves/cause.h"
#include "drivers/kuka/wire/eki_codec.h"
#include "drivers/robot.h"

namespace cellcal::drivers {

class EkiCore : public Robot {
 public:
  /// Throws ConfigError. `guard` may be null: searches are then refused. It must outlive the core.
  EkiCore(EkiConfig config, ContactGuard* guard);
  ~EkiCore() override;

  /// Connection established. `session`: 1..2^31-1, unique per connection, hard to guess.
  void on_connected(std::uint32_t session, TimePoint now);
  void on_closed(TimePoint now);
  void on_bytes(std::string_view bytes, TimePoint t_rx);
  /// Polls the contact sensor, detects silence, sends beats. To be called every few milliseconds.
  void on_tick(TimePoint now);

  /// Bytes to be sent, in order; `sent(n)` removes the first n.
  std::string_view output() const;
  void sent(std::size_t count);
  /// The connection is unusable: it must be closed, followed by on_closed() and a later reconnect.
  bool wants_close() const;

  void open() override {}
  RobotState state() const override;
  // These take effect with the next tick.
  void rereference() override;
  void begin(const Move& move) override;
  void stop() override;
  std::optional<MoveResult> poll() override;
  /// Rest, then a bye.
  void close() override;
  bool ended() const;  ///< the bye was output, or there is no connection

  /// Result without sentences, for the cycle's own thread.
  std::optional<CoreResult> next_result();
  const EkiCoreState& core_state() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Telegrams on one connection: a hello until it is obeyed, beats for the dead man; numbered, within the window that
// the controller's buffers allow, and kept until the socket has accepted them.

class EkiSender {
 public:
  /// `config` must outlive this.
  explicit EkiSender(const EkiConfig& config) : config_(config) {}

  /// New connection: telegrams count from 1 again, unconfirmed ones are cleared, and the hello is sent.
  void begin(std::uint32_t session, TimePoint now);
  /// Connection lost: discards unsent telegrams.
  void drop() { size_ = 0; }

  /// False: the window is full, or earlier bytes still wait for the socket; retry later. `urgent`: a stop or a bye,
  /// which may exceed the window by three.
  bool send(EkiCommand command, TimePoint now, bool urgent = false);
  void repeat_hello(TimePoint now);
  /// Unless something was sent recently.
  void beat(const EkiCommand& command, TimePoint now);

  /// The controller has read telegrams up to this one. False: not sent on this connection, or older than a confirmed
  /// one.
  bool confirm(std::uint32_t seq, TimePoint now);
  /// True if telegrams have been unconfirmed for so long that the controller apparently does not
  /// read them.
  bool unread(TimePoint now) const;

  std::string_view output() const { return {bytes_.data(), size_}; }
  void sent(std::size_t count);

 private:
  std::uint32_t unconfirmed() const { return seq_ - confirmed_; }

  const EkiConfig& config_;
  std::array<char, 16 * kEkiTelegram> bytes_{};
  std::size_t size_ = 0;
  std::uint32_t session_ = 0, seq_ = 0, confirmed_ = 0;
  TimePoint last_sent_{}, last_hello_{}, last_progress_{};
};

}  // namespace cellcal::drivers
