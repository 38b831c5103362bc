#include "calib/files/identity.h"

#include <chrono>
#include <cstdio>

namespace cellcal::calib {

namespace {

/// More is no name, and would fill a certificate's page.
constexpr std::size_t kLongest = 200;

void check_name(const TomlTable& table, const char* key) {
  if (table.string_or(key, "").size() > kLongest)
    table.fail(key, "must not be longer than 200 bytes");
}

bool is_day(const std::string& text) {
  if (text.find_first_not_of("0123456789-") != std::string::npos) return false;
  int year = 0;
  unsigned month = 0, day = 0;
  char more = 0;
  constexpr std::size_t kLength = 10;  // YYYY-MM-DD
  if (text.size() != kLength ||
      std::sscanf(text.c_str(), "%4d-%2u-%2u%c", &year, &month, &day, &more) != 3)
    return false;
  return std::chrono::year_month_day(std::chrono::year(year), std::chrono::month(month),
                                     std::chrono::day(day))
      .ok();
}

}  // namespace

void check_identity(const TomlTable& document) {
  const TomlTable identity = document.table_or_empty("identity");
  for (const char* key :
       {"site", "operator", "robot_serial", "controller_serial", "sensor", "sensor_serial"})
    check_name(identity, key);
  identity.refuse_unknown();
}

void check_certificate(const TomlTable& artefact) {
  check_name(artefact, "certificate");
  if (!artefact.has("certificate_date")) return;
  if (!is_day(artefact.string("certificate_date")))
    artefact.fail("certificate_date", "must be a day as \"2026-04-01\"");
}

void check_artefact(const TomlTable& target) {
  check_name(target, "serial");
  check_certificate(target);
}

}  // namespace cellcal::calib
