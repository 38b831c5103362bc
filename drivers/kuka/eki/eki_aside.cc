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

constexpr Duration kRest = 300ms;
constexpr double kRestDeg = 0.01;
constexpr Duration kAsideConnectLimit = 3s, kStep = 20ms, kReopenPause = 100ms;
// The controller obeys a disconnected session until it detects the disconnection.
constexpr Duration kSendLimit = 3s;
// States arrive every 12 to 100 ms.
constexpr Duration kStatesCease = 1s;
// 0.3 s of rest, a pass of the submit program and a state; ten times as long for a slow submit interpreter.
constexpr Duration kAnswerLimit = 4s;

TimePoint clock_now() { return std::chrono::steady_clock::now(); }

/// The connection, in the caller's thread.
class Line {
 public:
  /// Throws DriverError if `address` is not an IP address. `stop`: connecting and running end within 20 ms, as if
  /// closed.
  Line(const std::string& address, std::uint16_t port, std::stop_token stop)
      : stop_(std::move(stop)) {
    error_code error;
    const auto host = asio::ip::make_address(address, error);
    if (error)
      throw DriverError(
          fmt::format("EKI: address \"{}\" is not an IP address: {}", address, error.message()));
    peer_ = tcp::endpoint(host, port);
  }

  /// Reconnects within 3 s. Returns an empty string, or the system's error message. Connects to
  /// this address only.
  std::string connect() {
    const TimePoint until = clock_now() + kAsideConnectLimit;
    for (;;) {
      std::optional<error_code> done;
      error_code ignored_on_purpose;
      socket_.close(ignored_on_purpose);
      socket_.async_connect(peer_, [&](const error_code& result) { done = result; });
      const error_code failure = finish(done, until);
      if (!failure) return {};
      if (clock_now() + kReopenPause > until || stop_.stop_requested()) return failure.message();
      steady_clock().sleep_until(clock_now() + kReopenPause);
    }
  }

  /// Runs until `exchange` has ended; its own time limits ensure that.
  void run(EkiFrameExchange& exchange) {
    std::array<char, 4096> received{};
    while (!exchange.ended()) {
      std::optional<error_code> done;
      std::size_t count = 0;
      socket_.async_read_some(asio::buffer(received),
                              [&](const error_code& result, std::size_t size) {
                                done = result;
                                count = size;
                              });
      const error_code failure = finish(done, clock_now() + kStep);
      const TimePoint now = clock_now();
      exchange.on_bytes({received.data(), count}, now);
      exchange.on_tick(now);
      error_code error;
      if (stop_.stop_requested() || (failure && failure != asio::error::timed_out)) {
        exchange.on_closed();
      } else if (const std::string out = exchange.drain_output(); !out.empty()) {
        asio::write(socket_, asio::buffer(out), error);
        if (error) exchange.on_closed();
      }
    }
  }

  /// "172.31.1.147:54600"
  std::string peer() const {
    return fmt::format("{}:{}", peer_.address().to_string(), peer_.port());
  }

 private:
  /// Runs the operation until it has ended, or cancels it at `until`.
  error_code finish(const std::optional<error_code>& done, TimePoint until) {
    context_.restart();
    while (!done && clock_now() < until && !stop_.stop_requested())
      context_.run_one_until(std::min(until, clock_now() + kStep));
    if (done) return *done;
    error_code ignored_on_purpose;  // the handler is then called with an error of its own
    socket_.cancel(ignored_on_purpose);
    context_.restart();
    context_.run();
    return asio::error::timed_out;
  }

  tcp::endpoint peer_;
  std::stop_token stop_;
  asio::io_context context_;
  tcp::socket socket_{context_};
};

/// Runs the exchange on a connection. `chosen`: set once the choice was called.
EkiFrameResult exchange_on(Line& line, const std::optional<EkiFrameRequest>& request,
                           const EkiFrameChoice& choice, bool& chosen) {
  EkiFrameExchange exchange = request ? EkiFrameExchange(*request, draw_number(), clock_now())
                                      : EkiFrameExchange(clock_now());
  for (;;) {
    line.run(exchange);
    const EkiFrameResult result = *exchange.result();
    if (!choice || chosen || result.end != EkiFrameEnd::kRead) return result;
    chosen = true;
    const auto values = choice(*result.new_values);
    if (!values) return result;
    exchange.set(*values, draw_number(), clock_now());
  }
}

/// True if the controller did not serve this client, and no modifying request was sent.
bool may_be_tried_again(const EkiFrameResult& result) {
  return result.end == EkiFrameEnd::kNotSent && (result.trouble == EkiFrameTrouble::kClosed ||
                                                 result.trouble == EkiFrameTrouble::kNoState);
}

EkiFrameResult exchange(const std::string& address, std::uint16_t port,
                        const std::optional<EkiFrameRequest>& request, const EkiFrameChoice& choice,
                        const EkiReconnectLimits& limits) {
  Line line(address, port, limits.stop);
  EkiFrameResult result;
  bool chosen = false;
  for (const TimePoint begun = clock_now();;) {
    result = {};
    if (const std::string failure = line.connect(); !failure.empty()) {
      result.trouble = EkiFrameTrouble::kNoConnection;
      result.detail = failure;
    } else {
      result = exchange_on(line, request, choice, chosen);
    }
    const TimePoint now = clock_now();
    if (chosen || !may_be_tried_again(result) || now - begun > limits.reopens_within ||
        limits.stop.stop_requested())
      break;
    steady_clock().sleep_until(now + kReopenPause);
  }
  result.peer = line.peer();
  return result;
}

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
  if (request_ && !knows_frames(document)) return end(EkiFrameTrouble::kTooOld);
  update(now);
}

