#include "drivers/kuka/eki/eki_aside.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <cmath>
#include <utility>

#include "drivers/error.h"

namespace cellcal::drivers {
namespace {

namespace asio = boost::asio;
using namespace std::chrono_literals;
using asio::ip::tcp;
using boost::system::error_code;

constexpr Duration kAsideRest = 300ms;
constexpr double kAsideRestDeg = 0.01;
constexpr Duration kAsideConnectLimit = 3s, kAsideStep = 20ms;

TimePoint clock_now() { return std::chrono::steady_clock::now(); }

}  // namespace

bool EkiRest::update(const EkiState& state, TimePoint now) {
  bool stands = rest_deg_.size() == state.axes_deg.size();
  for (std::size_t i = 0; stands && i < rest_deg_.size(); ++i)
    stands = std::abs(rest_deg_[i] - state.axes_deg[i]) < kAsideRestDeg;
  if (!stands) {
    rest_deg_ = state.axes_deg;
    since_ = now;
  }
  return state.progress != EkiProgress::kMoving && now - since_ >= kAsideRest;
}

struct EkiAsideLine::Impl {
  Impl(asio::ip::address host, std::uint16_t port, std::stop_token given)
      : peer(host, port), stop(std::move(given)) {}

  /// Runs the operation until it has ended, or cancels it at `until`.
  error_code finish(const std::optional<error_code>& done, TimePoint until) {
    context.restart();
    while (!done && clock_now() < until && !stop.stop_requested())
      context.run_one_until(std::min(until, clock_now() + kAsideStep));
    if (done) return *done;
    error_code ignored_on_purpose;  // the handler is then called with an error of its own
    socket.cancel(ignored_on_purpose);
    context.restart();
    context.run();
    return asio::error::timed_out;
  }

