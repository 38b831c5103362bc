#pragma once
// What begins without a person, and when.

#include <string>

#include "daemon/cli/client.h"

namespace cellcal::daemon {

int show_schedule(const Connection& daemon);
/// Begins a session that the schedule has on request; 1 where it may not, with the reason.
int begin_scheduled(const Connection& daemon, const std::string& name);
/// Somebody has looked at the cell and the arm.
int release_schedule(const Connection& daemon);

}  // namespace cellcal::daemon
