#include "drivers/kuka/rsi/rsi_robot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>

#include "drivers/error.h"
#include "drivers/kuka/moves/robot_shell.h"

namespace cellcal::drivers {
namespace {

namespace asio = boost::asio;
using asio::ip::udp;
using boost::system::error_code;

// Maximum datagrams processed at once, so that a flood does not delay the tick.
constexpr int kDrainLimit = 64;
constexpr std::chrono::seconds kCloseLimit{2};

}  // namespace

struct RsiRobot::Impl : std::enable_shared_from_this<RsiRobot::Impl> {
  Impl(asio::io_context& c, RsiConfig cfg, ContactGuard* g)
      : context(c), config(std::move(cfg)), guard(g), socket(c), timer(c) {
    config.validate();
  }

  // ---- session's thread ------------------------------------------------------------------------

  void open() {
    if (shell.is_open()) {
      throw DriverError(fmt::format("RSI on UDP {}:{} is already open, or still closing",
                                    config.bind_address, config.port));
    }
    error_code error;
    const auto address = asio::ip::make_address(config.bind_address, error);
    if (error) {
      throw DriverError(fmt::format("RSI: bind_address \"{}\" is not an IP address: {}",
                                    config.bind_address, error.message()));
    }
    const udp::endpoint endpoint(address, config.port);
    udp::socket fresh(context);
    fresh.open(endpoint.protocol(), error);
    if (!error) fresh.bind(endpoint, error);
    if (!error) fresh.non_blocking(true, error);
    if (error) {
      throw DriverError(fmt::format(
          "RSI: cannot listen on UDP {}:{}: {}. Another program (or another cellcald) may use "
          "the port, or the address is not this computer's",
          config.bind_address, config.port, error.message()));
    }
    bound_port = fresh.local_endpoint().port();
    peer_v4 = 0;
    listening = fmt::format("UDP {}:{}", config.bind_address, bound_port.load());
    auto fresh_core = std::make_unique<RsiCore>(config, guard);
    const std::uint32_t number = shell.open(fresh_core->core_state());
    asio::post(context, [self = shared_from_this(), number, opened = std::move(fresh),
                         started = std::move(fresh_core)]() mutable {
      self->start(number, std::move(opened), std::move(started));
    });
  }

  // ---- I/O thread ------------------------------------------------------------------------------

  void start(std::uint32_t number, udp::socket opened, std::unique_ptr<RsiCore> started) {
    shell.start(number);
    socket = std::move(opened);
    core = std::move(started);
    peer = udp::endpoint();
    locked = ending = false;
    wait_for_packet();
    timer.expires_at(std::chrono::steady_clock::now());
    keep_ticking(timer, [self = shared_from_this(), number] {
      if (!self->is_current(number)) return false;
      self->drain();
      self->tick();
      return self->socket.is_open();
    });
  }

  bool is_current(std::uint32_t number) const {
    return shell.is_current(number) && socket.is_open();
  }

  void wait_for_packet() {
    socket.async_wait(udp::socket::wait_read, [self = shared_from_this(),
                                               number = shell.opening()](const error_code& error) {
      if (error || !self->is_current(number)) return;
      self->drain();
      self->wait_for_packet();
    });
  }

  bool linked() const {
    const RobotLink link = core->core_state().link;
    return link == RobotLink::kNotReferenced || link == RobotLink::kReady;
  }

  /// Two controllers on one port must never be mixed up: only the first address is accepted; its
  /// port may change when RSI restarts, after the link was lost.
  bool is_foreign(const udp::endpoint& from) const {
    if (!locked) return false;
    return from.address() != peer.address() || (linked() && from.port() != peer.port());
  }

  /// Reads all pending datagrams, and answers only the newest packet: replies to older ones would
  /// be late, and a burst of steps could be taken for motion.
  void drain() {
    std::size_t size = 0;
    TimePoint t_rx;
    for (int i = 0; i < kDrainLimit; ++i) {
      error_code error;
      udp::endpoint from;
      const std::size_t got =
          socket.receive_from(asio::buffer(spare.data(), spare.size()), from, 0, error);
      if (error == asio::error::would_block || error == asio::error::try_again) break;
      if (error) continue;  // an ICMP answer to an undelivered reply; silence shows it
      const TimePoint now = std::chrono::steady_clock::now();
      if (is_foreign(from)) {
        foreign.fetch_add(1, std::memory_order_relaxed);
        foreign_from.store(from.address().is_v4() ? from.address().to_v4().to_uint() : 0,
                           std::memory_order_relaxed);
        continue;
      }
      if (got == size && std::equal(spare.data(), spare.data() + got, newest.data()))
        repeated.fetch_add(1, std::memory_order_relaxed);
      std::swap(newest, spare);
      size = got;
      newest_from = from;
      t_rx = now;
    }
    if (size == 0) return;
    shell.obey(*core);
    const std::string_view reply = core->on_datagram({newest.data(), size}, t_rx);
    if (!reply.empty()) {
      error_code error;
      socket.send_to(asio::buffer(reply.data(), reply.size()), newest_from, 0, error);
      if (error) {
        unsent.fetch_add(1, std::memory_order_relaxed);
      } else {
        times.add(std::chrono::steady_clock::now() - t_rx);
      }
    }
    // Only a packet accepted by the core as a controller's determines the peer.
    if (linked() && (!locked || peer != newest_from)) {
      peer = newest_from;
      locked = true;
      if (peer.address().is_v4()) peer_v4.store(peer.address().to_v4().to_uint());
    }
    shell.publish(*core);
  }

