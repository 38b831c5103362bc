#pragma once
// What drivers throw, away from the cycle. On the cycle errors are values (robot.h, contact.h).

#include <stdexcept>

namespace cellcal::drivers {

/// A device or address that cannot be used: says which, why, and what to do.
struct DriverError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A configuration value that must not be used (bad HOLDON pairing, limits, baud rate).
struct ConfigError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace cellcal::drivers
