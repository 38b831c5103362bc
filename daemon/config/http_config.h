#pragma once
// [http]: whether and how the API is to be had over the network.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/files/toml.h"

namespace cellcal::daemon {

struct HttpConfig {
  std::string address;  ///< IPv4 or IPv6, of this computer
  std::uint16_t port = 0;
  std::filesystem::path tls_certificate, tls_key;  ///< both or none
  /// Names, in lower case, under which browsers find this computer, beside its addresses.
  std::vector<std::string> host_names;
  /// Where cell files lie that may be named over the network, beside those that were made there.
  std::vector<std::filesystem::path> cell_folders{"/etc/cellcal"};

  bool tls() const { return !tls_certificate.empty(); }
  bool operator==(const HttpConfig&) const = default;
};

/// host_names: in lower case; empty where there are none. Throws calib::FileError.
std::vector<std::string> read_host_names(const calib::TomlTable& table);

/// Nothing without `listen`. Throws calib::FileError.
std::optional<HttpConfig> read_http(const calib::TomlTable& table);

}  // namespace cellcal::daemon
