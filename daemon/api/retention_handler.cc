// Raw rows of old sessions, dropped on request.

#include <spdlog/spdlog.h>

#include <chrono>
#include <nlohmann/json.hpp>

#include "daemon/api/handlers.h"
#include "daemon/api/http/json_text.h"
#include "daemon/archive/retention.h"
#include "daemon/runner/backend.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

constexpr int kMostDays = 36500;
constexpr double kMostMegabytes = 1e9;

struct Wanted {
  RetentionRule rule;
  bool dry_run = false;
};

/// {"dry_run": true, "days": 90, "megabytes": 500}, each or none.
Wanted wanted_in(const std::string& body) {
  const json object = json::parse(body, nullptr, false);
  if (!object.is_object()) throw BadRequest("the body must be a JSON object");
  Wanted wanted;
  for (const auto& [key, value] : object.items()) {
    if (key == "dry_run" && value.is_boolean()) {
      wanted.dry_run = value;
    } else if (key == "days" && value.is_number_integer() && value >= 1 && value <= kMostDays) {
      wanted.rule.days = value.get<int>();
    } else if (key == "megabytes" && value.is_number() && value >= 1.0 && value <= kMostMegabytes) {
      wanted.rule.megabytes = value.get<double>();
    } else {
      throw BadRequest(
          "\"dry_run\" (true or false), \"days\" (1 to 36500) and \"megabytes\" (from 1 on) are known here, not "
          "this: " +
          dump(json{{key, value}}));
    }
  }
  return wanted;
}

}  // namespace

std::optional<Response> Api::retain(const Call& call) {
  Wanted wanted = wanted_in(call.request.body);
  if (!wanted.rule.any() && retention_) wanted.rule = retention_();
  if (!wanted.rule.any())
    throw RequestError("no limit given: give days or megabytes, or set them under [retention]");
  const auto idle = [this] { return !kActivePhases.has(service_.status().phase); };
  if (!idle()) throw BusyError("a session is running. Drop old rows when it has ended");
  const auto now = std::chrono::duration_cast<std::chrono::seconds>(
      std::chrono::system_clock::now().time_since_epoch());
  const auto gone =
      journal_.retain(limits_of(wanted.rule, now.count()), wall_clock_utc(), wanted.dry_run, idle);
  json sessions = json::array();
  for (const DroppedRows& one : gone)
    sessions.push_back({{"session", one.session}, {"rows", one.rows}, {"bytes", one.bytes}});
  if (!wanted.dry_run && !gone.empty())
    spdlog::info("raw events and readings of {} sessions dropped", gone.size());
  return Response{.body = dump({{"dry_run", wanted.dry_run},
                                {"sessions", std::move(sessions)},
                                {"bytes_in_use", journal_.bytes_in_use()}})};
}

}  // namespace cellcal::daemon
