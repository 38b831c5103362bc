#pragma once

namespace CLI {
class App;
}

namespace cellcal::daemon {

/// Declares the command; where it was named it sets `status` and may throw.
void add_new_cell_command(CLI::App& app, int& status);

}  // namespace cellcal::daemon
