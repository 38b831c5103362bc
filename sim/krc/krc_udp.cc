#include "sim/krc/krc_udp.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <ctime>
#include <span>
#include <string_view>
#include <vector>

#include "drivers/error.h"
#include "drivers/kuka/wire/rsi_codec.h"

namespace cellcal::sim {

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

}  // namespace

/// Time from sending a packet to receiving its reply, by the kernel's time stamps: as seen by a real
/// controller, independent of this process' load.
class KrcUdp::ReplyClock {
 public:
  /// Requests time stamps for received data. Without kernel support no figures are available.
  void watch(int socket) {
    const int on = 1;
    ::setsockopt(socket, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
    if (ms_.capacity() == 0) ms_.reserve(kMost);
  }
  /// To be called just before the packet is sent.
  void sent(std::string_view packet) {
    timespec now{};
    ::clock_gettime(CLOCK_REALTIME, &now);
    sent_[next_++ % kKept] = {ipoc_of(packet), to_ns(now)};
  }
  /// recv() on that socket, recording the reply's time.
  ssize_t receive(int socket, std::span<char> into);

  ReplyTimes figures() const {
    if (ms_.empty()) return {};
    std::vector<float> sorted = ms_;
    std::sort(sorted.begin(), sorted.end());
    return {sorted.size(), sorted[sorted.size() / 2], sorted[(sorted.size() - 1) * 99 / 100],
            sorted.back()};
  }

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

ssize_t KrcUdp::ReplyClock::receive(int socket, std::span<char> into) {
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

KrcUdp::KrcUdp(ControllerConfig config, KrcUdpOptions options, CycleHook on_cycle)
    : InRealTime(std::move(config), options.realtime, std::move(on_cycle)),
      options_(std::move(options)),
      replies_(std::make_unique<ReplyClock>()) {}

KrcUdp::~KrcUdp() {
  stop();
  if (socket_ >= 0) ::close(socket_);
}

void KrcUdp::open_socket() {
  sockaddr_in pc{};
  pc.sin_family = AF_INET;
  pc.sin_port = htons(options_.pc_port);
  if (inet_pton(AF_INET, options_.pc_address.c_str(), &pc.sin_addr) != 1) {
    throw drivers::DriverError("emulated controller: pc_address \"" + options_.pc_address +
                               "\" is not an IPv4 address");
  }
  socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (socket_ < 0 || ::connect(socket_, reinterpret_cast<sockaddr*>(&pc), sizeof pc) != 0) {
    throw drivers::DriverError("emulated controller: no UDP socket to " + options_.pc_address +
                               ": " + std::strerror(errno));
  }
  replies_->watch(socket_);
}

void KrcUdp::start() {
  if (running()) return;
  if (socket_ < 0) open_socket();
  machine_.rsi_on();
  run();
}

void KrcUdp::cycle(TimePoint now) {
  read_replies();
  const std::string_view packet = machine_.tick(now);
  if (!packet.empty() && !unplugged_) {
    // Fails if the PC does not listen; ignored, as by the controller, and counted.
    replies_->sent(packet);
    (void)::send(socket_, packet.data(), packet.size(), 0);
  }
  operate(now);
  if (on_cycle_) on_cycle_(machine_, now);
}

void KrcUdp::read_replies() {
  std::array<char, drivers::kMaxRsiDatagram> buffer;
  for (;;) {
    const ssize_t got = replies_->receive(socket_, buffer);
    if (got < 0 && (errno == ECONNREFUSED || errno == EINTR)) continue;  // ICMP of an earlier send
    if (got < 0) return;
    if (!unplugged_) machine_.receive({buffer.data(), static_cast<std::size_t>(got)});
  }
}

// The operator resets the program and restarts it.
void KrcUdp::operate(TimePoint now) {
  const RsiPhase phase = machine_.phase();
  const bool stopped = phase == RsiPhase::kFaulted || phase == RsiPhase::kEnded;
  if (!stopped || !options_.restart_after_s) {
    stopped_at_.reset();
    return;
  }
  if (!stopped_at_) stopped_at_ = now;
  if (std::chrono::duration<double>(now - *stopped_at_).count() >= *options_.restart_after_s)
    machine_.rsi_on();
}

KrcUdp::ReplyTimes KrcUdp::reply_times() const { return replies_->figures(); }

}  // namespace cellcal::sim
