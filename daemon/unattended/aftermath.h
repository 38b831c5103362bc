#pragma once
// What may happen without a person behind a session that failed. One table, with the reason of each kind of
// failure; what is not allowed in it waits for somebody, however often it may pass.
//
// `resume`: gone on with, the same way as an operator does it: devices opened anew, identified and self-tested, the
// arm's position taken anew, the way looked for from where it stands. Allowed only where the arm was told to rest,
// nothing was met, and the fault was in a link or before the first motion.
// `begin`: another night's session may begin. Allowed as well where nothing in the cell had to do with it.

#include <optional>
#include <span>

#include "daemon/session/failure.h"

namespace cellcal::daemon {

struct Aftermath {
  FailureKind failure;
  /// Of the robot's link; none: whatever it is.
  std::optional<drivers::Interruption> by;
  bool resume, begin;
  const char* reason;
};

/// Every kind of failure, with what can be behind it.
std::span<const Aftermath> aftermath_table();
/// The row of this failure.
const Aftermath& aftermath(FailureKind failure, drivers::Interruption by);

}  // namespace cellcal::daemon
