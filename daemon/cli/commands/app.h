#pragma once

namespace CLI {
class App;
}

namespace cellcal::daemon {

/// All commands of cellcal with their help; the one that is named sets `status` and may throw.
void describe_cellcal(CLI::App& app, int& status);

}  // namespace cellcal::daemon
