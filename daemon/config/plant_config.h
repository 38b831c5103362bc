#pragma once
// Section [plant]: MQTT broker of the plant, and the cell's name there.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/files/toml.h"

namespace cellcal::daemon {

struct PlantConfig {
  std::string plant, cell;
  std::string host;
  std::uint16_t port = 8883;
  bool tls = true;
  std::filesystem::path ca;                ///< PEM; empty: system store
  std::filesystem::path certificate, key;  ///< client certificate of this cell; empty: none
  std::string user;                        ///< empty: none
  std::filesystem::path password_file;     ///< first line is the password; empty: none
  std::vector<std::string> former;         ///< "plant/cell": former names of this cell
  std::vector<std::string> accept;         ///< kinds of proposals accepted automatically
  bool touches = false;                    ///< publishes each touch
  double health_minutes = 10.0;
  double outbox_megabytes = 64.0;
  bool sparkplug = false;  ///< also publishes as a Sparkplug B edge node

  bool operator==(const PlantConfig&) const = default;
};

/// None: no plant configured. Throws calib::FileError.
std::optional<PlantConfig> read_plant(const calib::TomlTable& table);

}  // namespace cellcal::daemon
