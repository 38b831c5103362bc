#include "drivers/kuka/eki/eki_sender.h"

namespace cellcal::drivers {
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
