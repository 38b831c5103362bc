#include "daemon/config/network_config.h"

#include <algorithm>
#include <boost/asio/ip/address.hpp>
#include <cctype>

#include "daemon/config/config_values.h"
#include "daemon/plant/messages/text_fields.h"

namespace cellcal::daemon {

namespace {

using boost::asio::ip::address;
using calib::TomlTable;

constexpr std::size_t kLongestName = 253;

[[noreturn]] void no_address(const TomlTable& table, const std::string& text) {
  table.fail("listen", in_quotes(text) +
                           " is not an address with a port. Examples: \"127.0.0.1:8080\", "
                           "\"10.0.0.5:8443\", \"[::1]:8080\"");
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
  const auto port = port_of(text.substr(colon + 1));
  if (wrong || at.is_v6() != brackets || at.is_multicast() || !port) no_address(table, text);
  http.address = at.to_string();
  http.port = *port;
  return at;
}

std::string read_host_name(const TomlTable& table, std::string name) {
  for (char& c : name) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (name.empty() || name.size() > kLongestName || !has_letters_digits_and(".-", name)) {
    table.fail("host_names", in_quotes(name) +
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
      table.fail(key, in_quotes(name) + " is not an absolute path");
  }
  return folders;
}

constexpr std::size_t kLongestUser = 64;
constexpr std::uint16_t kTlsPort = 8883, kPlainPort = 1883;

std::string read_plant_name(const TomlTable& table, const char* key) {
  const std::string name = table.string(key);
  if (!plant::is_name(name))
    table.fail(
        key, in_quotes(name) + " must have 1 to 64 of A-Z a-z 0-9 _ -: it is part of MQTT topics");
  return name;
}

std::string read_host(const TomlTable& table) {
  const std::string host = table.string("broker");
  if (host.empty() || host.size() > kLongestName || !has_letters_digits_and(".-:", host))
    table.fail(
        "broker",
        in_quotes(host) + " is not a host: write it without port, as in \"broker.plant.example\"");
  return host;
}

bool is_this_computer(const std::string& host) {
  boost::system::error_code none;
  const auto address = boost::asio::ip::make_address(host, none);
  return host == "localhost" || (!none && address.is_loopback());
}

void read_tls(const TomlTable& table, PlantConfig& plant) {
  plant.tls = table.boolean_or("tls", true);
  for (const char* key : {"ca", "certificate", "key"})
    if (table.has(key) && !plant.tls) table.fail(key, "has no effect with tls = false");
  if (table.has("ca")) plant.ca = read_path(table, "ca");
  read_pair(table, "certificate", plant.certificate, "key", plant.key);
}

void read_login(const TomlTable& table, PlantConfig& plant) {
  if (table.has("user")) {
    plant.user = table.string("user");
    if (plant.user.empty() || plant.user.size() > kLongestUser || !is_visible_ascii(plant.user))
      table.fail("user", "must have 1 to 64 visible ASCII characters");
  }
  if (!table.has("password_file")) return;
  if (plant.user.empty()) table.fail("password_file", "has no effect without user");
  plant.password_file = read_path(table, "password_file");
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
    refuse_without(table, "listen. Set listen, such as \"127.0.0.1:8080\"",
                   {"tls_certificate", "tls_key", "allow_plain", "host_names", "cell_folders"});
    table.refuse_unknown();
    return std::nullopt;
  }
  HttpConfig http;
  const address at = read_listen(table, http);
  read_pair(table, "tls_certificate", http.tls_certificate, "tls_key", http.tls_key);
  const bool plain = table.boolean_or("allow_plain", false);
  if (!at.is_loopback() && !http.tls() && !plain) {
    table.fail("listen",
               in_quotes(http.address) +
                   " is reachable from the network, and tokens would be sent in clear text. "
                   "Give tls_certificate and tls_key, or set allow_plain = true");
  }
  http.host_names = read_host_names(table);
  if (table.has("cell_folders")) http.cell_folders = read_folders(table, "cell_folders");
  table.refuse_unknown();
  return http;
}

std::optional<PlantConfig> read_plant(const TomlTable& table) {
  if (!table.has("plant")) {
    refuse_without(table, "plant. Set plant, cell and broker",
                   {"cell", "broker", "port", "tls", "ca", "certificate", "key", "user",
                    "password_file", "allow_plain", "former", "accept", "touches", "health_minutes",
                    "outbox_megabytes", "sparkplug"});
    table.refuse_unknown();
    return std::nullopt;
  }
  PlantConfig plant;
  plant.plant = read_plant_name(table, "plant");
  plant.cell = read_plant_name(table, "cell");
  plant.host = read_host(table);
  read_tls(table, plant);
  plant.port = static_cast<std::uint16_t>(
      integer_or(table, "port", plant.tls ? kTlsPort : kPlainPort, 1, 65535));
  read_login(table, plant);
  const bool plain = table.boolean_or("allow_plain", false);
  if (!plant.tls && !plain && !is_this_computer(plant.host))
    table.fail(
        "tls",
        "without TLS facts and password are sent in clear text. Set tls = true, or allow_plain = true");
  if (table.has("former")) plant.former = table.strings("former");
  for (const std::string& name : plant.former) {
    const std::size_t cut = std::min(name.find('/'), name.size());
    if (!plant::is_name(name.substr(0, cut)) || cut == name.size() ||
        !plant::is_name(name.substr(cut + 1)))
      table.fail("former", in_quotes(name) + " must be PLANT/CELL, as in \"graz/weld-3\"");
  }
  if (table.has("accept")) plant.accept = table.strings("accept");
  for (const std::string& kind : plant.accept)
    if (kind != "calibrate" && kind != "check" && kind != "activate")
      table.fail(
          "accept",
          in_quotes(kind) +
              " must be \"calibrate\", \"check\" or \"activate\": schedules and priors require an "
              "operator");
  plant.touches = table.boolean_or("touches", plant.touches);
  plant.health_minutes = table.number_or("health_minutes", plant.health_minutes, {1.0, 1440.0});
  plant.outbox_megabytes =
      table.number_or("outbox_megabytes", plant.outbox_megabytes, {1.0, 10000.0});
  plant.sparkplug = table.boolean_or("sparkplug", plant.sparkplug);
  table.refuse_unknown();
  return plant;
}

}  // namespace cellcal::daemon
