#include "drivers/kuka/rsi/rsi_delay.h"

namespace cellcal::drivers {

namespace {

// Replies not yet counted by the newest packet.
constexpr std::uint64_t kUnderWay = 2;

}  // namespace

void DelayWatch::begin_session() {
  first_.reset();
  replies_ = 0;
}

std::uint32_t DelayWatch::note(std::optional<std::uint32_t> delay) {
  if (!delay) return 0;
  const std::uint32_t more = last_ && *delay > *last_ ? *delay - *last_ : 0;
  counts_ = counts_ || more > 0;
  last_ = delay;
  return more;
}

bool DelayWatch::refused(std::uint64_t replies) const {
  return replies_ >= replies && first_ && last_ && *last_ >= *first_ &&
         *last_ - *first_ + kUnderWay >= replies_;
}

}  // namespace cellcal::drivers
