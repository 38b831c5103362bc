#pragma once
// Scheduling of telegrams on one connection: a hello until it is obeyed, beats for the dead man,
// telegrams within the window.

#include <cstdint>
#include <string_view>

#include "drivers/kuka/eki/eki_config.h"
#include "drivers/kuka/eki/eki_outbox.h"

namespace cellcal::drivers {

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
