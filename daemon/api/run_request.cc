#include "daemon/api/run_request.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

/// Moves a key out of the object; keys that remain at the end are unknown.
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

namespace {

constexpr std::size_t kLongestName = 100;

}  // namespace

std::string line_in(const nlohmann::json& body, const char* key, std::size_t longest) {
  const std::string text =
      body.contains(key) && body[key].is_string() ? body[key].get<std::string>() : "";
  if (text.find_first_not_of(' ') == std::string::npos || text.size() > longest ||
      printable(text) != text)
    throw BadRequest(fmt::format(
        "\"{}\" must be a text of 1 to {} bytes without control characters", key, longest));
  return text;
}

std::string author_of(const Request& request, const nlohmann::json& body) {
  if (!body.contains("by")) return request.caller.name;
  return fmt::format("{} ({})", line_in(body, "by", kLongestName), request.caller.name);
}

namespace {

namespace fs = std::filesystem;

bool is_link(const fs::path& path) {
  std::error_code none;
  return fs::is_symlink(path, none);
}

}  // namespace

void keep_within(const Request& request, const fs::path& file, const NetworkFiles& allowed) {
  if (!request.is_from_network()) return;
  std::string places;
  for (const fs::path& one : allowed.folders) {
    const fs::path folder = fs::absolute(one / "").lexically_normal().parent_path();
    const bool directly =
        file.has_filename() && file.parent_path() == folder && file.lexically_normal() == file;
    if (directly && !is_link(folder) && !is_link(file)) return;
    places += (places.empty() ? "" : " or ") + folder.string();
  }
  throw RequestError(
      fmt::format("over the network {} must lie directly in {} and must not be a link. {}",
                  allowed.what, places, allowed.instead));
}

}  // namespace cellcal::daemon
