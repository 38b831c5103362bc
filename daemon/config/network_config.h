#pragma once
// Section [http]: network access to the API.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/files/toml.h"

namespace cellcal::daemon {

struct HttpConfig {
  std::string address;  ///< IPv4 or IPv6 of this computer
  std::uint16_t port = 0;
  std::filesystem::path tls_certificate, tls_key;  ///< both or neither
  /// Host names of this computer used by browsers, in lower case, besides its addresses.
  std::vector<std::string> host_names;
  /// Folders of cell files that may be named over the network, besides those created there.
  std::vector<std::filesystem::path> cell_folders{"/etc/cellcal"};

  bool tls() const { return !tls_certificate.empty(); }
  bool operator==(const HttpConfig&) const = default;
};

/// host_names in lower case; may be empty. Throws calib::FileError.
std::vector<std::string> read_host_names(const calib::TomlTable& table);

/// None without `listen`. Throws calib::FileError.
std::optional<HttpConfig> read_http(const calib::TomlTable& table);

// Section [plant]: MQTT broker of the plant, and the cell's name there.

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
