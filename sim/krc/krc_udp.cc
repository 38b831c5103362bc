#include "sim/krc/krc_udp.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <thread>

#include "drivers/error.h"
#include "drivers/kuka/wire/rsi_codec.h"
#include "sim/hard_clock.h"

namespace cellcal::sim {

using drivers::Duration;
using drivers::TimePoint;

struct KrcUdp::Impl {
  Impl(ControllerConfig config, KrcUdpOptions o, CycleHook hook)
      : options(std::move(o)), on_cycle(std::move(hook)), controller(std::move(config)) {}

  void open_socket() {
    sockaddr_in pc{};
    pc.sin_family = AF_INET;
    pc.sin_port = htons(options.pc_port);
    if (inet_pton(AF_INET, options.pc_address.c_str(), &pc.sin_addr) != 1) {
      throw drivers::DriverError("emulated controller: pc_address \"" + options.pc_address +
                                 "\" is not an IPv4 address");
    }
    socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (socket < 0 || ::connect(socket, reinterpret_cast<sockaddr*>(&pc), sizeof pc) != 0) {
      throw drivers::DriverError("emulated controller: no UDP socket to " + options.pc_address +
                                 ": " + std::strerror(errno));
    }
    replies.watch(socket);
  }

  void run() {
    if (options.realtime) realtime_granted = request_hardware_priority();
    TimePoint next = std::chrono::steady_clock::now();
    while (!stopping.load()) {
      next += controller.cycle();
      sleep_until(next);
      if (std::chrono::steady_clock::now() - next > controller.cycle() / 2) ++overrun;
      const std::lock_guard lock(mutex);
      cycle(next);
    }
  }

  void cycle(TimePoint now) {
    read_replies();
    const std::string_view packet = controller.tick(now);
    if (!packet.empty() && !unplugged.load()) {
      // Fails if the PC does not listen; ignored, as by the controller, and counted.
      replies.sent(packet);
      (void)::send(socket, packet.data(), packet.size(), 0);
    }
    operate(now);
    if (on_cycle) on_cycle(controller, now);
  }

  void read_replies() {
    for (;;) {
      const ssize_t got = replies.receive(socket, buffer);
      if (got < 0 && (errno == ECONNREFUSED || errno == EINTR))
        continue;  // ICMP of an earlier send
      if (got < 0) return;
      if (!unplugged.load()) controller.receive({buffer.data(), static_cast<std::size_t>(got)});
    }
  }

  // The operator resets the program and restarts it.
  void operate(TimePoint now) {
    const bool stopped =
        controller.phase() == RsiPhase::kFaulted || controller.phase() == RsiPhase::kEnded;
    if (!stopped || !options.restart_after_s) {
      stopped_at.reset();
      return;
    }
    if (!stopped_at) stopped_at = now;
    if (std::chrono::duration<double>(now - *stopped_at).count() >= *options.restart_after_s) {
      controller.rsi_on();
    }
  }

  KrcUdpOptions options;
  CycleHook on_cycle;
  std::mutex mutex;
  Controller controller;
  int socket = -1;
  ReplyClock replies;
  std::array<char, drivers::kMaxRsiDatagram> buffer{};
  std::optional<TimePoint> stopped_at;
  std::atomic<bool> stopping{false}, unplugged{false}, realtime_granted{false};
  std::atomic<std::uint64_t> overrun{0};
  std::thread thread;
};

KrcUdp::KrcUdp(ControllerConfig config, KrcUdpOptions options, CycleHook on_cycle)
    : impl_(std::make_unique<Impl>(std::move(config), std::move(options), std::move(on_cycle))) {}

KrcUdp::~KrcUdp() {
  stop();
  if (impl_->socket >= 0) ::close(impl_->socket);
}

void KrcUdp::start() {
  if (impl_->thread.joinable()) return;
  if (impl_->socket < 0) impl_->open_socket();
  impl_->stopping = false;
  impl_->controller.rsi_on();
  impl_->thread = std::thread([impl = impl_.get()] { impl->run(); });
}

void KrcUdp::stop() {
  impl_->stopping = true;
  if (impl_->thread.joinable()) impl_->thread.join();
}

void KrcUdp::with(const std::function<void(Controller&)>& use) {
  const std::lock_guard lock(impl_->mutex);
  use(impl_->controller);
}

void KrcUdp::unplug(bool unplugged) { impl_->unplugged = unplugged; }
ReplyClock::Figures KrcUdp::reply_times() const { return impl_->replies.figures(); }
bool KrcUdp::realtime_granted() const { return impl_->realtime_granted.load(); }
std::uint64_t KrcUdp::overruns() const { return impl_->overrun.load(); }

}  // namespace cellcal::sim
