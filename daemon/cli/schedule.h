#pragma once
// Unattended sessions and their times.

#include <string>

#include "daemon/cli/client.h"

namespace cellcal::daemon {

int show_schedule(const Connection& daemon);
/// Begins a scheduled session on request; 1 with the reason where it may not begin.
int begin_scheduled(const Connection& daemon, const std::string& name);
/// Confirms that cell and arm were inspected.
int release_schedule(const Connection& daemon);

}  // namespace cellcal::daemon
