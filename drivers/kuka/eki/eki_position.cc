#include "drivers/kuka/eki/eki_position.h"

namespace cellcal::drivers {
namespace {

using namespace std::chrono_literals;

// The controller obeys a disconnected session until it detects the disconnection; states arrive every 12
// to 100 ms.
constexpr Duration kPositionLimit = 3s, kPositionStatesCease = 1s;

bool may_come_again(EkiPositionTrouble trouble) {
  return trouble == EkiPositionTrouble::kClosed || trouble == EkiPositionTrouble::kNoState;
}

}  // namespace

void EkiPositionReading::on_bytes(std::string_view bytes, TimePoint now) {
  for (const char c : bytes) {
    if (result_) return;
    const EkiFramer::Event event = framer_.push(c);
    if (event == EkiFramer::Event::kOversized) return end(EkiPositionTrouble::kNotAStream);
    if (event != EkiFramer::Event::kDocument ||
        parser_.parse_state(framer_.document(), state_) != EkiError::kNone)
      continue;
    heard_at_ = now;
    const bool stands = rest_.look(state_, now);
    if (state_.session != 0) {
      in_the_way_ = EkiPositionTrouble::kInSession;
    } else if (!stands) {
      in_the_way_ = EkiPositionTrouble::kMoves;
    } else {
      end(EkiPositionTrouble::kNone);
    }
  }
}

void EkiPositionReading::on_tick(TimePoint now) {
  if (now - begun_ > kPositionLimit)
    end(now - heard_at_ > kPositionStatesCease ? EkiPositionTrouble::kNoState : in_the_way_);
}

void EkiPositionReading::end(EkiPositionTrouble why) {
  if (result_) return;
  result_.emplace();
  result_->trouble = why;
  if (why == EkiPositionTrouble::kNone) result_->axes_deg = state_.axes_deg;
}

EkiPosition read_position(const std::string& address, std::uint16_t port,
                          const EkiReconnectLimits& limits) {
  EkiAsideLine line(address, port, limits.stop);
  EkiPosition position;
  for (const TimePoint begun = std::chrono::steady_clock::now();;) {
    position = {};
    if (const std::string failure = line.connect(); !failure.empty()) {
      position.trouble = EkiPositionTrouble::kNoConnection;
      position.detail = failure;
    } else {
      EkiPositionReading reading(std::chrono::steady_clock::now());
      line.run(reading);
      position = *reading.result();
    }
    const TimePoint now = std::chrono::steady_clock::now();
    if (!may_come_again(position.trouble) || now - begun > limits.reopens_within ||
        limits.stop.stop_requested())
      break;
    steady_clock().sleep_until(now + kEkiReopenPause);
  }
  position.peer = line.peer();
  return position;
}

}  // namespace cellcal::drivers
