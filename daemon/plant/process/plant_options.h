#pragma once
// Command line of cellcal-plant.

#include <string>

namespace CLI {
class App;
}

namespace cellcal::daemon::plant {

struct PlantOptions {
  std::string socket = "/run/cellcal/plant/cellcald.sock";
  double longest_wait_s = 60.0;
};

void describe_cellcal_plant(CLI::App& app, PlantOptions& options);

}  // namespace cellcal::daemon::plant
