#pragma once
// Clock of emulated hardware: runs independently of the load on the computer.

#include <pthread.h>
#include <sched.h>
#include <time.h>

#include <cerrno>

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

}  // namespace cellcal::sim
