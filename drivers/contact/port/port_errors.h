#pragma once
// Why a serial device could not be opened, in words that say what to do.

#include <string>

namespace cellcal::drivers {

/// "/dev/ttyACM0: no such device; is the sensor plugged in? ports here: ..."
std::string no_such_device(const std::string& device);
/// From errno of open(): permission (with the group that would help), busy, or what the system
/// says.
std::string cannot_open(const std::string& device, int error);

}  // namespace cellcal::drivers
