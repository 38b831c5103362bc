// The exchange of a frame on a TCP socket, in the caller's thread.

#include <random>

#include "drivers/kuka/eki/eki_aside.h"
#include "drivers/kuka/eki/eki_frames.h"

namespace cellcal::drivers {
namespace {

std::uint32_t draw_ask() {
  std::random_device device;
  return std::uniform_int_distribution<std::uint32_t>(1, 0x7FFFFFFE)(device);
}

/// Runs the exchange on a connection. `chosen`: set once the choice was called.
EkiFrameResult exchange_on(EkiAsideLine& line, const EkiFrameRequest& request,
                           const EkiFrameChoice& choice, bool& chosen) {
  EkiFrameExchange exchange(request, draw_ask(), std::chrono::steady_clock::now());
  for (;;) {
    line.run(exchange);
    const EkiFrameResult result = *exchange.result();
    if (!choice || chosen || result.end != EkiFrameEnd::kRead) return result;
    chosen = true;
    const auto values = choice(*result.new_values);
    if (!values) return result;
    exchange.set(*values, draw_ask(), std::chrono::steady_clock::now());
  }
}

/// True if the controller did not serve this client, and no modifying request was sent.
bool may_be_tried_again(const EkiFrameResult& result) {
  return result.end == EkiFrameEnd::kNotSent && (result.trouble == EkiFrameTrouble::kClosed ||
                                                 result.trouble == EkiFrameTrouble::kNoState);
}

}  // namespace

EkiFrameResult exchange_frame(const std::string& address, std::uint16_t port,
                              const EkiFrameRequest& request, const EkiFrameChoice& choice,
                              const EkiReconnectLimits& limits) {
  EkiAsideLine line(address, port, limits.stop);
  EkiFrameResult result;
  bool chosen = false;
  for (const TimePoint begun = std::chrono::steady_clock::now();;) {
    result = {};
    if (const std::string failure = line.connect(); !failure.empty()) {
      result.trouble = EkiFrameTrouble::kNoConnection;
      result.detail = failure;
    } else {
      result = exchange_on(line, request, choice, chosen);
    }
    const TimePoint now = std::chrono::steady_clock::now();
    if (chosen || !may_be_tried_again(result) || now - begun > limits.reopens_within ||
        limits.stop.stop_requested())
      break;
    steady_clock().sleep_until(now + kEkiReopenPause);
  }
  result.peer = line.peer();
  return result;
}

}  // namespace cellcal::drivers
