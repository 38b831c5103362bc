#pragma once
// Telegrams on their way: numbered, within the window that the controller's buffers allow, and kept
// until the socket has taken them.

#include <array>
#include <cstdint>
#include <string_view>

#include "drivers/kuka/wire/eki_codec.h"

namespace cellcal::drivers {

class EkiOutbox {
 public:
  /// A new connection: telegrams count from 1 again.
  void begin(std::uint32_t session);
  /// The connection is gone, and what was not sent with it.
  void drop() { size_ = 0; }

  /// False: the window is full, or the bytes wait for the socket. `urgent`: stops may go beyond the
  /// window by three.
  bool send(EkiCommand command, std::size_t axes, int window, bool urgent);
  /// The controller's newest number. False: one that this connection has not reached, or has left.
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
