#include "daemon/config/config_values.h"

#include <arpa/inet.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <utility>
#include <vector>

#include "calib/files/text.h"
#include "calib/model/enum_table.h"
#include "daemon/files/atomic_file.h"
#include "drivers/error.h"
#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::daemon {

namespace {

using calib::TomlTable;

/// 224.0.0.0 and above: multicast, reserved, broadcast.
bool is_of_one(in_addr address) {
  constexpr std::uint32_t kFirstGroup = 0xE0000000u;
  return ntohl(address.s_addr) < kFirstGroup;
}

const char* meant(Addresses whose) {
  using enum Addresses;
  static constexpr EnumNames<Addresses> kTable{
      {{kOwn,
        "one of this computer's addresses ('ip -4 address' lists them), or \"0.0.0.0\" for "
        "all of them"},
       {kThisComputers,
        "this computer's address in the controller's RSI subnet ('ip -4 address' lists them)"},
       {kControllers, "the controller's address in its KLI network"}}};
  return kTable[whose];
}

}  // namespace

std::string in_quotes(const std::string& text) { return "\"" + calib::shown(text) + "\""; }

bool is_visible_ascii(const std::string& text) {
  return std::ranges::all_of(text, [](char c) { return '!' <= c && c <= '~'; });
}

bool has_letters_digits_and(std::string_view others, const std::string& text) {
  return std::ranges::all_of(text, [&](char c) {
    return ('a' <= c && c <= 'z') || ('A' <= c && c <= 'Z') || ('0' <= c && c <= '9') ||
           others.find(c) != std::string_view::npos;
  });
}

std::optional<std::uint16_t> port_of(const std::string& text) {
  std::uint16_t port = 0;
  const char* const end = text.data() + text.size();
  const auto [at, code] = std::from_chars(text.data(), end, port);
  return code == std::errc() && at == end && port > 0 ? std::optional(port) : std::nullopt;
}

int integer_or(const TomlTable& table, const char* key, int usual, int low, int high) {
  return static_cast<int>(table.integer_or(key, usual, low, high));
}

void refuse_without(const TomlTable& table, const std::string& needed,
                    std::initializer_list<const char*> keys) {
  for (const char* key : keys)
    if (table.has(key)) table.fail(key, "has no effect without " + needed);
}

std::string read_name(const TomlTable& table, const char* key, const std::string& usual,
                      Emptiness empty) {
  std::string name = table.string_or(key, usual);
  if (drivers::is_tag(name) || (empty == Emptiness::kMeansNone && name.empty())) return name;
  table.fail(key, in_quotes(name) + " is not a name: allowed are 1 to " +
                      std::to_string(drivers::kLongestTag) +
                      " letters, digits, '_', '-', '.', a letter first. Write it as in the "
                      "controller's ethernet XML");
}

std::string read_address(const TomlTable& table, const char* key, const std::string& usual,
                         Addresses whose) {
  std::string text = table.string_or(key, usual);
  in_addr address{};
  const bool is_one = ::inet_pton(AF_INET, text.c_str(), &address) == 1 && is_of_one(address);
  const bool all = address.s_addr == INADDR_ANY;
  if (is_one && (!all || whose == Addresses::kOwn)) return text;
  table.fail(key, in_quotes(text) + " is not a usable IPv4 address (example: 10.0.0.5): write " +
                      meant(whose));
}

void refuse_secret_of_all(const std::filesystem::path& file) {
  using std::filesystem::perms;
  std::error_code none;
  const perms mode = std::filesystem::status(file, none).permissions();
  if (file.empty() || none || mode == perms::unknown || (mode & perms::others_read) == perms::none)
    return;
  throw std::runtime_error(file.string() +
                           ": readable by every user of this computer. Restrict it: "
                           "chmod o= " +
                           file.string());
}

void refuse_unreadable(const std::filesystem::path& file) {
  if (file.empty() || ::access(file.c_str(), R_OK) == 0) return;
  throw std::runtime_error(file.string() + ": " + std::strerror(errno) +
                           ". Give a file that the service's user may read (chgrp cellcal, "
                           "chmod 640)");
}

std::filesystem::path read_path(const TomlTable& table, const char* key) {
  const std::string text = table.string(key);
  if (printable(text) != text) table.fail(key, "must not contain control characters");
  std::filesystem::path path = text;
  if (!path.is_absolute()) {
    table.fail(key, in_quotes(text) + " must be an absolute path (beginning with \"/\")");
  }
  return path.lexically_normal();
}

void read_pair(const TomlTable& table, const char* first_key, std::filesystem::path& first,
               const char* second_key, std::filesystem::path& second) {
  const bool given = table.has(first_key);
  if (given != table.has(second_key))
    table.fail(
        given ? first_key : second_key,
        std::string("needs ") + (given ? second_key : first_key) + " as well: give both or none");
  if (!given) return;
  first = read_path(table, first_key);
  second = read_path(table, second_key);
}

void refuse_equal_tags(const TomlTable& rsi, const drivers::RsiConfig& config) {
  const std::vector<std::pair<const char*, const std::string*>> tags{
      {"axis_tag", &config.axis_tag},
      {"external_axis_tag", &config.external_axis_tag},
      {"cart_tag", &config.space.tag},
      {"stop_tag", &config.stop_tag}};
  for (std::size_t i = 0; i < tags.size(); ++i) {
    const auto& [key, tag] = tags[i];
    for (const char* reserved : {"Sen", "IPOC"}) {
      if (drivers::wire::same_name(*tag, reserved))
        rsi.fail(key,
                 in_quotes(*tag) + " is already an element of every telegram: choose another name");
    }
    for (std::size_t j = 0; j < i; ++j) {
      // Corrections are either of axes or in space: the tag of the other kind is not sent.
      const bool together = config.space.on || std::string(key) != "cart_tag";
      if (drivers::wire::same_name(*tag, *tags[j].second) && !tag->empty() && together) {
        rsi.fail(key, in_quotes(*tag) + " is " + tags[j].first +
                          ", too: give each element of a telegram its own name, as in the "
                          "controller's ethernet XML");
      }
    }
  }
}

void refuse_unusable_by_session(const TomlTable& document, const DaemonConfig& config) {
  // An arbitrary six-axis arm: values from the robot file are checked with the cell.
  constexpr std::size_t kAxes = 6;
  const drivers::AxisLimit any{-1.0, 1.0, config.motion.speed_fraction,
                               config.motion.acceleration_rad_s2, config.motion.jerk_rad_s3};
  const char* part = "rsi";
  try {
    drivers::RsiConfig rsi = config.rsi;
    rsi.limits.assign(kAxes, any);
    rsi.correction_limit_deg.assign(kAxes, config.rsi.correction_limit_deg.at(0));
    rsi.space.on = false;  // requires the arm's geometry
    rsi.validate();
    part = "eki";
    drivers::EkiConfig eki = config.eki;
    eki.limits.assign(kAxes, any);
    eki.full_speed_rad_s.assign(kAxes, 1.0);
    eki.validate();
    part = "controller";
    config.controller.validate();
  } catch (const drivers::ConfigError& error) {
    document.fail(part, error.what());
  }
}

}  // namespace cellcal::daemon
