#include "sim/krc/krc_udp.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <ctime>
#include <mutex>
#include <span>
#include <string_view>
#include <thread>
#include <vector>

#include "drivers/error.h"
#include "drivers/kuka/wire/rsi_codec.h"
#include "sim/hard_clock.h"

namespace cellcal::sim {

using drivers::Duration;
using drivers::TimePoint;

namespace {

constexpr std::string_view kTag = "<IPOC>";

std::int64_t to_ns(const timespec& t) { return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec; }

/// 0: absent.
std::uint64_t ipoc_of(std::string_view telegram) {
  const std::size_t at = telegram.find(kTag);
  std::uint64_t ipoc = 0;
  if (at == std::string_view::npos) return 0;
  std::from_chars(telegram.data() + at + kTag.size(), telegram.data() + telegram.size(), ipoc);
  return ipoc;
}

/// Time from sending a packet to receiving its reply, by the kernel's time stamps: as seen by a real
/// controller, independent of this process' load.
class ReplyClock {
 public:
  /// Requests time stamps for received data.
  void watch(int socket);
  /// To be called just before the packet is sent.
  void sent(std::string_view packet);
  /// recv() on that socket, recording the reply's time.
  ssize_t receive(int socket, std::span<char> into);

  KrcUdp::ReplyTimes figures() const;

 private:
  struct Sent {
    std::uint64_t ipoc = 0;
    std::int64_t ns = 0;
  };
  static constexpr std::size_t kKept = 256;  ///< later replies are not matched
  static constexpr std::size_t kMost = 1'000'000;

  std::array<Sent, kKept> sent_{};
  std::size_t next_ = 0;
  std::vector<float> ms_;
};

void ReplyClock::watch(int socket) {
  const int on = 1;
  // Without kernel support no figures are available.
  ::setsockopt(socket, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
  if (ms_.capacity() == 0) ms_.reserve(kMost);
}

void ReplyClock::sent(std::string_view packet) {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  sent_[next_++ % kKept] = {ipoc_of(packet), to_ns(now)};
}

ssize_t ReplyClock::receive(int socket, std::span<char> into) {
  iovec piece{into.data(), into.size()};
  alignas(cmsghdr) std::array<char, 128> control{};
  msghdr message{};
  message.msg_iov = &piece;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t got = ::recvmsg(socket, &message, 0);
  if (got <= 0) return got;
  const std::uint64_t ipoc = ipoc_of({into.data(), static_cast<std::size_t>(got)});
  const auto asked = std::find_if(sent_.begin(), sent_.end(),
                                  [&](const Sent& one) { return ipoc != 0 && one.ipoc == ipoc; });
  for (cmsghdr* c = CMSG_FIRSTHDR(&message); c != nullptr; c = CMSG_NXTHDR(&message, c)) {
    if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_TIMESTAMPNS) continue;
    timespec at{};
    std::memcpy(&at, CMSG_DATA(c), sizeof at);
    if (asked != sent_.end() && ms_.size() < kMost)
      ms_.push_back(static_cast<float>(static_cast<double>(to_ns(at) - asked->ns) * 1e-6));
  }
  return got;
}

KrcUdp::ReplyTimes ReplyClock::figures() const {
  if (ms_.empty()) return {};
  std::vector<float> sorted = ms_;
  std::sort(sorted.begin(), sorted.end());
  return {sorted.size(), sorted[sorted.size() / 2], sorted[(sorted.size() - 1) * 99 / 100],
          sorted.back()};
}

}  // namespace

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
KrcUdp::ReplyTimes KrcUdp::reply_times() const { return impl_->replies.figures(); }
bool KrcUdp::realtime_granted() const { return impl_->realtime_granted.load(); }
std::uint64_t KrcUdp::overruns() const { return impl_->overrun.load(); }

}  // namespace cellcal::sim
