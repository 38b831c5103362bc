#pragma once
// Command cellcal token: tokens for network access.

#include <string>

#include "daemon/cli/client.h"

namespace cellcal::daemon {

/// Prints the token, which cannot be shown again.
int add_token(const Connection& daemon, const std::string& name, const std::string& role);
int list_tokens(const Connection& daemon);
int remove_token(const Connection& daemon, const std::string& name);

}  // namespace cellcal::daemon
