#include "sim/mcu/mcu_pty.h"

#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <termios.h>
#include <unistd.h>

#include <climits>
#include <filesystem>
#include <system_error>
#include <vector>

#include "drivers/contact/wire/line_rate.h"
#include "sim/mcu/mcu_line.h"

namespace cellcal::sim {

namespace {

using drivers::line_rate;

/// Rate of a pseudo-terminal without a configured one.
constexpr int kUnsetRate = 38400;

}  // namespace

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
  pollfd look{master_.get(), POLLIN, 0};
  ::poll(&look, 1, 0);
  operator_present_ = (look.revents & POLLHUP) == 0;
  return operator_present_;
}

}  // namespace cellcal::sim
