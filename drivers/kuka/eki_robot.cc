#include "drivers/kuka/eki_robot.h"

#include <fmt/format.h>

#include <array>
#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <boost/lockfree/spsc_queue.hpp>
#include <deque>
#include <future>
#include <mutex>
#include <random>

#include "drivers/error.h"
#include "drivers/kuka/seqlock.h"

namespace cellcal::drivers {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

// The contact sensor is asked this often; its silence stops the arm after 25 ms.
constexpr std::chrono::milliseconds kTick{2};
constexpr std::chrono::milliseconds kRetry{500};
constexpr std::chrono::seconds kConnectLimit{3}, kCloseLimit{3};
constexpr std::size_t kQueueDepth = 64;
constexpr std::size_t kRead = 4096;

struct Command {
  enum class Kind { kBegin, kStop, kRereference } kind = Kind::kStop;
  std::uint32_t opening = 0;  // a command left over from a closed link must not reach the next
  Move move;
};

MoveResult refused(const Move& move, const char* why) {
  MoveResult result;
  result.id = move.id;
  result.detail = why;
  return result;
}

// Another one for each connection, so that a telegram of an old one means nothing.
std::uint32_t draw_session() {
  std::random_device device;
  return std::uniform_int_distribution<std::uint32_t>(1, 0x7FFFFFFE)(device);
}

}  // namespace

struct EkiRobot::Impl : std::enable_shared_from_this<EkiRobot::Impl> {
  Impl(asio::io_context& c, EkiConfig cfg, ContactGuard* g)
      : context(c), config(std::move(cfg)), guard(g), socket(c), timer(c) {
    config.validate();
    peer_name = fmt::format("{}:{}", config.address, config.port);
  }

  // ---- session's thread ------------------------------------------------------------------------

  void open() {
    if (is_open.load()) {
      throw DriverError(fmt::format("EKI to {} is open, or still being closed", peer_name));
    }
    error_code error;
    const auto address = asio::ip::make_address(config.address, error);
    if (error) {
      throw DriverError(fmt::format("EKI: address \"{}\" is not an IP address: {}", config.address,
                                    error.message()));
    }
    auto fresh = std::make_unique<EkiCore>(config, guard);
    snapshot.store(fresh->core_state());
    ++asked_opening;
    is_open = true;
    asio::post(context, [self = shared_from_this(), number = asked_opening,
                         endpoint = tcp::endpoint(address, config.port),
                         started = std::move(fresh)]() mutable {
      self->start(number, endpoint, std::move(started));
    });
  }

  void send(const Command& command) {
    if (!commands.push(command)) stop_anyway = true;  // never lose a stop
  }

  // ---- I/O thread ------------------------------------------------------------------------------

  void start(std::uint32_t number, tcp::endpoint endpoint, std::unique_ptr<EkiCore> started) {
    opening = number;
    peer = endpoint;
    core = std::move(started);
    ending = connecting = writing = false;
    next_try = std::chrono::steady_clock::now();
    timer.expires_at(next_try);
    wait_for_tick();
  }

  bool is_current(std::uint32_t number) const { return number == opening && is_open.load(); }

  void wait_for_tick() {
    timer.async_wait([self = shared_from_this(), number = opening](const error_code& error) {
      if (error || !self->is_current(number)) return;
      self->tick();
      if (!self->is_open.load()) return;
      // From now, not from the last expiry: ticks that were missed are not made up for.
      self->timer.expires_after(kTick);
      self->wait_for_tick();
    });
  }

