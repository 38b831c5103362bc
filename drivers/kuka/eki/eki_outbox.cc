#include "drivers/kuka/eki/eki_outbox.h"

#include <algorithm>

namespace cellcal::drivers {
namespace {

constexpr std::uint32_t kStopReserve = 3;

}  // namespace

void EkiOutbox::begin(std::uint32_t session) {
  session_ = session;
  seq_ = confirmed_ = 0;
  size_ = 0;
}

bool EkiOutbox::send(EkiCommand command, std::size_t axes, int window, bool urgent) {
  if (unconfirmed() >= static_cast<std::uint32_t>(window) + (urgent ? kStopReserve : 0)) {
    return false;
  }
  command.session = session_;
  command.seq = seq_ + 1;
  command.target_deg.resize(axes, 0.0);
  const std::string_view text =
      format_command(command, std::span(bytes_).subspan(size_, bytes_.size() - size_));
  if (text.empty()) return false;
  size_ += text.size();
  ++seq_;
  return true;
}

bool EkiOutbox::confirm(std::uint32_t seq) {
  if (seq > seq_ || seq < confirmed_) return false;
  confirmed_ = seq;
  return true;
}

void EkiOutbox::sent(std::size_t count) {
  count = std::min(count, size_);
  std::copy(bytes_.data() + count, bytes_.data() + size_, bytes_.data());
  size_ -= count;
}

}  // namespace cellcal::drivers
