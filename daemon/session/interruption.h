#pragma once
// Which failures are harmless: those after which a session may go on by itself, where its owner
// allows it ([session] retries). One table, with the reason of each; what is not harmless in it is
// never retried, however often it may pass.
//
// Harmless is only what leaves the controller at work and the arm where it was commanded to rest.
// Whether that holds is proven each time before anything moves: the same session of the controller
// is back within Timeouts::recovering, no further gap or late reply within Timeouts::watching, the
// sensor's self-test has passed (or the arm stands in a contact that it was making), the position
// is taken over anew, and the arm is where it was left.

#include <optional>
#include <span>

#include "daemon/session/failure.h"
#include "drivers/robot.h"

namespace cellcal::daemon {

struct Harm {
  FailureKind failure;
  /// Of the robot's link; none: whatever it is.
  std::optional<drivers::Interruption> by;
  bool harmless;
  const char* reason;
};

/// Every kind of failure, with what can be behind it.
std::span<const Harm> harm_table();

/// A failure of the robot's link that is harmless in itself.
bool is_harmless(FailureKind failure, drivers::Interruption by);

/// The arm was left where it is, when no axis is farther from there: at 40 deg/s three cycles whose
/// replies were lost leave 0.5 deg, and by hand it is not moved while RSI runs.
inline constexpr double kLeftThereRad = 0.0175;  // 1 deg

}  // namespace cellcal::daemon