  tcp::endpoint peer;
  std::stop_token stop;
  asio::io_context context;
  tcp::socket socket{context};
};

EkiAsideLine::EkiAsideLine(const std::string& address, std::uint16_t port, std::stop_token stop) {
  error_code error;
  const auto host = asio::ip::make_address(address, error);
  if (error)
    throw DriverError(
        fmt::format("EKI: address \"{}\" is not an IP address: {}", address, error.message()));
  impl_ = std::make_unique<Impl>(host, port, std::move(stop));
}

EkiAsideLine::~EkiAsideLine() = default;

std::string EkiAsideLine::connect() {
  const TimePoint until = clock_now() + kAsideConnectLimit;
  for (;;) {
    std::optional<error_code> done;
    error_code ignored_on_purpose;
    impl_->socket.close(ignored_on_purpose);
    impl_->socket.async_connect(impl_->peer, [&](const error_code& result) { done = result; });
    const error_code failure = impl_->finish(done, until);
    if (!failure) return {};
    if (clock_now() + kEkiReopenPause > until || impl_->stop.stop_requested())
      return failure.message();
    steady_clock().sleep_until(clock_now() + kEkiReopenPause);
  }
}

void EkiAsideLine::run(EkiAside& aside) {
  std::array<char, 4096> received{};
  while (!aside.ended()) {
    std::optional<error_code> done;
    std::size_t count = 0;
    impl_->socket.async_read_some(asio::buffer(received),
                                  [&](const error_code& result, std::size_t size) {
                                    done = result;
                                    count = size;
                                  });
    const error_code failure = impl_->finish(done, clock_now() + kAsideStep);
    const TimePoint now = clock_now();
    aside.on_bytes({received.data(), count}, now);
    aside.on_tick(now);
    error_code error;
    if (impl_->stop.stop_requested() || (failure && failure != asio::error::timed_out)) {
      aside.on_closed();
    } else if (const std::string out = aside.drain_output(); !out.empty()) {
      asio::write(impl_->socket, asio::buffer(out), error);
      if (error) aside.on_closed();
    }
  }
}

std::string EkiAsideLine::peer() const {
  return fmt::format("{}:{}", impl_->peer.address().to_string(), impl_->peer.port());
}

namespace {

using namespace std::chrono_literals;

// The controller obeys a disconnected session until it detects the disconnection.
constexpr Duration kSendLimit = 3s;
// States arrive every 12 to 100 ms.
constexpr Duration kStatesCease = 1s;
// 0.3 s of rest, a pass of the submit program and a state; ten times as long for a slow submit interpreter.
constexpr Duration kAnswerLimit = 4s;

}  // namespace

bool same_frame(const EkiFrameValues& sent, const EkiFrameValues& read) {
  constexpr double kReal = 1.0 / (1 << 23);  // last bit of a 32-bit REAL
  constexpr double kMm = 1e-4, kDeg = 1e-5;  // last decimals of the text
  for (std::size_t i = 0; i < sent.size(); ++i) {
    const double allowed = (i < 3 ? kMm : kDeg) + std::abs(sent[i]) * kReal;
    if (!(std::abs(sent[i] - read[i]) <= allowed)) return false;
  }
  return true;
}

EkiFrameExchange::EkiFrameExchange(EkiFrameRequest request, std::uint32_t ask, TimePoint connected)
    : request_(request), ask_(ask), begun_(connected) {}

void EkiFrameExchange::on_bytes(std::string_view bytes, TimePoint now) {
  for (const char c : bytes) {
    if (result_) return;
    switch (framer_.push(c)) {
      case EkiFramer::Event::kNone: break;
      case EkiFramer::Event::kDocument: on_document(framer_.document(), now); break;
      case EkiFramer::Event::kOversized: return end(EkiFrameTrouble::kNotAStream);
    }
  }
}

/// Every state repeats the answer: a damaged one is ignored.
void EkiFrameExchange::on_document(std::string_view document, TimePoint now) {
  if (parser_.parse_state(document, state_) != EkiError::kNone) return;
  heard_at_ = now;
  if (sent_) {
    std::optional<EkiFrameAnswer> answer;
    if (parse_frame_answer(document, answer) != EkiError::kNone) return;
    if (answer && answer->ask == ask_ && answer->done != EkiFrameDone::kNotYet) judge(*answer);
    return;
  }
  if (!knows_frames(document)) return end(EkiFrameTrouble::kTooOld);
  update(now);
}

/// Sends the request once the conditions are met.
void EkiFrameExchange::update(TimePoint now) {
  // Reports a moving arm before anything is sent; the controller checks it again.
  const bool stands = rest_.update(state_, now) || request_.kind == EkiFrameKind::kAdvice;
  if (state_.session != 0) {
    in_the_way_ = EkiFrameTrouble::kInSession;
  } else if (!stands) {
    in_the_way_ = EkiFrameTrouble::kMoves;
  } else {
    EkiFrameCommand command{ask_, request_.values.has_value(), request_.kind, request_.number, {}};
    if (request_.values) command.values = *request_.values;
    auto text = format_frame_command(command);
    if (!text) return end(EkiFrameTrouble::kNoTelegram);
    output_ = std::move(*text);
    sent_ = true;
    sent_at_ = now;
  }
}

void EkiFrameExchange::judge(const EkiFrameAnswer& answer) {
  const bool set = request_.values.has_value();
  const bool whole = answer.done != EkiFrameDone::kIncomplete;
  if (whole &&
      (answer.kind != request_.kind || answer.number != request_.number || answer.set != set))
    return end(EkiFrameTrouble::kOtherFrame);
  EkiFrameResult result;
  if (answer.done != EkiFrameDone::kDone) {
    result.end = EkiFrameEnd::kRefused;
    result.refusal = answer.done;
  } else {
    result.old_values = answer.old_values;
    result.new_values = answer.new_values;
    result.end = !set                                              ? EkiFrameEnd::kRead
                 : same_frame(*request_.values, answer.new_values) ? EkiFrameEnd::kSet
                                                                   : EkiFrameEnd::kDiffers;
  }
  result_ = std::move(result);
}

/// Losing the answer to a read has no consequences.
void EkiFrameExchange::end(EkiFrameTrouble why) {
  if (result_) return;
  result_.emplace();
  result_->end = sent_ && request_.values ? EkiFrameEnd::kUnknown : EkiFrameEnd::kNotSent;
  result_->trouble = why;
}

void EkiFrameExchange::on_tick(TimePoint now) {
  if (!sent_ && now - begun_ > kSendLimit)
    end(now - heard_at_ > kStatesCease ? EkiFrameTrouble::kNoState : in_the_way_);
  if (sent_ && now - sent_at_ > kAnswerLimit) end(EkiFrameTrouble::kNoAnswer);
}

void EkiFrameExchange::set(const EkiFrameValues& values, std::uint32_t ask, TimePoint now) {
  result_.reset();
  request_.values = values;
  ask_ = ask;
  begun_ = now;
  sent_ = false;
  in_the_way_ = EkiFrameTrouble::kNoState;
}

void EkiFrameExchange::on_closed() { end(EkiFrameTrouble::kClosed); }

std::string EkiFrameExchange::drain_output() { return std::exchange(output_, {}); }

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
    const bool stands = rest_.update(state_, now);
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

namespace {

/// Runs the exchange on a connection. `chosen`: set once the choice was called.
EkiFrameResult exchange_on(EkiAsideLine& line, const EkiFrameRequest& request,
                           const EkiFrameChoice& choice, bool& chosen) {
  EkiFrameExchange exchange(request, draw_number(), std::chrono::steady_clock::now());
  for (;;) {
    line.run(exchange);
    const EkiFrameResult result = *exchange.result();
    if (!choice || chosen || result.end != EkiFrameEnd::kRead) return result;
    chosen = true;
    const auto values = choice(*result.new_values);
    if (!values) return result;
    exchange.set(*values, draw_number(), std::chrono::steady_clock::now());
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
