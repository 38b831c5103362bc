#include "drivers/kuka/eki/eki_aside.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <cmath>
#include <optional>

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

bool EkiRest::look(const EkiState& state, TimePoint now) {
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

}  // namespace cellcal::drivers
