#include "daemon/api/run_request.h"

#include <limits>
#include <nlohmann/json.hpp>

#include "daemon/files/printable.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

/// Takes a key out of the object; what remains at the end is unknown.
template <typename T>
void take(json& object, const char* key, T& value) {
  const auto found = object.find(key);
  if (found == object.end()) return;
  const bool fits = std::is_same_v<T, bool>          ? found->is_boolean()
                    : std::is_same_v<T, std::string> ? found->is_string()
                    : std::is_same_v<T, double>
                        ? found->is_number()
                        : found->is_number_unsigned() && found->template get<std::uint64_t>() <=
                                                             std::numeric_limits<int>::max();
  if (!fits) throw BadRequest(std::string("\"") + key + "\" has the wrong type or range");
  value = found->template get<T>();
  object.erase(found);
}

}  // namespace

RunRequest run_request(const std::string& body) {
  json object = json::parse(body, nullptr, false);
  if (!object.is_object()) throw BadRequest("the body must be a JSON object");
  RunRequest request;
  std::string cell, kind = to_string(request.kind);
  take(object, "cell", cell);
  take(object, "kind", kind);
  const auto known = session_kind(kind);
  if (!known)
    throw BadRequest(
        "\"kind\" must be \"calibrate\", \"qualify\", \"find\", \"dry-run\" or \"check\"");
  request.kind = *known;
  take(object, "target", request.target);
  if (object.contains("calibration")) {
    int session = 0;
    take(object, "calibration", session);
    request.calibration = session;
  }
  if (object.contains("temperature_c"))
    take(object, "temperature_c", request.temperature_c.emplace());
  if (object.contains("touches")) take(object, "touches", request.fit_touches.emplace());
  if (object.contains("goal_mm")) take(object, "goal_mm", request.goal_mm.emplace());
  take(object, "region", request.region);
  take(object, "find", request.find);
  take(object, "update", request.update);
  take(object, "accept_change", request.accept_change);
  take(object, "check", request.check_touches);
  take(object, "seed", request.seed);
  take(object, "resume", request.resume);
  if (!object.empty()) throw BadRequest("unknown key \"" + object.begin().key() + "\"");
  if (cell.empty() && !request.resume && request.kind != SessionKind::kCheck)
    throw BadRequest("\"cell\" is missing");
  if (printable(cell) != cell || printable(request.region) != request.region ||
      printable(request.target) != request.target)
    throw BadRequest("\"cell\", \"target\" and \"region\" must not contain control characters");
  request.cell = cell;
  return request;
}

}  // namespace cellcal::daemon
