// The exchange of a frame on a TCP socket, in the caller's thread.

#include <fmt/format.h>

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <random>

#include "drivers/error.h"
#include "drivers/kuka/eki/eki_frames.h"

namespace cellcal::drivers {
namespace {

namespace asio = boost::asio;
using namespace std::chrono_literals;
using asio::ip::tcp;
using boost::system::error_code;

// The controller opens its port again a moment after a client has gone; until then its listener may take a
// connection and close it at once. Of a client whose cable was pulled it knows after its own 10 s.
constexpr Duration kFramesConnectLimit = 3s, kReopenLimit = 12s, kConnectPause = 100ms;
constexpr Duration kStep = 20ms;

std::uint32_t draw_ask() {
  std::random_device device;
  return std::uniform_int_distribution<std::uint32_t>(1, 0x7FFFFFFE)(device);
}

/// Runs what was begun until it has ended, or cancels it at `until`.
error_code finish(asio::io_context& context, tcp::socket& socket,
                  const std::optional<error_code>& done, TimePoint until) {
  context.restart();
  while (!done && std::chrono::steady_clock::now() < until) context.run_one_until(until);
  if (done) return *done;
  error_code ignored_on_purpose;  // the handler is then called with an error of its own
  socket.cancel(ignored_on_purpose);
  context.restart();
  context.run();
  return asio::error::timed_out;
}

error_code connect(asio::io_context& context, tcp::socket& socket, const tcp::endpoint& peer) {
  const TimePoint until = std::chrono::steady_clock::now() + kFramesConnectLimit;
  for (;;) {
    std::optional<error_code> done;
    error_code ignored_on_purpose;
    socket.close(ignored_on_purpose);
    socket.async_connect(peer, [&](const error_code& result) { done = result; });
    const error_code failure = finish(context, socket, done, until);
    const TimePoint now = std::chrono::steady_clock::now();
    if (!failure || now + kConnectPause > until) return failure;
    steady_clock().sleep_until(now + kConnectPause);
  }
}

void run_to_result(asio::io_context& context, tcp::socket& socket, EkiFrameExchange& exchange) {
  std::array<char, 4096> received{};
  while (!exchange.result()) {
    std::optional<error_code> done;
    std::size_t count = 0;
    socket.async_read_some(asio::buffer(received), [&](const error_code& result, std::size_t size) {
      done = result;
      count = size;
    });
    const error_code failure =
        finish(context, socket, done, std::chrono::steady_clock::now() + kStep);
    const TimePoint now = std::chrono::steady_clock::now();
    exchange.on_bytes({received.data(), count}, now);
    exchange.on_tick(now);
    error_code error;
    if (failure && failure != asio::error::timed_out) {
      exchange.on_closed();
    } else if (const std::string out = exchange.take_output(); !out.empty()) {
      asio::write(socket, asio::buffer(out), error);
      if (error) exchange.on_closed();
    }
  }
}

/// On a connection, to the end of the exchange. `chosen`: the choice was asked.
EkiFrameResult exchange_on(asio::io_context& context, tcp::socket& socket,
                           const EkiFrameRequest& request, const EkiFrameChoice& choice,
                           bool& chosen) {
  EkiFrameExchange exchange(request, draw_ask(), std::chrono::steady_clock::now());
  for (;;) {
    run_to_result(context, socket, exchange);
    const EkiFrameResult result = *exchange.result();
    if (!choice || chosen || result.end != EkiFrameEnd::kRead) return result;
    chosen = true;
    const auto values = choice(*result.new_values);
    if (!values) return result;
    exchange.set(*values, draw_ask(), std::chrono::steady_clock::now());
  }
}

/// The controller had no time for this client, and nothing was asked for that could change anything.
bool may_be_tried_again(const EkiFrameResult& result) {
  return result.end == EkiFrameEnd::kNotSent && (result.trouble == EkiFrameTrouble::kClosed ||
                                                 result.trouble == EkiFrameTrouble::kNoState);
}

}  // namespace

EkiFrameResult exchange_frame(const std::string& address, std::uint16_t port,
                              const EkiFrameRequest& request, const EkiFrameChoice& choice) {
  error_code error;
  const auto host = asio::ip::make_address(address, error);
  if (error)
    throw DriverError(
        fmt::format("EKI: address \"{}\" is not an IP address: {}", address, error.message()));
  asio::io_context context;
  tcp::socket socket(context);
  EkiFrameResult result;
  bool chosen = false;
  for (const TimePoint begun = std::chrono::steady_clock::now();;) {
    result = {};
    if (const error_code failure = connect(context, socket, {host, port})) {
      result.trouble = EkiFrameTrouble::kNoConnection;
      result.detail = failure.message();
    } else {
      result = exchange_on(context, socket, request, choice, chosen);
    }
    const TimePoint now = std::chrono::steady_clock::now();
    if (chosen || !may_be_tried_again(result) || now - begun > kReopenLimit) break;
    steady_clock().sleep_until(now + kConnectPause);
  }
  result.peer = fmt::format("{}:{}", address, port);
  return result;
}

}  // namespace cellcal::drivers
