#pragma once
// Sentences for failures to open a serial device, with the remedy.

#include <string>

namespace cellcal::drivers {

/// "/dev/ttyACM0: no such device; is the sensor plugged in? ports here: ..."
std::string no_such_device(const std::string& device);
/// From errno of open(): permission (with the required group), busy, or the system's error message.
std::string cannot_open(const std::string& device, int error);

}  // namespace cellcal::drivers
