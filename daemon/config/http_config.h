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

}  // namespace cellcal::daemon
