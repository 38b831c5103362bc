#pragma once
// The sensor that a test talks to. The same tests are compiled twice: against the emulated
// microcontroller, and against the firmware's own core.

#ifdef CELLCAL_PEER_IS_FIRMWARE

#include "tests/drivers/contact/firmware/virtual_sensor.h"

namespace cellcal::test {
using Peer = VirtualSensor;
using PeerLine = VirtualSensorLine;
}  // namespace cellcal::test

#else

#include "sim/mcu/mcu_line.h"

namespace cellcal::test {
using Peer = sim::Microcontroller;
using PeerLine = sim::McuLine;
}  // namespace cellcal::test

#endif
