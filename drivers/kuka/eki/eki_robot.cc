#include "drivers/kuka/eki/eki_robot.h"

#include <fmt/format.h>

#include <array>
#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <mutex>

#include "drivers/error.h"
#include "drivers/kuka/moves/robot_shell.h"

namespace cellcal::drivers {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

constexpr std::chrono::milliseconds kRetry{500};
constexpr std::chrono::seconds kConnectLimit{3}, kCloseLimit{3};
constexpr std::size_t kRead = 4096;

}  // namespace

struct EkiRobot::Impl : std::enable_shared_from_this<EkiRobot::Impl> {
  Impl(asio::io_context& c, EkiConfig cfg, ContactGuard* g)
      : context(c), config(std::move(cfg)), guard(g), socket(c), timer(c) {
    config.validate();
    peer_name = fmt::format("{}:{}", config.address, config.port);
  }

  // ---- session's thread ------------------------------------------------------------------------

  void open() {
    if (shell.is_open()) {
      throw DriverError(fmt::format("EKI to {} is already open, or still closing", peer_name));
    }
    error_code error;
    const auto address = asio::ip::make_address(config.address, error);
    if (error) {
      throw DriverError(fmt::format("EKI: address \"{}\" is not an IP address: {}", config.address,
                                    error.message()));
    }
    auto fresh = std::make_unique<EkiCore>(config, guard);
    const std::uint32_t number = shell.open(fresh->core_state());
    asio::post(context,
               [self = shared_from_this(), number, endpoint = tcp::endpoint(address, config.port),
                started = std::move(fresh)]() mutable {
                 self->start(number, endpoint, std::move(started));
               });
  }

  // ---- I/O thread ------------------------------------------------------------------------------

  void start(std::uint32_t number, tcp::endpoint endpoint, std::unique_ptr<EkiCore> started) {
    shell.start(number);
    peer = endpoint;
    core = std::move(started);
    ending = connecting = false;
    next_try = std::chrono::steady_clock::now();
    timer.expires_at(next_try);
    keep_ticking(timer, [self = shared_from_this(), number] {
      if (!self->shell.is_current(number)) return false;
      self->tick();
      return self->shell.is_open();
    });
  }

  void tick() {
    const TimePoint now = std::chrono::steady_clock::now();
    shell.obey(*core);
    if (!socket.is_open() && !ending && now >= next_try) connect(now);
    if (connecting && now >= connect_by) drop("no answer to the connection request", now);
    core->on_tick(now);
    if (core->wants_close() && socket.is_open()) drop("", now);
    flush();
    shell.publish(*core);
    if (ending && (core->ended() || now >= close_by)) shut();
  }

  void connect(TimePoint now) {
    error_code error;
    socket.open(peer.protocol(), error);
    if (error) return drop(error.message(), now);
    connecting = true;
    connect_by = now + kConnectLimit;
    const std::uint32_t turn = ++connection;
    socket.async_connect(peer, [self = shared_from_this(), turn](const error_code& failure) {
      if (turn != self->connection || !self->socket.is_open()) return;
      self->connecting = false;
      const TimePoint at = std::chrono::steady_clock::now();
      if (failure) return self->drop(failure.message(), at);
      error_code ignored_on_purpose;  // otherwise telegrams are only delayed
      self->socket.set_option(tcp::no_delay(true), ignored_on_purpose);
      error_code refused;  // otherwise a full buffer would block this thread
      self->socket.non_blocking(true, refused);
      if (refused) return self->drop(refused.message(), at);
      self->core->on_connected(draw_number(), at);  // telegrams of an old connection are void
      self->flush();
      if (turn == self->connection) self->read(turn);
    });
  }

  void read(std::uint32_t turn) {
    socket.async_read_some(asio::buffer(received), [self = shared_from_this(), turn](
                                                       const error_code& error, std::size_t count) {
      if (turn != self->connection) return;
      const TimePoint at = std::chrono::steady_clock::now();
      if (error) return self->drop(error.message(), at);
      self->core->on_bytes({self->received.data(), count}, at);
      self->shell.publish(*self->core);
      if (self->core->wants_close()) return self->drop("", at);
      self->flush();
      if (turn == self->connection) self->read(turn);
    });
  }

