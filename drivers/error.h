#pragma once
// Exceptions of the drivers, outside the cycle. On the cycle errors are values (robot.h,
// contact.h).

#include <stdexcept>

namespace cellcal::drivers {

/// An unusable device or address: states which, the reason, and the remedy.
struct DriverError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// An invalid configuration value (bad HOLDON pairing, limits, baud rate).
struct ConfigError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace cellcal::drivers
