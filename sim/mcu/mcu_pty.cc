#include "sim/mcu/mcu_pty.h"

#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <sys/eventfd.h>
#include <sys/prctl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <climits>
#include <ctime>
#include <filesystem>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

#include "drivers/contact/wire/line_rate.h"
#include "sim/hard_clock.h"
#include "sim/mcu/wrong_rate.h"

namespace cellcal::sim {

namespace {

using drivers::line_rate;
using Clock = std::chrono::steady_clock;

/// While nobody has the terminal open, poll() returns at once with a hang-up; look this often.
constexpr std::chrono::milliseconds kNobodyThere{2};
constexpr std::chrono::milliseconds kLongestWait{100};
/// Of a pseudo-terminal whose rate nobody has set.
constexpr int kUnsetRate = 38400;
/// The kernel would otherwise delay a timed wait by 50 us to save wake-ups.
constexpr unsigned long kTimerSlackNs = 1;

[[noreturn]] void fail(const char* what) {
  throw std::system_error(errno, std::generic_category(), what);
}

class Fd {
 public:
  Fd() = default;
  explicit Fd(int fd) : fd_(fd) {}
  Fd(const Fd&) = delete;
  Fd& operator=(const Fd&) = delete;
  ~Fd() { reset(); }
  void reset(int fd = -1) {
    if (fd_ >= 0) ::close(fd_);
    fd_ = fd;
  }
  int get() const { return fd_; }

 private:
  int fd_ = -1;
};

timespec to_timespec(Duration d) {
  const auto ns =
      std::max<std::int64_t>(0, std::chrono::duration_cast<std::chrono::nanoseconds>(d).count());
  return {static_cast<time_t>(ns / 1'000'000'000), static_cast<long>(ns % 1'000'000'000)};
}

}  // namespace

class McuPty::Impl {
 public:
  explicit Impl(const McuPtyOptions& options)
      : realtime_(options.realtime),
        baud_(options.mcu.baud),
        symlink_(options.symlink),
        mcu_(options.mcu, Clock::now()) {
    open_terminal();
    wake_.reset(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
    if (wake_.get() < 0) fail("eventfd");
    if (!symlink_.empty()) link();
    thread_ = std::thread([this] { run(); });
  }

  ~Impl() {
    stop_ = true;
    wake();
    thread_.join();
    std::error_code ignored;  // somebody may have replaced or removed it: nothing to undo then
    if (!symlink_.empty() && std::filesystem::read_symlink(symlink_, ignored) == path_) {
      std::filesystem::remove(symlink_, ignored);
    }
  }

  template <class Action>
  void act(Action action) {
    {
      const std::lock_guard lock(mutex_);
      action(mcu_);
    }
    wake();
  }

  void inspect(const std::function<void(const Microcontroller&)>& look) const {
    const std::lock_guard lock(mutex_);
    look(mcu_);
  }

  const std::string& path() const { return path_; }
  std::uint64_t dropped() const { return dropped_; }

 private:
  void open_terminal() {
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

  void link() {
    std::error_code error;
    if (std::filesystem::is_symlink(symlink_, error)) std::filesystem::remove(symlink_, error);
    std::filesystem::create_symlink(path_, symlink_);
  }

  void wake() {
    const std::uint64_t one = 1;
    // Fails only when the counter is full, and then the thread is awake anyway.
    [[maybe_unused]] const auto written = ::write(wake_.get(), &one, sizeof(one));
  }

  void run() {
    ::prctl(PR_SET_TIMERSLACK, kTimerSlackNs);
    if (realtime_) run_as_hardware();
    while (!stop_) {
      listen_as_the_host_does();
      read_host();
      TimePoint next;
      {
        const std::lock_guard lock(mutex_);
        mcu_.advance(Clock::now());
        while (const auto output = mcu_.next_output()) write_host(output->frame.bytes());
        next = mcu_.next_event();
      }
      wait(next);
    }
  }

  void listen_as_the_host_does() {
    const int rate = line_rate(master_.get());
    host_baud_ = rate == 0 || rate == kUnsetRate ? baud_ : rate;
  }

  void read_host() {
    std::array<std::uint8_t, 512> bytes{};
    while (true) {
      const ssize_t n = ::read(master_.get(), bytes.data(), bytes.size());
      if (n <= 0) break;  // nothing there, or nobody has it open
      const std::span<const std::uint8_t> sent(bytes.data(), static_cast<std::size_t>(n));
      const std::lock_guard lock(mutex_);
      if (host_baud_ == baud_) {
        mcu_.receive(sent, Clock::now());
      } else {
        mcu_.receive(as_heard(sent, host_baud_, baud_), Clock::now());
      }
    }
  }

  /// A frame goes out whole or not at all; nobody reading means that it is lost, as on a real line.
  void write_host(std::span<const std::uint8_t> bytes) {
    std::vector<std::uint8_t> garbled;
    if (host_baud_ != baud_) {
      garbled = as_heard(bytes, baud_, host_baud_);
      bytes = garbled;
    }
    if (!somebody_there_ ||
        ::write(master_.get(), bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size())) {
      ++dropped_;
    }
  }

  void wait(TimePoint next) {
    pollfd fds[2] = {{master_.get(), POLLIN, 0}, {wake_.get(), POLLIN, 0}};
    ::poll(&fds[0], 1, 0);
    somebody_there_ = (fds[0].revents & POLLHUP) == 0;
    const TimePoint now = Clock::now();
    Duration wait_time = std::min<Duration>(next - now, kLongestWait);
    pollfd* first = &fds[0];
    nfds_t count = 2;
    if (!somebody_there_) {
      wait_time = std::min<Duration>(wait_time, kNobodyThere);
      first = &fds[1];
      count = 1;
    }
    const timespec timeout = to_timespec(wait_time);
    ::ppoll(first, count, &timeout, nullptr);
    std::uint64_t drained = 0;
    // Empty is as good as read: it only says that somebody called.
    [[maybe_unused]] const auto got = ::read(wake_.get(), &drained, sizeof(drained));
  }

  const bool realtime_;
  const int baud_;
  int host_baud_ = baud_;
  std::string path_, symlink_;
  Fd master_, wake_;
  mutable std::mutex mutex_;
  Microcontroller mcu_;
  std::atomic<bool> stop_{false};
  std::atomic<std::uint64_t> dropped_{0};
  bool somebody_there_ = false;
  std::thread thread_;
};

McuPty::McuPty(const McuPtyOptions& options) : impl_(std::make_unique<Impl>(options)) {}

McuPty::~McuPty() = default;

const std::string& McuPty::path() const { return impl_->path(); }

void McuPty::on_output(Microcontroller::OnOutput callback) {
  impl_->act([&](Microcontroller& mcu) { mcu.on_output(std::move(callback)); });
}
void McuPty::edge(TimePoint t, bool closed) {
  impl_->act([&](Microcontroller& mcu) { mcu.edge(t, closed); });
}

void McuPty::set_faults(const McuFaults& faults) {
  impl_->act([&](Microcontroller& mcu) { mcu.set_faults(faults, Clock::now()); });
}

void McuPty::reset(std::uint8_t cause) {
  impl_->act([&](Microcontroller& mcu) { mcu.reset(Clock::now(), cause); });
}

void McuPty::inspect(const std::function<void(const Microcontroller&)>& look) const {
  impl_->inspect(look);
}

std::uint64_t McuPty::dropped() const { return impl_->dropped(); }

}  // namespace cellcal::sim
