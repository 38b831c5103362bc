#include "daemon/cli/plant/fleet_needs.h"

#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>
#include <optional>

#include "daemon/files/printable.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

enum class Need { kInterrupted, kFailed, kDrifted, kNotHeld, kOffline, kGap, kWithheld, kOverdue };

std::optional<Need> need_of(const std::string& name) {
  constexpr std::array<const char*, 8> kNames{"interrupted", "failed", "drifted",  "check-not-held",
                                              "offline",     "gap",    "withheld", "overdue"};
  for (std::size_t i = 0; i < kNames.size(); ++i)
    if (name == kNames[i]) return static_cast<Need>(i);
  return std::nullopt;
}

std::string in_words(Need need, const std::string& detail) {
  switch (need) {
    case Need::kInterrupted:
      return "session interrupted (" + detail + "). At the cell: cellcal run --resume";
    case Need::kFailed:
      return "session failed: " + detail;
    case Need::kDrifted:
      return "drift alarm: " + detail + ". Calibrate again";
    case Need::kNotHeld:
      return "check: calibration does not hold" + (detail.empty() ? "" : ", likely " + detail) +
             ". Calibrate again";
    case Need::kOffline:
      return detail == "farewell" ? "offline: shut down"
                                  : "offline: connection lost. Check network and power";
    case Need::kGap:
      return detail + " messages missing. Ask the cell's journal: cellcal history";
    case Need::kWithheld:
      return "newest calibration withheld" + (detail.empty() ? "" : ": " + detail);
    case Need::kOverdue:
      return detail + " due";
  }
  return "";
}

}  // namespace

std::string need_words(const json& need) {
  constexpr std::size_t kDay = 10;  // YYYY-MM-DD
  const std::string what = need.value("what", "");
  const json& detail = need.at("detail");
  const std::optional<Need> known = need_of(what);
  std::string words =
      known ? in_words(*known, detail.is_string() ? detail.get<std::string>() : "") : what;
  const json& since = need.at("since");
  if (since.is_string()) words += " (since " + since.get<std::string>().substr(0, kDay) + ")";
  return printable(words);
}

}  // namespace cellcal::daemon
