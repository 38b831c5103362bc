#pragma once
// Command line of cellcald.

#include <string>

namespace CLI {
class App;
}

namespace cellcal::daemon {

struct DaemonOptions {
  std::string config_file = "/etc/cellcal/cellcald.toml";
  bool check = false, verbose = false;
};

void describe_cellcald(CLI::App& app, DaemonOptions& options);

}  // namespace cellcal::daemon
