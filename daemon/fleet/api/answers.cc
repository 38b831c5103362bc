#include "daemon/fleet/api/answers.h"

#include <charconv>
#include <nlohmann/json.hpp>

#include "daemon/plant/messages/base64.h"

namespace cellcal::daemon::fleet {

namespace {

using nlohmann::json;
using plant::CellName;

Response no_such(const std::string& what) { return error(404, "no such " + what); }

std::vector<std::string> parts_of(const std::string& path) {
  std::vector<std::string> parts;
  std::size_t from = 1;
  while (from <= path.size()) {
    const std::size_t end = std::min(path.find('/', from), path.size());
    parts.push_back(path.substr(from, end - from));
    from = end + 1;
  }
  return parts;
}

/// "KR%205" of a query.
std::string decoded(const std::string& text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned byte = 0;
    const char* at = text.data() + i + 1;
    const bool escaped = text[i] == '%' && i + 2 < text.size() &&
                         std::from_chars(at, at + 2, byte, 16).ptr == at + 2;
    plain += escaped ? static_cast<char>(byte) : text[i] == '+' ? ' ' : text[i];
    if (escaped) i += 2;
  }
  return plain;
}

std::int64_t session_of(const std::string& text) {
  std::int64_t session = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), session);
  if (code != std::errc() || end != text.data() + text.size() || session < 0)
    throw BadRequest("\"" + text + "\" is no session's number");
  return session;
}

Response document(const std::optional<StoredFile>& file) {
  if (!file) return no_such("document");
  Response response;
  response.body = file->bytes;
  response.headers.emplace_back("X-Content-SHA256", file->sha256);
  return response;
}

Response files(const std::vector<StoredFile>& all) {
  if (all.empty()) return no_such("certificate");
  json list = json::array();
  for (const StoredFile& file : all)
    list.push_back(
        {{"name", file.name}, {"sha256", file.sha256}, {"base64", plant::to_base64(file.bytes)}});
  return {200, "application/json", json{{"files", list}}.dump()};
}

/// v1/fleet/cells/PLANT/CELL/WHAT/JOURNAL/SESSION
Response of_cell(const std::vector<std::string>& parts, Reading& reading) {
  const CellName name{parts[3], parts[4]};
  if (!plant::is_name(name.plant) || !plant::is_name(name.cell)) return no_such("cell");
  if (parts.size() == 5) {
    const std::optional<std::string> cell = reading.cell(name);
    return cell ? Response{200, "application/json", *cell} : no_such("cell");
  }
  if (parts.size() != 8 || !plant::is_name(parts[6])) return no_such("page");
  const std::int64_t session = session_of(parts[7]);
  if (parts[5] == "calibrations") return document(reading.calibration(name, parts[6], session));
  if (parts[5] == "checks") return document(reading.check(name, parts[6], session));
  if (parts[5] == "certificates") return files(reading.certificate(name, parts[6], session));
  return no_such("page");
}

std::string asked(const Request& request, const char* key) {
  const auto found = request.query.find(key);
  const std::string value = found == request.query.end() ? "" : decoded(found->second);
  // PostgreSQL's text has neither.
  const bool sound = !value.empty() && value.size() <= 200 &&
                     value.find('\0') == std::string::npos &&
                     json(value).dump(-1, ' ', false, json::error_handler_t::ignore) ==
                         json(value).dump(-1, ' ', false, json::error_handler_t::replace);
  if (!sound) throw BadRequest(std::string(key) + " is missing, or no text: ?robot=MODEL&joint=A3");
  return value;
}

Response found(const Request& request, Reading& reading, const Counters& counters) {
  if (request.method != "GET") return error(405, "only GET");
  if (request.path == "/metrics")
    return {200, "text/plain; version=0.0.4", fleet_metrics(reading, counters)};
  if (request.path == "/v1/fleet/cells") return {200, "application/json", reading.cells()};
  if (request.path == "/v1/fleet/overdue") return {200, "application/json", reading.overdue()};
  if (request.path == "/v1/fleet/compare")
    return {200, "application/json",
            reading.compare(asked(request, "robot"), asked(request, "joint"))};
  const std::vector<std::string> parts = parts_of(request.path);
  if (parts.size() >= 5 && parts[0] == "v1" && parts[1] == "fleet" && parts[2] == "cells")
    return of_cell(parts, reading);
  return no_such("page");
}

}  // namespace

Response answer(const Request& request, Reading& reading, const Counters& counters) {
  try {
    return found(request, reading, counters);
  } catch (const BadRequest& bad) {
    return error(400, bad.what());
  } catch (const StoreAway& away) {
    return busy(std::string("the database is away: ") + away.what());
  }
}

}  // namespace cellcal::daemon::fleet
