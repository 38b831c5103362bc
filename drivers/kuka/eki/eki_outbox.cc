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

namespace {

constexpr std::chrono::milliseconds kHelloPeriod{500};

Duration duration(double s) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(s));
}

}  // namespace

void EkiSender::begin(std::uint32_t session, TimePoint now) {
  outbox_.begin(session);
  last_progress_ = now;
  last_hello_ = now - kHelloPeriod;
  repeat_hello(now);
}

bool EkiSender::send(const EkiCommand& command, TimePoint now, bool urgent) {
  const bool idle = outbox_.unconfirmed() == 0;
  if (!outbox_.send(command, config_.limits.size(), config_.window, urgent)) return false;
  if (idle) last_progress_ = now;
  last_sent_ = now;
  return true;
}

void EkiSender::repeat_hello(TimePoint now) {
  if (now - last_hello_ < kHelloPeriod) return;
  EkiCommand hello;
  hello.type = EkiType::kHello;
  send(hello, now);
  last_hello_ = now;
}

void EkiSender::beat(TimePoint now) {
  if (now - last_sent_ >= duration(config_.beat_s)) send({}, now);
}

bool EkiSender::confirm(std::uint32_t seq, TimePoint now) {
  const std::uint32_t unconfirmed = outbox_.unconfirmed();
  if (!outbox_.confirm(seq)) return false;
  if (outbox_.unconfirmed() < unconfirmed) last_progress_ = now;
  return true;
}

bool EkiSender::unread(TimePoint now) const {
  return outbox_.unconfirmed() > 0 && now - last_progress_ > duration(config_.silence_s);
}

}  // namespace cellcal::drivers
