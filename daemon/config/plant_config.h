#pragma once
// [plant]: where the plant's MQTT broker is, and under which name this cell speaks there.

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
  std::filesystem::path ca;                ///< PEM; empty: whom the system trusts
  std::filesystem::path certificate, key;  ///< this cell's; empty: none
  std::string user;                        ///< empty: none
  std::filesystem::path password_file;     ///< its first line; empty: none
  std::vector<std::string> former;         ///< "plant/cell": names that this cell had
  std::vector<std::string> accept;  ///< kinds of proposals that are accepted without a person
  bool touches = false;             ///< each is told of
  double health_minutes = 10.0;
  double outbox_megabytes = 64.0;
  bool sparkplug = false;  ///< the cell is an edge node of Sparkplug B, too

  bool operator==(const PlantConfig&) const = default;
};

/// None: no plant is named. Throws calib::FileError.
std::optional<PlantConfig> read_plant(const calib::TomlTable& table);

}  // namespace cellcal::daemon
