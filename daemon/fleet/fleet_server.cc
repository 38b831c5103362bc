#include "daemon/fleet/fleet_server.h"

#include <algorithm>
#include <charconv>
#include <mutex>
#include <nlohmann/json.hpp>

#include "daemon/api/http/server.h"
#include "daemon/plant/messages/text_fields.h"

namespace cellcal::daemon::fleet {

struct FleetServer::Impl {
  Impl(const Listen& listen, std::string database, const Counters& given)
      : reading(std::move(database)), counters(given), local(listen.socket, parts()) {
    if (!listen.address.empty())
      network.emplace(NetworkAddress{listen.address, listen.port}, parts(listen.host_names));
  }

  /// `names`: host names of this computer in addition to its addresses.
  ServerParts parts(std::vector<std::string> names = {}) {
    ServerParts made;
    made.admit = [names = std::move(names)](Request& request) -> std::optional<Response> {
      if (!request.is_from_network() || host_is_ours(request, names)) return std::nullopt;
      return error(
          403,
          "this Host is not known as this computer's. Ask by its address, or add the name to "
          "host_names of [http]");
    };
    made.handler = [this](const Request& request, bool) -> std::optional<Response> {
      if (std::optional<Response> page = page_answer_at(request, kFleetPage)) return page;
      const std::lock_guard lock(mutex);  // each server has a thread for slow requests
      return answer(request, reading, counters);
    };
    made.slow = [](const Request&) { return true; };  // database queries may be slow
    return made;
  }

  std::mutex mutex;
  Reading reading;
  const Counters& counters;
  ServerThread local;
  std::optional<ServerThread> network;
};

FleetServer::FleetServer(const Listen& listen, std::string database, const Counters& counters)
    : impl_(std::make_unique<Impl>(listen, std::move(database), counters)) {}

FleetServer::~FleetServer() = default;

std::uint16_t FleetServer::port() const { return impl_->network ? impl_->network->port() : 0; }

namespace {

void add_collector(Exposition& out, const Counters& counters) {
  out.counter("cellcal_fleet_messages_total", "Messages stored or refused.", counters.messages);
  out.counter("cellcal_fleet_facts_total", "Facts stored.", counters.facts);
  out.counter("cellcal_fleet_twice_total", "Facts that were there already.", counters.twice);
  out.counter("cellcal_fleet_refused_total",
              "Messages refused: quarantined, or above a cell's rate and only counted.",
              counters.refused);
  out.counter("cellcal_fleet_batches_total", "Transactions.", counters.batches);
  out.gauge("cellcal_fleet_broker_up", "1: connected to the broker.",
            counters.broker_up ? 1.0 : 0.0);
  out.gauge("cellcal_fleet_database_up", "1: connected to the database.",
            counters.store_up ? 1.0 : 0.0);
  out.counter("cellcal_fleet_broker_lost_total", "Connections to the broker that broke.",
              counters.broker_lost);
  out.counter("cellcal_fleet_database_lost_total", "Connections to the database that broke.",
              counters.store_lost);
}

void add_plant(Exposition& out, const Totals& totals) {
  const auto count = [](std::int64_t value) { return static_cast<double>(value); };
  out.gauge("cellcal_fleet_cells", "Cells that are known.", count(totals.cells));
  out.gauge("cellcal_fleet_cells_online", "Cells that are online.", count(totals.online));
  out.gauge("cellcal_fleet_gaps", "Ranges of numbers that did not come.", count(totals.gaps));
  out.gauge("cellcal_fleet_quarantined", "Messages that ever were refused.", count(totals.refused));
  constexpr const char* kNeeds = "cellcal_fleet_cells_in_need";
  out.family(kNeeds, "gauge", "Cells by what they need attention for.");
  for (const auto& [what, cells] : totals.needs) out.sample(count(cells), {{"what", what}});
}

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
  std::string value = found == request.query.end() ? "" : found->second;
  std::ranges::replace(value, '+', ' ');
  // PostgreSQL's text accepts neither NUL nor invalid UTF-8.
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

std::string fleet_metrics(Reading& reading, const Counters& counters) {
  Exposition out;
  add_collector(out, counters);
  try {
    add_plant(out, reading.totals());
  } catch (const StoreUnavailable&) {
    // reported by cellcal_fleet_database_up
  }
  return std::move(out).text();
}

Response answer(const Request& request, Reading& reading, const Counters& counters) {
  try {
    return found(request, reading, counters);
  } catch (const BadRequest& bad) {
    return error(400, bad.what());
  } catch (const StoreUnavailable& away) {
    return busy(std::string("the database is away: ") + away.what());
  }
}

}  // namespace cellcal::daemon::fleet
