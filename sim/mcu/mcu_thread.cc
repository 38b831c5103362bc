#include "sim/mcu/mcu_thread.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <pty.h>
#include <sys/eventfd.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <climits>
#include <ctime>
#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

#include "drivers/contact/wire/ctp_codec.h"
#include "sim/hard_clock.h"
#include "sim/mcu/mcu_line.h"

namespace cellcal::sim {

namespace {

using Clock = std::chrono::steady_clock;

/// Polling interval while the line is not open and cannot be waited for.
constexpr std::chrono::milliseconds kNoPeerPollPeriod{2};
constexpr std::chrono::milliseconds kLongestWait{100};
/// The kernel would otherwise delay a timed wait by 50 us to coalesce wake-ups.
constexpr unsigned long kTimerSlackNs = 1;

timespec to_timespec(Duration d) {
  const auto ns =
      std::max<std::int64_t>(0, std::chrono::duration_cast<std::chrono::nanoseconds>(d).count());
  return {static_cast<time_t>(ns / 1'000'000'000), static_cast<long>(ns % 1'000'000'000)};
}

using drivers::line_rate;

/// Rate of a pseudo-terminal without a configured one.
constexpr int kUnsetRate = 38400;

constexpr int kWireRate = 100'000'000;

sockaddr* as_sockaddr(sockaddr_in& address) { return reinterpret_cast<sockaddr*>(&address); }

}  // namespace

void Fd::reset(int fd) {
  if (fd_ >= 0) ::close(fd_);
  fd_ = fd;
}

void McuThread::fail(const char* what) {
  throw std::system_error(errno, std::generic_category(), what);
}

McuThread::McuThread(const McuOptions& options, bool realtime)
    : realtime_(realtime), mcu_(options, Clock::now()) {
  wake_.reset(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (wake_.get() < 0) fail("eventfd");
}

void McuThread::start() {
  thread_ = std::thread([this] { run(); });
}

void McuThread::stop() {
  stop_ = true;
  wake();
  if (thread_.joinable()) thread_.join();
}

void McuThread::act(const std::function<void(Microcontroller&)>& action) {
  {
    const std::lock_guard lock(mutex_);
    action(mcu_);
  }
  wake();
}

void McuThread::edge(TimePoint t, bool closed) {
  act([&](Microcontroller& mcu) { mcu.edge(t, closed); });
}

void McuThread::known_until(TimePoint t) {
  bool held = false;
  {
    const std::lock_guard lock(mutex_);
    known_until_ = t;
    held = held_;
  }
  if (held) wake();
}

void McuThread::on_output(Microcontroller::OnOutput callback) {
  act([&](Microcontroller& mcu) { mcu.on_output(std::move(callback)); });
}

void McuThread::set_faults(const McuFaults& faults) {
  act([&](Microcontroller& mcu) { mcu.set_faults(faults, Clock::now()); });
}

void McuThread::reset(std::uint8_t cause) {
  act([&](Microcontroller& mcu) { mcu.reset(Clock::now(), cause); });
}

void McuThread::inspect(const std::function<void(const Microcontroller&)>& visit) const {
  const std::lock_guard lock(mutex_);
  visit(mcu_);
}

void McuThread::wake() {
  const std::uint64_t one = 1;
  // Fails only if the counter is full, in which case the thread is awake anyway.
  [[maybe_unused]] const auto written = ::write(wake_.get(), &one, sizeof(one));
}

void McuThread::run() {
  ::prctl(PR_SET_TIMERSLACK, kTimerSlackNs);
  if (realtime_) request_hardware_priority();
  while (!stop_) {
    read_host();
    TimePoint next;
    {
      const std::lock_guard lock(mutex_);
      const TimePoint now = Clock::now();
      held_ = known_until_ < now;
      mcu_.advance(std::min(now, known_until_));
      while (const auto output = mcu_.next_output()) {
        if (!write_host(*output)) ++dropped_;
      }
      next = held_ ? now + kLongestWait : mcu_.next_event();
    }
    wait(next);
  }
}

void McuThread::wait(TimePoint next) {
  const bool with_line = can_wait();
  pollfd fds[2] = {{wake_.get(), POLLIN, 0}, {fd(), POLLIN, 0}};
  Duration longest = std::min<Duration>(next - Clock::now(), kLongestWait);
  if (!with_line) longest = std::min<Duration>(longest, kNoPeerPollPeriod);
  const timespec timeout = to_timespec(longest);
  ::ppoll(fds, with_line ? 2 : 1, &timeout, nullptr);
  std::uint64_t drained = 0;
  // An empty read is equivalent: the value is not used.
  [[maybe_unused]] const auto got = ::read(wake_.get(), &drained, sizeof(drained));
}

McuPty::McuPty(const McuPtyOptions& options)
    : McuThread(options.mcu, options.realtime), baud_(options.mcu.baud), symlink_(options.symlink) {
  open_terminal();
  if (!symlink_.empty()) link();
  start();
}

McuPty::~McuPty() {
  stop();
  std::error_code ignored;  // it may have been replaced or removed: nothing to undo then
  if (!symlink_.empty() && std::filesystem::read_symlink(symlink_, ignored) == path_) {
    std::filesystem::remove(symlink_, ignored);
  }
}

void McuPty::open_terminal() {
  int master = -1, slave = -1;
  char name[PATH_MAX] = {};
  if (::openpty(&master, &slave, nullptr, nullptr, nullptr) != 0) fail("openpty");
  master_.reset(master);
  const Fd slave_end(slave);
  termios tio{};
  if (::ttyname_r(slave, name, sizeof(name)) != 0) fail("ttyname_r");
  if (::tcgetattr(slave, &tio) != 0) fail("tcgetattr");
  ::cfmakeraw(&tio);
  if (::tcsetattr(slave, TCSANOW, &tio) != 0) fail("tcsetattr");
  if (::fcntl(master, F_SETFL, O_NONBLOCK) != 0) fail("fcntl");
  if (::fcntl(master, F_SETFD, FD_CLOEXEC) != 0) fail("fcntl");
  path_ = name;
}

void McuPty::link() {
  std::error_code error;
  if (std::filesystem::is_symlink(symlink_, error)) std::filesystem::remove(symlink_, error);
  std::filesystem::create_symlink(path_, symlink_);
}

void McuPty::listen_as_the_host_does() {
  const int rate = line_rate(master_.get());
  host_baud_ = rate == 0 || rate == kUnsetRate ? baud_ : rate;
}

void McuPty::read_host() {
  listen_as_the_host_does();
  std::array<std::uint8_t, 512> bytes{};
  while (true) {
    const ssize_t n = ::read(master_.get(), bytes.data(), bytes.size());
    if (n <= 0) break;  // no data, or the terminal is not open
    const std::span<const std::uint8_t> sent(bytes.data(), static_cast<std::size_t>(n));
    act([&](Microcontroller& mcu) {
      const TimePoint now = std::chrono::steady_clock::now();
      if (host_baud_ == baud_) {
        mcu.receive(sent, now);
      } else {
        mcu.receive(received_as(sent, host_baud_, baud_), now);
      }
    });
  }
}

/// Without a reader the data is lost, as on a real line.
bool McuPty::write_host(const Microcontroller::Output& output) {
  std::span<const std::uint8_t> bytes = output.frame.bytes();
  std::vector<std::uint8_t> garbled;
  if (host_baud_ != baud_) {
    garbled = received_as(bytes, baud_, host_baud_);
    bytes = garbled;
  }
  return operator_present_ &&
         ::write(master_.get(), bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size());
}

/// While the terminal is not open, poll() returns immediately with a hang-up.
bool McuPty::can_wait() {
  pollfd terminal{master_.get(), POLLIN, 0};
  ::poll(&terminal, 1, 0);
  operator_present_ = (terminal.revents & POLLHUP) == 0;
  return operator_present_;
}

McuOptions on_ethernet(McuOptions options) {
  options.baud = kWireRate;
  options.datagrams = true;
  options.circuit = kEthernetBoard;
  options.firmware = {1, 2, 0};
  return options;
}

McuUdp::McuUdp(const McuUdpOptions& options)
    : McuThread(on_ethernet(options.mcu), options.realtime) {
  socket_.reset(::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (socket_.get() < 0) fail("socket");
  sockaddr_in own{};
  own.sin_family = AF_INET;
  own.sin_port = htons(options.port);
  errno = EINVAL;
  if (::inet_pton(AF_INET, options.address.c_str(), &own.sin_addr) != 1) fail("address");
  socklen_t size = sizeof own;
  if (::bind(socket_.get(), as_sockaddr(own), size) != 0) fail("bind");
  if (::getsockname(socket_.get(), as_sockaddr(own), &size) != 0) fail("getsockname");
  path_ = "udp:" + options.address + ":" + std::to_string(ntohs(own.sin_port));
  start();
}

void McuUdp::read_host() {
  std::array<std::uint8_t, 512> bytes{};
  while (true) {
    sockaddr_in from{};
    socklen_t size = sizeof from;
    const ssize_t n =
        ::recvfrom(socket_.get(), bytes.data(), bytes.size(), 0, as_sockaddr(from), &size);
    if (n < 0 && errno == ECONNREFUSED) continue;  // from an earlier send to a closed socket
    if (n < 0) break;
    act([&](Microcontroller& mcu) {
      mcu.receive({bytes.data(), static_cast<std::size_t>(n)}, std::chrono::steady_clock::now(),
                  {from.sin_addr.s_addr, from.sin_port});
    });
  }
}

bool McuUdp::write_host(const Microcontroller::Output& output) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = output.to.port;
  to.sin_addr.s_addr = output.to.address;
  const auto bytes = output.frame.bytes();
  return ::sendto(socket_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL, as_sockaddr(to),
                  sizeof to) == static_cast<ssize_t>(bytes.size());
}

}  // namespace cellcal::sim