  void tick() {
    const TimePoint now = std::chrono::steady_clock::now();
    obey();
    if (!socket.is_open() && !ending && now >= next_try) connect(now);
    if (connecting && now >= connect_by) drop("no answer to the connection request", now);
    core->on_tick(now);
    if (core->wants_close() && socket.is_open()) drop("", now);
    flush();
    publish();
    if (ending && (core->ended() || now >= close_by) && !writing) shut();
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
      error_code ignored_on_purpose;  // without it telegrams wait a little longer
      self->socket.set_option(tcp::no_delay(true), ignored_on_purpose);
      self->core->on_connected(draw_session(), at);
      self->flush();
      self->read(turn);
    });
  }

  void read(std::uint32_t turn) {
    socket.async_read_some(asio::buffer(received), [self = shared_from_this(), turn](
                                                       const error_code& error, std::size_t count) {
      if (turn != self->connection) return;
      const TimePoint at = std::chrono::steady_clock::now();
      if (error) return self->drop(error.message(), at);
      self->core->on_bytes({self->received.data(), count}, at);
      self->publish();
      if (self->core->wants_close()) return self->drop("", at);
      self->flush();
      self->read(turn);
    });
  }

  /// Hands over what the core has to say. What the socket does not take at once waits in the core.
  void flush() {
    if (writing || connecting || !socket.is_open()) return;
    const std::string_view text = core->output();
    if (text.empty()) return;
    sending.assign(text.begin(), text.end());
    core->sent(text.size());
    writing = true;
    asio::async_write(
        socket, asio::buffer(sending),
        [self = shared_from_this(), turn = connection](const error_code& error, std::size_t) {
          if (turn != self->connection) return;
          self->writing = false;
          if (error) {
            self->drop(error.message(), std::chrono::steady_clock::now());
          } else {
            self->flush();
          }
        });
  }

  /// Whoever ended it: this connection is over. The next one is tried a little later.
  void drop(const std::string& why, TimePoint now) {
    ++connection;
    connecting = writing = false;
    error_code ignored_on_purpose;  // it is over either way
    socket.close(ignored_on_purpose);
    core->on_closed(now);
    next_try = now + kRetry;
    if (!why.empty()) {
      const std::lock_guard lock(why_mutex);
      last_why = why;
    }
    publish();
  }

  void obey() {
    commands.consume_all([this](const Command& command) {
      if (command.opening != opening) return;
      switch (command.kind) {
        case Command::Kind::kBegin:
          core->begin(command.move);
          break;
        case Command::Kind::kStop:
          core->stop();
          break;
        case Command::Kind::kRereference:
          core->rereference();
          break;
      }
    });
    if (stop_anyway.exchange(false)) core->stop();
  }

  void publish() {
    while (results.write_available() > 0) {
      const auto result = core->take_result();
      if (!result) break;
      results.push(*result);
    }
    snapshot.store(core->core_state());
  }

  void end() {
    if (ending || !is_open.load()) return;
    ending = true;
    close_by = std::chrono::steady_clock::now() + kCloseLimit;
    core->end_session();
  }

  void shut() {
    ++connection;
    error_code ignored_on_purpose;  // the bye is out, or nobody takes it
    socket.shutdown(tcp::socket::shutdown_both, ignored_on_purpose);
    socket.close(ignored_on_purpose);
    timer.cancel(ignored_on_purpose);
    is_open = false;
  }

  asio::io_context& context;
  EkiConfig config;
  ContactGuard* guard;
  std::string peer_name;
  tcp::socket socket;
  asio::steady_timer timer;
  std::unique_ptr<EkiCore> core;

  tcp::endpoint peer;
  std::uint32_t opening = 0, connection = 0;
  bool ending = false, connecting = false, writing = false;
  TimePoint next_try{}, connect_by{}, close_by{};
  std::array<char, kRead> received{};
  std::string sending;

  boost::lockfree::spsc_queue<Command, boost::lockfree::capacity<kQueueDepth>> commands;
  boost::lockfree::spsc_queue<CoreResult, boost::lockfree::capacity<kQueueDepth>> results;
  std::atomic<bool> stop_anyway{false};
  Seqlock<EkiCoreState> snapshot;
  std::atomic<bool> is_open{false};
  mutable std::mutex why_mutex;  // only when a connection ends, never on the cycle
  std::string last_why;

  // Session's thread alone.
  std::uint32_t asked_opening = 0;
  std::deque<MoveResult> refusals;
};

EkiRobot::EkiRobot(asio::io_context& context, EkiConfig config, ContactGuard* guard)
    : impl_(std::make_shared<Impl>(context, std::move(config), guard)) {}

EkiRobot::~EkiRobot() {
  if (!impl_->is_open.load()) return;
  const auto done = std::make_shared<std::promise<void>>();
  const auto closed = done->get_future();
  asio::post(impl_->context, [impl = impl_, done] {
    impl->shut();
    done->set_value();
  });
  // A stopped context runs no handler any more: then nothing else uses the robot either.
  constexpr std::chrono::milliseconds kLook{5};
  while (closed.wait_for(kLook) != std::future_status::ready) {
    if (!impl_->context.stopped()) continue;
    impl_->shut();
    break;
  }
}

void EkiRobot::open() { impl_->open(); }

RobotState EkiRobot::state() const {
  if (!impl_->is_open.load()) {
    RobotState state;
    state.words = "the link to the controller is closed";
    return state;
  }
  const EkiCoreState core = impl_->snapshot.load();
  RobotState state = to_robot_state(core, impl_->peer_name);
  if (!core.connected) {
    const std::lock_guard lock(impl_->why_mutex);
    if (!impl_->last_why.empty()) state.words += ". The last try ended with: " + impl_->last_why;
  }
  return state;
}

void EkiRobot::rereference() {
  if (impl_->is_open.load()) impl_->send({Command::Kind::kRereference, impl_->asked_opening, {}});
}

void EkiRobot::begin(const Move& move) {
  if (!impl_->is_open.load()) {
    impl_->refusals.push_back(refused(move, "the link to the controller is closed"));
  } else if (!impl_->commands.push({Command::Kind::kBegin, impl_->asked_opening, move})) {
    impl_->refusals.push_back(refused(move, "too many moves at once: one at a time"));
  }
}

void EkiRobot::stop() {
  if (impl_->is_open.load()) impl_->send({Command::Kind::kStop, impl_->asked_opening, {}});
}

std::optional<MoveResult> EkiRobot::poll() {
  if (!impl_->refusals.empty()) {
    MoveResult oldest = std::move(impl_->refusals.front());
    impl_->refusals.pop_front();
    return oldest;
  }
  CoreResult result;
  if (!impl_->results.pop(result)) return std::nullopt;
  return to_move_result(result);
}

void EkiRobot::close() {
  if (!impl_->is_open.load()) return;
  asio::post(impl_->context, [impl = impl_] { impl->end(); });
}

bool EkiRobot::is_open() const { return impl_->is_open.load(); }
EkiCoreState EkiRobot::core_state() const { return impl_->snapshot.load(); }

}  // namespace cellcal::drivers