  void tick() {
    shell.obey(*core);
    const TimePoint now = std::chrono::steady_clock::now();
    core->on_tick(now);
    shell.publish(*core);
    if (ending) {
      const bool silent = !linked();
      const bool nothing_to_send = config.stop_tag.empty() && !core->core_state().moving;
      if (silent || nothing_to_send || now > close_by) shut();
    }
  }

  void end() {
    if (ending || !socket.is_open()) return;
    ending = true;
    close_by = std::chrono::steady_clock::now() + kCloseLimit;
    core->close();
  }

  void shut() {
    error_code ignored_on_purpose;  // closing a UDP socket cannot lose anything
    timer.cancel(ignored_on_purpose);
    socket.close(ignored_on_purpose);
    bound_port = 0;
    shell.closed();
  }

  asio::io_context& context;
  RsiConfig config;
  ContactGuard* guard;
  udp::socket socket;
  asio::steady_timer timer;
  std::unique_ptr<RsiCore> core;

  udp::endpoint peer, newest_from;
  bool locked = false;
  bool ending = false;
  TimePoint close_by{};
  // One byte more than the largest: detects datagrams that are too long.
  using Datagram = std::array<char, kMaxRsiDatagram + 1>;
  struct Buffer {
    std::unique_ptr<Datagram> memory = std::make_unique<Datagram>();
    char* data() const { return memory->data(); }
    std::size_t size() const { return memory->size(); }
  };
  Buffer newest, spare;

  RobotShell<RsiCore> shell;
  ReplyHistogram times;
  std::atomic<std::uint64_t> foreign{0}, unsent{0};
  std::atomic<std::uint64_t> repeated{0};  // datagrams dropped as copies of the one behind them
  std::atomic<std::uint32_t> foreign_from{0}, peer_v4{0};
  std::atomic<std::uint16_t> bound_port{0};

  std::string listening;  // session's thread only
};

RsiRobot::RsiRobot(asio::io_context& context, RsiConfig config, ContactGuard* guard)
    : impl_(std::make_shared<Impl>(context, std::move(config), guard)) {}

RsiRobot::~RsiRobot() {
  if (impl_->shell.is_open()) shut_and_wait(impl_->context, impl_);
}

void RsiRobot::open() { impl_->open(); }

RobotState RsiRobot::state() const {
  if (!impl_->shell.is_open()) {
    RobotState state;
    state.words = "say.robot.link_closed";
    return state;
  }
  RobotState state =
      to_robot_state(impl_->shell.state(), {impl_->listening, impl_->config.sentype});
  state.quality.duplicates += impl_->repeated.load(std::memory_order_relaxed);
  state.quality.reply_p50_s = impl_->times.quantile_s(0.5);
  state.quality.reply_p99_s = impl_->times.quantile_s(0.99);
  state.quality.reply_p999_s = impl_->times.quantile_s(0.999);
  state.quality.reply_max_s = impl_->times.max_s();
  state.quality.reply_times = impl_->times.coarse();
  if (const std::uint64_t count = foreign_packets(); count > 0)
    state.words = sentences(
        state.words, {"say.rsi.foreign",
                      {{"packets", count},
                       {"sender", asio::ip::address_v4(impl_->foreign_from.load()).to_string()}}});
  if (const std::uint64_t count = impl_->unsent.load(); count > 0)
    state.words = sentences(state.words, {"say.rsi.unsent", {{"replies", count}}});
  return state;
}

void RsiRobot::rereference() { impl_->shell.rereference(); }
void RsiRobot::begin(const Move& move) { impl_->shell.begin(move); }
void RsiRobot::stop() { impl_->shell.stop(); }
std::optional<MoveResult> RsiRobot::poll() { return impl_->shell.poll(); }

void RsiRobot::close() {
  if (!impl_->shell.is_open()) return;
  asio::post(impl_->context, [impl = impl_] { impl->end(); });
}

bool RsiRobot::is_open() const { return impl_->shell.is_open(); }
std::uint16_t RsiRobot::port() const { return impl_->bound_port.load(); }
const ReplyHistogram& RsiRobot::reply_times() const { return impl_->times; }
std::uint64_t RsiRobot::foreign_packets() const { return impl_->foreign.load(); }
CoreState RsiRobot::core_state() const { return impl_->shell.state(); }

std::string RsiRobot::sender() const {
  const std::uint32_t address = impl_->peer_v4.load();
  return address == 0 ? std::string() : asio::ip::address_v4(address).to_string();
}

}  // namespace cellcal::drivers