  /// Sends the core's output. Bytes that the socket does not accept immediately stay in the core
  /// until the next tick, without another buffer or allocation.
  void flush() {
    if (connecting || !socket.is_open()) return;
    while (!core->output().empty()) {
      const std::string_view text = core->output();
      error_code error;
      const std::size_t taken = socket.write_some(asio::buffer(text.data(), text.size()), error);
      if (error == asio::error::would_block || error == asio::error::try_again) return;
      if (error) return drop(error.message(), std::chrono::steady_clock::now());
      core->sent(taken);
    }
  }

  /// Ends the connection, regardless of the cause. Reconnects after a delay.
  void drop(const std::string& why, TimePoint now) {
    ++connection;
    connecting = false;
    error_code ignored_on_purpose;  // closed in any case
    // Discards what was not delivered: no command arrives once the link is given up, however late a cable is back.
    socket.set_option(asio::socket_base::linger(true, 0), ignored_on_purpose);
    socket.close(ignored_on_purpose);
    core->on_closed(now);
    next_try = now + kRetry;
    if (!why.empty()) {
      const std::lock_guard lock(error_mutex);
      last_why = why;
    }
    shell.publish(*core);
  }

  void end() {
    if (ending || !shell.is_open()) return;
    ending = true;
    close_by = std::chrono::steady_clock::now() + kCloseLimit;
    core->close();
  }

  void shut() {
    ++connection;
    error_code ignored_on_purpose;  // the bye is sent, or nothing receives it
    socket.shutdown(tcp::socket::shutdown_both, ignored_on_purpose);
    socket.close(ignored_on_purpose);
    timer.cancel(ignored_on_purpose);
    shell.closed();
  }

  asio::io_context& context;
  EkiConfig config;
  ContactGuard* guard;
  std::string peer_name;
  tcp::socket socket;
  asio::steady_timer timer;
  std::unique_ptr<EkiCore> core;

  tcp::endpoint peer;
  std::uint32_t connection = 0;
  bool ending = false, connecting = false;
  TimePoint next_try{}, connect_by{}, close_by{};
  std::array<char, kRead> received{};

  RobotShell<EkiCore> shell;
  mutable std::mutex error_mutex;  // locked only at the end of a connection, never on the cycle
  std::string last_why;
};

EkiRobot::EkiRobot(asio::io_context& context, EkiConfig config, ContactGuard* guard)
    : impl_(std::make_shared<Impl>(context, std::move(config), guard)) {}

EkiRobot::~EkiRobot() {
  if (impl_->shell.is_open()) shut_and_wait(impl_->context, impl_);
}

void EkiRobot::open() { impl_->open(); }

RobotState EkiRobot::state() const {
  if (!impl_->shell.is_open()) {
    RobotState state;
    state.words = "say.robot.link_closed";
    return state;
  }
  const EkiCoreState core = impl_->shell.state();
  RobotState state = to_robot_state(core, impl_->peer_name);
  if (!core.connected) {
    const std::lock_guard lock(impl_->error_mutex);
    if (!impl_->last_why.empty())
      state.words = sentences(state.words, {"say.eki.last_error", {{"words", impl_->last_why}}});
  }
  return state;
}

void EkiRobot::rereference() { impl_->shell.rereference(); }
void EkiRobot::begin(const Move& move) { impl_->shell.begin(move); }
void EkiRobot::stop() { impl_->shell.stop(); }
std::optional<MoveResult> EkiRobot::poll() { return impl_->shell.poll(); }

void EkiRobot::close() {
  if (!impl_->shell.is_open()) return;
  asio::post(impl_->context, [impl = impl_] { impl->end(); });
}

bool EkiRobot::is_open() const { return impl_->shell.is_open(); }
EkiCoreState EkiRobot::core_state() const { return impl_->shell.state(); }

}  // namespace cellcal::drivers
