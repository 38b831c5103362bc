#pragma once

#include <memory>

#include "daemon/cli/client.h"

namespace CLI {
class App;
}

namespace cellcal::daemon {

/// --socket and --json.
std::shared_ptr<Connection> add_connection(CLI::App* command);

}  // namespace cellcal::daemon
