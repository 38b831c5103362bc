#pragma once
// The clock of emulated hardware: it goes on whatever the programs around it do.

#include "drivers/time.h"

namespace cellcal::sim {

/// SCHED_FIFO above the robot's I/O thread for the calling thread. False: not permitted.
bool run_as_hardware();
/// Of the steady clock, to a few microseconds.
void sleep_until(drivers::TimePoint t);

}  // namespace cellcal::sim
