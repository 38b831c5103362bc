#pragma once
// Clock of emulated hardware: runs independently of the load on the computer.

#include "drivers/time.h"

namespace cellcal::sim {

/// Gives the calling thread SCHED_FIFO priority above the robot's I/O thread. False: not permitted.
bool request_hardware_priority();
/// Steady clock, accurate to a few microseconds.
void sleep_until(drivers::TimePoint t);

}  // namespace cellcal::sim
