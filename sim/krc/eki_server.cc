#include "sim/krc/eki_server.h"

#include <arpa/inet.h>
#include <netinet/tcp.h>
#include <pthread.h>
#include <sched.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <thread>

#include "drivers/error.h"

namespace cellcal::sim {
namespace {

using drivers::TimePoint;

// As the RSI emulator: it stands for hardware, and goes before the robot's I/O thread.
constexpr int kPriority = 70;
constexpr int kBacklog = 4;
// A client that does not read: its states wait here, and then it is dropped.
constexpr std::size_t kMostUnsent = 1 << 20;

void sleep_until(TimePoint t) {
  const auto ns =
      std::chrono::duration_cast<std::chrono::nanoseconds>(t.time_since_epoch()).count();
  const timespec until{ns / 1'000'000'000, ns % 1'000'000'000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

}  // namespace

struct EkiServer::Impl {
  Impl(EkiControllerConfig config, EkiServerOptions o, CycleHook hook)
      : options(std::move(o)), on_cycle(std::move(hook)), controller(std::move(config)) {}

  ~Impl() {
    if (client >= 0) ::close(client);
    if (listener >= 0) ::close(listener);
  }

  void listen_on() {
    sockaddr_in here{};
    here.sin_family = AF_INET;
    here.sin_port = htons(options.port.value_or(controller.channel().config().port));
    if (inet_pton(AF_INET, options.address.c_str(), &here.sin_addr) != 1) {
      throw drivers::DriverError("emulated EKI controller: \"" + options.address +
                                 "\" is not an IPv4 address");
    }
    listener = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    const int on = 1;
    socklen_t size = sizeof here;
    if (listener < 0 || ::setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) != 0 ||
        ::bind(listener, reinterpret_cast<sockaddr*>(&here), sizeof here) != 0 ||
        ::listen(listener, kBacklog) != 0 ||
        ::getsockname(listener, reinterpret_cast<sockaddr*>(&here), &size) != 0) {
      throw drivers::DriverError("emulated EKI controller: cannot listen on TCP " +
                                 options.address + ":" + std::to_string(ntohs(here.sin_port)) +
                                 ": " + std::strerror(errno));
    }
    port = ntohs(here.sin_port);
  }

  void run() {
    if (options.realtime) {
      sched_param param{};
      param.sched_priority = kPriority;
      (void)pthread_setschedparam(pthread_self(), SCHED_FIFO, &param);
    }
    TimePoint next = std::chrono::steady_clock::now();
    while (!stopping.load()) {
      next += controller.cycle();
      sleep_until(next);
      const std::lock_guard lock(mutex);
      cycle(next);
    }
  }

  void cycle(TimePoint now) {
    const bool cable = !unplugged.load();
    if (cable) {
      accept_clients();
      take();
    }
    controller.tick(now);
    if (on_cycle) on_cycle(controller, now);
    unsent += controller.take_output();
    if (client >= 0 && (!controller.connected() || unsent.size() > kMostUnsent)) drop();
    if (cable) give();
  }

  void accept_clients() {
    for (;;) {
      const int fresh = ::accept4(listener, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
      if (fresh < 0) return;
      if (!controller.connect()) {
        ++refused;
        ::close(fresh);
        continue;
      }
      if (client >= 0) ::close(client);
      client = fresh;
      unsent.clear();
      const int on = 1;
      (void)::setsockopt(client, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    }
  }

  void take() {
    while (client >= 0) {
      const ssize_t got = ::recv(client, buffer.data(), buffer.size(), 0);
      if (got < 0 && errno == EINTR) continue;
      if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return;
      if (got <= 0) return drop();
      controller.receive({buffer.data(), static_cast<std::size_t>(got)});
      if (!controller.connected()) return drop();
    }
  }

  void give() {
    while (client >= 0 && !unsent.empty()) {
      const ssize_t sent = ::send(client, unsent.data(), unsent.size(), MSG_NOSIGNAL);
      if (sent < 0 && errno == EINTR) continue;
      if (sent < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return;
      if (sent <= 0) return drop();
      unsent.erase(0, static_cast<std::size_t>(sent));
    }
    if (client < 0) unsent.clear();
  }

  void drop() {
    ::close(client);
    client = -1;
    unsent.clear();
    controller.disconnect();
  }

  EkiServerOptions options;
  CycleHook on_cycle;
  std::mutex mutex;
  EkiController controller;
  int listener = -1, client = -1;
  std::array<char, 4096> buffer{};
  std::string unsent;
  std::atomic<bool> stopping{false}, unplugged{false};
  std::atomic<std::uint16_t> port{0};
  std::atomic<std::uint64_t> refused{0};
  std::thread thread;
};

EkiServer::EkiServer(EkiControllerConfig config, EkiServerOptions options, CycleHook on_cycle)
    : impl_(std::make_unique<Impl>(std::move(config), std::move(options), std::move(on_cycle))) {}

EkiServer::~EkiServer() { stop(); }

void EkiServer::start() {
  if (impl_->thread.joinable()) return;
  if (impl_->listener < 0) impl_->listen_on();
  impl_->stopping = false;
  impl_->controller.start_program();
  impl_->thread = std::thread([impl = impl_.get()] { impl->run(); });
}

void EkiServer::stop() {
  impl_->stopping = true;
  if (impl_->thread.joinable()) impl_->thread.join();
}

void EkiServer::with(const std::function<void(EkiController&)>& use) {
  const std::lock_guard lock(impl_->mutex);
  use(impl_->controller);
}

void EkiServer::unplug(bool unplugged) { impl_->unplugged = unplugged; }
std::uint16_t EkiServer::port() const { return impl_->port.load(); }
std::uint64_t EkiServer::refused_clients() const { return impl_->refused.load(); }

}  // namespace cellcal::sim
