#pragma once
// Permitted unattended actions after a failed session. One table, with the reason for each kind of failure;
// everything else requires an operator, however rare.
//
// `resume`: continues as an operator would: devices reopened, identified and self-tested, the arm referenced
// anew, the path planned from its current position. Permitted only where the arm was commanded to rest,
// without contact, and the fault was in a link or before the first motion. `begin`: a session of a later
// window may begin. Also permitted where the cell was not involved.

#include <optional>
#include <span>

#include "daemon/session/failure.h"

namespace cellcal::daemon {

struct FailurePolicy {
  FailureKind failure;
  /// Cause in the robot's link; none: any.
  std::optional<drivers::Interruption> by;
  bool resume, begin;
  const char* reason;
};

/// Every kind of failure with its possible causes.
std::span<const FailurePolicy> failure_policies();
/// Row of this failure.
const FailurePolicy& aftermath(FailureKind failure, drivers::Interruption by);

}  // namespace cellcal::daemon
