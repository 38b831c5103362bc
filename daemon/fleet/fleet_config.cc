#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>

#include "calib/files/text.h"
#include "calib/files/toml.h"
#include "daemon/config/config_values.h"
#include "daemon/config/network_config.h"
#include "daemon/fleet/fleet_server.h"
#include "daemon/plant/messages/text_fields.h"

namespace cellcal::daemon::fleet {

namespace {

using calib::TomlTable;

constexpr const char* kFormat = "cellcal.fleet/1";
constexpr const char* kDefaultSocket = "/run/cellcal-fleet/fleet.sock";
constexpr const char* kDefaultDatabase = "dbname=cellcal";
constexpr double kMb = 1e6;

/// "cellcal-fleet-plant7": this computer's name, with '-' for characters that names do not allow.
std::string usual_client() {
  std::array<char, 256> host{};
  if (::gethostname(host.data(), host.size() - 1) != 0) return "cellcal-fleet";
  std::string name = "cellcal-fleet-" + std::string(host.data());
  std::replace_if(
      name.begin(), name.end(), [](char c) { return !plant::is_name(std::string_view(&c, 1)); },
      '-');
  return name.substr(0, plant::kLongestName);
}

std::string read_client_name(const TomlTable& table, const char* key, const std::string& usual) {
  std::string name = table.string_or(key, usual);
  if (!plant::is_name(name))
    table.fail(key, "\"" + calib::shown(name) + "\" must be 1 to 64 of A-Z a-z 0-9 _ -");
  return name;
}

void read_tls(const TomlTable& table, BrokerConfig& broker) {
  broker.tls = table.boolean_or("tls", false);
  for (const auto& [key, path] :
       {std::pair{"ca", &broker.ca}, {"certificate", &broker.certificate}, {"key", &broker.key}}) {
    if (!table.has(key)) continue;
    if (!broker.tls) table.fail(key, "means nothing without tls = true");
    *path = read_path(table, key);
  }
  if (broker.certificate.empty() != broker.key.empty())
    table.fail(broker.key.empty() ? "certificate" : "key",
               "give certificate and key, both or none");
}

void read_login(const TomlTable& table, BrokerConfig& broker) {
  broker.user = table.string_or("user", "");
  if (table.has("password_file")) broker.password_file = read_path(table, "password_file");
  if (broker.user.empty() != broker.password_file.empty())
    table.fail(broker.user.empty() ? "password_file" : "user",
               "give user and password_file, both or none");
  if (broker.password_file.empty()) return;
  std::string line;
  if (std::ifstream in(broker.password_file); !std::getline(in, line))
    table.fail("password_file", "no line can be read from it");
}

void read_broker(const TomlTable& table, BrokerConfig& broker) {
  broker.host = table.string_or("host", broker.host);
  if (broker.host.empty()) table.fail("host", "must be a computer's name or address");
  read_tls(table, broker);
  constexpr long kPlain = 1883, kTls = 8883, kLast = 65535;
  broker.port =
      static_cast<std::uint16_t>(table.integer_or("port", broker.tls ? kTls : kPlain, 1, kLast));
  read_login(table, broker);
  if (!table.string_or("group", "").empty()) broker.group = read_client_name(table, "group", "");
  broker.client = read_client_name(table, "client", usual_client());
  table.refuse_unknown();
}

void read_limits(const TomlTable& table, Allowance& allowance) {
  allowance.messages_per_s =
      table.number_or("messages_per_s", allowance.messages_per_s, {0.01, 1e6});
  allowance.burst = table.number_or("burst", allowance.burst, {1.0, 1e9});
  allowance.bytes_per_day =
      kMb * table.number_or("mb_per_day", allowance.bytes_per_day / kMb, {1.0, 1e9});
  table.refuse_unknown();
}

void read_listen(const TomlTable& table, Listen& listen) {
  listen.socket =
      table.has("socket") ? read_path(table, "socket") : std::filesystem::path(kDefaultSocket);
  if (!table.has("listen")) return table.refuse_unknown();
  const std::string text = table.string("listen");
  const std::size_t colon = std::min(text.rfind(':'), text.size());
  const auto port = colon < text.size() ? port_of(text.substr(colon + 1)) : std::nullopt;
  std::string host = text.substr(0, colon);
  if (host == "[::1]") host = "::1";
  if ((host != "127.0.0.1" && host != "::1") || !port)
    table.fail(
        "listen",
        "must be \"127.0.0.1:PORT\" or \"[::1]:PORT\". For others a proxy with TLS and a login "
        "belongs in front");
  listen.host_names = read_host_names(table);
  listen.address = host;
  listen.port = *port;
  table.refuse_unknown();
}

FleetConfig read(const TomlTable& document) {
  FleetConfig config;
  document.word("format", {kFormat});
  read_broker(document.table_or_empty("broker"), config.collector.broker);
  StoreConfig& store = config.collector.store;
  const TomlTable database = document.table_or_empty("database");
  store.connection = database.string_or("connection", kDefaultDatabase);
  database.refuse_unknown();
  read_limits(document.table_or_empty("limits"), config.collector.allowance);
  const TomlTable retention = document.table_or_empty("retention");
  store.telemetry_months =
      static_cast<int>(retention.integer_or("telemetry_months", store.telemetry_months, 1, 1200));
  retention.refuse_unknown();
  const TomlTable due = document.table_or_empty("due");
  store.calibration_days =
      static_cast<int>(due.integer_or("calibration_days", store.calibration_days, 1, 36500));
  store.check_days = static_cast<int>(due.integer_or("check_days", store.check_days, 0, 36500));
  due.refuse_unknown();
  read_listen(document.table_or_empty("http"), config.listen);
  document.refuse_unknown();
  return config;
}

}  // namespace

FleetConfig parse_fleet_config(std::string_view text, const std::string& name) {
  return read(TomlTable::parse(text, name));
}

FleetConfig load_fleet_config(const std::filesystem::path& path) {
  return read(TomlTable::load(path));
}

}  // namespace cellcal::daemon::fleet
