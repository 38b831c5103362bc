#pragma once
// Clock of emulated hardware: runs independently of the load on the computer.

#include <pthread.h>
#include <sched.h>
#include <time.h>

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

#include "drivers/time.h"

namespace cellcal::sim {

/// Gives the calling thread SCHED_FIFO priority above the robot's I/O thread. False: not permitted.
inline bool request_hardware_priority() {
  constexpr int kPriority = 70;  // the robot's I/O thread has 60
  sched_param param{};
  param.sched_priority = kPriority;
  return pthread_setschedparam(pthread_self(), SCHED_FIFO, &param) == 0;
}

/// Steady clock, accurate to a few microseconds.
inline void sleep_until(drivers::TimePoint t) {
  // std::chrono::steady_clock is CLOCK_MONOTONIC here, so that its time points are used directly.
  const auto ns =
      std::chrono::duration_cast<std::chrono::nanoseconds>(t.time_since_epoch()).count();
  const timespec until{ns / 1'000'000'000, ns % 1'000'000'000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

/// An emulated controller in real time: its own thread and a hard clock. Derived classes connect it to its sockets.
template <class Machine>
class InRealTime {
 public:
  /// Called after each cycle on the controller's thread: a physical cell computes the contacts between `now` and the
  /// next cycle (actual_rad_at).
  using CycleHook = std::function<void(Machine&, drivers::TimePoint now)>;

  virtual ~InRealTime() = default;

  void stop() {  ///< Idempotent; joins the thread.
    stopping_ = true;
    if (thread_.joinable()) thread_.join();
  }
  /// Runs `use` between two cycles, with exclusive access to the controller. Must be short.
  void with(const std::function<void(Machine&)>& use) {
    const std::lock_guard lock(mutex_);
    use(machine_);
  }
  bool realtime_granted() const { return granted_; }  ///< requested and permitted
  std::uint64_t overruns() const {
    return overruns_;
  }  ///< cycles that began more than half a cycle late

 protected:
  /// `realtime`: SCHED_FIFO for the clock, if permitted. The destructor of each derived class calls stop().
  template <class Config>
  InRealTime(Config config, bool realtime, CycleHook on_cycle)
      : machine_(std::move(config)), on_cycle_(std::move(on_cycle)), realtime_(realtime) {}

  bool running() const { return thread_.joinable(); }
  void run() {
    stopping_ = false;
    thread_ = std::thread([this] {
      if (realtime_) granted_ = request_hardware_priority();
      drivers::TimePoint next = std::chrono::steady_clock::now();
      while (!stopping_) {
        next += machine_.cycle();
        sleep_until(next);
        if (std::chrono::steady_clock::now() - next > machine_.cycle() / 2) ++overruns_;
        const std::lock_guard lock(mutex_);
        cycle(next);
      }
    });
  }
  /// One cycle, with the hook in it.
  virtual void cycle(drivers::TimePoint now) = 0;

  Machine machine_;
  CycleHook on_cycle_;

 private:
  const bool realtime_;
  std::mutex mutex_;
  std::atomic<bool> stopping_{false}, granted_{false};
  std::atomic<std::uint64_t> overruns_{0};
  std::thread thread_;
};

}  // namespace cellcal::sim