bool EkiFrameExchange::stands(TimePoint now) {
  bool same = rest_deg_.size() == state_.axes_deg.size();
  for (std::size_t i = 0; same && i < rest_deg_.size(); ++i)
    same = std::abs(rest_deg_[i] - state_.axes_deg[i]) < kRestDeg;
  if (!same) {
    rest_deg_ = state_.axes_deg;
    rest_since_ = now;
  }
  return state_.progress != EkiProgress::kMoving && now - rest_since_ >= kRest;
}

/// Sends the request, or reads the position, once the conditions are met.
void EkiFrameExchange::update(TimePoint now) {
  // Reports a moving arm before anything is sent; the controller checks it again.
  const bool advice = request_ && request_->kind == EkiFrameKind::kAdvice;
  const bool may_send = stands(now) || advice;
  if (state_.session != 0) {
    in_the_way_ = EkiFrameTrouble::kInSession;
  } else if (!may_send) {
    in_the_way_ = EkiFrameTrouble::kMoves;
  } else if (!request_) {
    result_.emplace();
    result_->end = EkiFrameEnd::kRead;
    result_->axes_deg = state_.axes_deg;
  } else {
    EkiFrameCommand command{
        ask_, request_->values.has_value(), request_->kind, request_->number, {}};
    if (request_->values) command.values = *request_->values;
    auto text = format_frame_command(command);
    if (!text) return end(EkiFrameTrouble::kNoTelegram);
    output_ = std::move(*text);
    sent_ = true;
    sent_at_ = now;
  }
}

void EkiFrameExchange::judge(const EkiFrameAnswer& answer) {
  const bool set = request_->values.has_value();
  const bool whole = answer.done != EkiFrameDone::kIncomplete;
  if (whole &&
      (answer.kind != request_->kind || answer.number != request_->number || answer.set != set))
    return end(EkiFrameTrouble::kOtherFrame);
  EkiFrameResult result;
  if (answer.done != EkiFrameDone::kDone) {
    result.end = EkiFrameEnd::kRefused;
    result.refusal = answer.done;
  } else {
    result.old_values = answer.old_values;
    result.new_values = answer.new_values;
    result.end = !set                                               ? EkiFrameEnd::kRead
                 : same_frame(*request_->values, answer.new_values) ? EkiFrameEnd::kSet
                                                                    : EkiFrameEnd::kDiffers;
  }
  result_ = std::move(result);
}

/// Losing the answer to a read has no consequences.
void EkiFrameExchange::end(EkiFrameTrouble why) {
  if (result_) return;
  result_.emplace();
  result_->end = sent_ && request_->values ? EkiFrameEnd::kUnknown : EkiFrameEnd::kNotSent;
  result_->trouble = why;
}

void EkiFrameExchange::on_tick(TimePoint now) {
  if (!sent_ && now - begun_ > kSendLimit)
    end(now - heard_at_ > kStatesCease ? EkiFrameTrouble::kNoState : in_the_way_);
  if (sent_ && now - sent_at_ > kAnswerLimit) end(EkiFrameTrouble::kNoAnswer);
}

void EkiFrameExchange::set(const EkiFrameValues& values, std::uint32_t ask, TimePoint now) {
  result_.reset();
  request_->values = values;
  ask_ = ask;
  begun_ = now;
  sent_ = false;
  in_the_way_ = EkiFrameTrouble::kNoState;
}

std::string EkiFrameExchange::drain_output() { return std::exchange(output_, {}); }

EkiFrameResult exchange_frame(const std::string& address, std::uint16_t port,
                              const EkiFrameRequest& request, const EkiFrameChoice& choice,
                              const EkiReconnectLimits& limits) {
  return exchange(address, port, request, choice, limits);
}

EkiPosition position_of(const EkiFrameResult& result) {
  EkiPosition position{{}, result.axes_deg, result.peer, result.detail};
  using enum EkiFrameTrouble;
  switch (result.trouble) {
    case kNoConnection: position.trouble = EkiPositionTrouble::kNoConnection; break;
    case kNoState: position.trouble = EkiPositionTrouble::kNoState; break;
    case kInSession: position.trouble = EkiPositionTrouble::kInSession; break;
    case kMoves: position.trouble = EkiPositionTrouble::kMoves; break;
    case kClosed: position.trouble = EkiPositionTrouble::kClosed; break;
    case kNotAStream: position.trouble = EkiPositionTrouble::kNotAStream; break;
    default: break;  // kNone: the others are those of a request
  }
  return position;
}

EkiPosition read_position(const std::string& address, std::uint16_t port,
                          const EkiReconnectLimits& limits) {
  return position_of(exchange(address, port, std::nullopt, {}, limits));
}

}  // namespace cellcal::drivers
