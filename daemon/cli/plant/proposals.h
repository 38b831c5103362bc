#pragma once
// What the plant proposed to this cell. Each returns its exit status and throws when it failed.

#include <string>

#include "daemon/cli/client.h"

namespace cellcal::daemon {

int list_proposals(const Connection& daemon);
int accept_proposal(const Connection& daemon, const std::string& id, const std::string& reason);
int refuse_proposal(const Connection& daemon, const std::string& id, const std::string& reason);

}  // namespace cellcal::daemon
