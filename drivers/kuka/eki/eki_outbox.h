#pragma once
// Telegrams in transit: numbered, within the window that the controller's buffers allow, and kept
// until the socket has accepted them.

#include <array>
#include <cstdint>
#include <string_view>

#include "drivers/kuka/eki/eki_config.h"
#include "drivers/kuka/wire/eki_codec.h"

namespace cellcal::drivers {

class EkiOutbox {
 public:
  /// New connection: telegrams count from 1 again.
  void begin(std::uint32_t session);
  /// Connection lost: discards unsent telegrams.
  void drop() { size_ = 0; }

  /// False: the window is full, or earlier bytes still wait for the socket. `urgent`: stops may
  /// exceed the window by three.
  bool send(EkiCommand command, std::size_t axes, int window, bool urgent);
  /// Newest number received by the controller. False: not sent on this connection, or older than a
  /// confirmed one.
  bool confirm(std::uint32_t seq);
  std::uint32_t unconfirmed() const { return seq_ - confirmed_; }

  std::string_view output() const { return {bytes_.data(), size_}; }
  void sent(std::size_t count);

 private:
  std::array<char, 16 * kEkiTelegram> bytes_{};
  std::size_t size_ = 0;
  std::uint32_t session_ = 0, seq_ = 0, confirmed_ = 0;
};

// Scheduling of telegrams on one connection: a hello until it is obeyed, beats for the dead man,
// telegrams within the window.

class EkiSender {
 public:
  /// `config` must outlive this.
  explicit EkiSender(const EkiConfig& config) : config_(config) {}

  /// New connection: clears unconfirmed telegrams, and sends the hello.
  void begin(std::uint32_t session, TimePoint now);
  void drop() { outbox_.drop(); }

  /// False: the window is full; retry later. `urgent`: a stop or a bye, which has a reserve of its
  /// own.
  bool send(const EkiCommand& command, TimePoint now, bool urgent = false);
  void repeat_hello(TimePoint now);
  void beat(TimePoint now);

  /// The controller has read telegrams up to this one. False: impossible on this connection.
  bool confirm(std::uint32_t seq, TimePoint now);
  /// True if telegrams have been unconfirmed for so long that the controller apparently does not
  /// read them.
  bool unread(TimePoint now) const;

  std::string_view output() const { return outbox_.output(); }
  void sent(std::size_t count) { outbox_.sent(count); }

 private:
  const EkiConfig& config_;
  EkiOutbox outbox_;
  TimePoint last_sent_{}, last_hello_{}, last_progress_{};
};

}  // namespace cellcal::drivers
