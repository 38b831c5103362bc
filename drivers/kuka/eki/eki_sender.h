#pragma once
// What is said to the controller on one connection, and when: a hello until it is obeyed, beats so
// that its dead man hears them, telegrams within the window.

#include <cstdint>
#include <string_view>

#include "drivers/kuka/eki/eki_config.h"
#include "drivers/kuka/eki/eki_outbox.h"

namespace cellcal::drivers {

class EkiSender {
 public:
  /// `config` must outlive this.
  explicit EkiSender(const EkiConfig& config) : config_(config) {}

  /// Another connection: nothing is unconfirmed, and the hello goes out.
  void begin(std::uint32_t session, TimePoint now);
  void drop() { outbox_.drop(); }

  /// False: the window is full; ask again later. `urgent`: a stop or a bye, which has room of its
  /// own.
  bool send(const EkiCommand& command, TimePoint now, bool urgent = false);
  void repeat_hello(TimePoint now);
  void beat(TimePoint now);

  /// The controller has read telegrams up to this one. False: it cannot have, on this connection.
  bool confirm(std::uint32_t seq, TimePoint now);
  /// Telegrams wait for so long that the controller does not seem to read them.
  bool unread(TimePoint now) const;

  std::string_view output() const { return outbox_.output(); }
  void sent(std::size_t count) { outbox_.sent(count); }

 private:
  const EkiConfig& config_;
  EkiOutbox outbox_;
  TimePoint last_sent_{}, last_hello_{}, last_progress_{};
};

}  // namespace cellcal::drivers
