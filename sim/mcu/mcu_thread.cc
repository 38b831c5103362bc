#include "sim/mcu/mcu_thread.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <ctime>
#include <system_error>
#include <utility>

#include "sim/hard_clock.h"

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

void McuThread::on_output(Microcontroller::OnOutput callback) {
  act([&](Microcontroller& mcu) { mcu.on_output(std::move(callback)); });
}

void McuThread::set_faults(const McuFaults& faults) {
  act([&](Microcontroller& mcu) { mcu.set_faults(faults, Clock::now()); });
}

void McuThread::reset(std::uint8_t cause) {
  act([&](Microcontroller& mcu) { mcu.reset(Clock::now(), cause); });
}

void McuThread::inspect(const std::function<void(const Microcontroller&)>& look) const {
  const std::lock_guard lock(mutex_);
  look(mcu_);
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
      mcu_.advance(Clock::now());
      while (const auto output = mcu_.next_output()) {
        if (!write_host(*output)) ++dropped_;
      }
      next = mcu_.next_event();
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

}  // namespace cellcal::sim
