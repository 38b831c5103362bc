#include "daemon/config/http_config.h"

#include <algorithm>
#include <boost/asio/ip/address.hpp>
#include <charconv>

#include "calib/files/text.h"
#include "daemon/config/config_values.h"

namespace cellcal::daemon {

namespace {

using boost::asio::ip::address;
using calib::TomlTable;

constexpr std::size_t kLongestName = 253;

std::string shown_in_quotes(const std::string& text) { return "\"" + calib::shown(text) + "\""; }

[[noreturn]] void no_address(const TomlTable& table, const std::string& text) {
  table.fail("listen", shown_in_quotes(text) +
                           " is not an address with a port. Examples: \"127.0.0.1:8080\", "
                           "\"10.0.0.5:8443\", \"[::1]:8080\"");
}

std::uint16_t port_of(const TomlTable& table, const std::string& text, const std::string& port) {
  std::uint16_t value = 0;
  const auto [end, code] = std::from_chars(port.data(), port.data() + port.size(), value);
  if (code != std::errc() || end != port.data() + port.size() || value == 0) {
    no_address(table, text);
  }
  return value;
}

/// "127.0.0.1:8080", "[::1]:8080".
address read_listen(const TomlTable& table, HttpConfig& http) {
  const std::string text = table.string("listen");
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) no_address(table, text);
  std::string host = text.substr(0, colon);
  const bool brackets = host.size() > 2 && host.front() == '[' && host.back() == ']';
  if (brackets) host = host.substr(1, host.size() - 2);
  boost::system::error_code wrong;
  const address at = boost::asio::ip::make_address(host, wrong);
  if (wrong || at.is_v6() != brackets || at.is_multicast()) no_address(table, text);
  http.address = at.to_string();
  http.port = port_of(table, text, text.substr(colon + 1));
  return at;
}

void read_tls(const TomlTable& table, HttpConfig& http) {
  const bool certificate = table.has("tls_certificate"), key = table.has("tls_key");
  if (certificate != key) {
    table.fail(certificate ? "tls_certificate" : "tls_key",
               std::string("needs ") + (certificate ? "tls_key" : "tls_certificate") +
                   " as well: give both or none");
  }
  if (!certificate) return;
  http.tls_certificate = read_path(table, "tls_certificate");
  http.tls_key = read_path(table, "tls_key");
}

std::string read_host_name(const TomlTable& table, std::string name) {
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char letter) {
    return 'A' <= letter && letter <= 'Z' ? static_cast<char>(letter + 'a' - 'A')
                                          : static_cast<char>(letter);
  });
  const bool sound =
      !name.empty() && name.size() <= kLongestName &&
      name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789.-") == std::string::npos;
  if (!sound) {
    table.fail("host_names", shown_in_quotes(name) +
                                 " is not a host name: write it without port, as in "
                                 "\"cell7.plant.example\"");
  }
  return name;
}

std::vector<std::filesystem::path> read_folders(const TomlTable& table, const char* key) {
  std::vector<std::filesystem::path> folders;
  for (const std::string& name : table.strings(key)) {
    folders.emplace_back(name);
    if (!folders.back().is_absolute())
      table.fail(key, shown_in_quotes(name) + " is not an absolute path");
  }
  return folders;
}

}  // namespace

std::vector<std::string> read_host_names(const TomlTable& table) {
  std::vector<std::string> names;
  if (!table.has("host_names")) return names;
  for (const std::string& name : table.strings("host_names"))
    names.push_back(read_host_name(table, name));
  return names;
}

std::optional<HttpConfig> read_http(const TomlTable& table) {
  if (!table.has("listen")) {
    for (const char* key :
         {"tls_certificate", "tls_key", "allow_plain", "host_names", "cell_folders"}) {
      if (table.has(key)) {
        table.fail(key, "has no effect without listen. Set listen, such as \"127.0.0.1:8080\"");
      }
    }
    table.refuse_unknown();
    return std::nullopt;
  }
  HttpConfig http;
  const address at = read_listen(table, http);
  read_tls(table, http);
  const bool plain = table.boolean_or("allow_plain", false);
  if (!at.is_loopback() && !http.tls() && !plain) {
    table.fail("listen",
               shown_in_quotes(http.address) +
                   " is reachable from the network, and tokens would be sent in clear text. "
                   "Give tls_certificate and tls_key, or set allow_plain = true");
  }
  http.host_names = read_host_names(table);
  if (table.has("cell_folders")) http.cell_folders = read_folders(table, "cell_folders");
  table.refuse_unknown();
  return http;
}

}  // namespace cellcal::daemon
