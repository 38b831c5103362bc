#pragma once
// Name and priority of the I/O threads of a port.

#include <pthread.h>
#include <sched.h>

namespace cellcal::drivers {

/// Sets the calling thread's name (at most 15 characters) and SCHED_FIFO priority; 0: none.
inline void become_port_thread(const char* name, int priority) {
  ::pthread_setname_np(::pthread_self(), name);
  if (priority == 0) return;
  sched_param param{};
  param.sched_priority = priority;
  // If not permitted: the robot's thread, which requests the same, reports the warning.
  [[maybe_unused]] const int refused =
      ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &param);
}

}  // namespace cellcal::drivers
