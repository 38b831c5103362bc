#include "sim/krc/reply_clock.h"

#include <sys/socket.h>
#include <sys/uio.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <ctime>

namespace cellcal::sim {

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

ReplyClock::Figures ReplyClock::figures() const {
  if (ms_.empty()) return {};
  std::vector<float> sorted = ms_;
  std::sort(sorted.begin(), sorted.end());
  return {sorted.size(), sorted[sorted.size() / 2], sorted[(sorted.size() - 1) * 99 / 100],
          sorted.back()};
}

}  // namespace cellcal::sim
