#pragma once
// 'cellcal token': who may come in over the network.

#include <string>

#include "daemon/cli/client.h"

namespace cellcal::daemon {

/// Prints the token, which nobody can show again.
int add_token(const Connection& daemon, const std::string& name, const std::string& role);
int list_tokens(const Connection& daemon);
int remove_token(const Connection& daemon, const std::string& name);

}  // namespace cellcal::daemon
