#pragma once
// Telegrams in transit: numbered, within the window that the controller's buffers allow, and kept
// until the socket has accepted them.

#include <array>
#include <cstdint>
#include <string_view>

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

}  // namespace cellcal::drivers
