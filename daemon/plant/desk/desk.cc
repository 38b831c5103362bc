#include "daemon/plant/desk/desk.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "calib/files/json.h"
#include "calib/model/error.h"
#include "daemon/files/atomic_file.h"
#include "daemon/plant/line/cell_metrics.h"
#include "daemon/plant/messages/fact.h"
#include "daemon/plant/messages/text_fields.h"

namespace cellcal::daemon::plant {

namespace {

constexpr std::string_view kProposals = "/v1/proposals/";
constexpr std::size_t kMostFacts = 100;

std::size_t number_in(const Request& request, const char* key) {
  const auto given = request.query.find(key);
  if (given == request.query.end() || given->second.empty() || given->second.size() > 18 ||
      given->second.find_first_not_of("0123456789") != std::string::npos)
    throw BadRequest(std::string("\"") + key + "\" must be a whole number");
  return std::stoull(given->second);
}

std::string address_of(const PlantConfig& plant) { return plant.plant + "/" + plant.cell; }

/// Status while the process does not run.
LineStatus silent(const std::string& since) {
  return {false, LineProblem::kNotRunning,
          fmt::format("plant line: process not running since {}. Start it: sudo systemctl start "
                      "cellcal-plant; nothing is lost meanwhile",
                      since),
          since, 0};
}

/// Below the keep-alive limit of a broker, above the time to compose a large calibration on a slow computer.
constexpr std::chrono::seconds kMost{30};

/// Body of the answer. Throws SocketError.
std::string asked(const std::filesystem::path& socket, const char* method,
                  const std::string& target, const std::string& body = "") {
  Response answer = http_request(socket, method, target, body, kMost);
  if (answer.status == 200) return std::move(answer.body);
  const auto words = calib::parse_json(answer.body);
  throw OutboxError(words.is_object() && words.contains("error") && words["error"].is_string()
                        ? words["error"].get<std::string>()
                        : fmt::format("cellcald answered {}", answer.status));
}

template <class Read>
auto read_as(Read read) try {
  return read();
} catch (const SocketError& away) {
  throw OutboxError(away.what());
} catch (const calib::FileError& other) {
  throw OutboxError(std::string(other.what()) +
                    ". Check that cellcald and cellcal-plant are of the same version");
}

namespace fields = calib::fields;
using fields::field, fields::Json;
using sparkplug::DataType, sparkplug::Metric;

/// Text of a line's status.
constexpr std::size_t kLongestWords = 4096;
constexpr std::size_t kLargest = std::size_t{1} << 20;

fields::Value<std::filesystem::path> path() {
  return {[](const std::filesystem::path& one) { return one.string(); },
          [](const calib::JsonReader& reader) {
            return std::filesystem::path(line(kLongestWords).from(reader));
          }};
}

const fields::Table<PlantConfig> kPlantFields{
    field("plant", &PlantConfig::plant, name()),
    field("cell", &PlantConfig::cell, name()),
    field("host", &PlantConfig::host, line(kLongestWords)),
    field("port", &PlantConfig::port, fields::whole<std::uint16_t>()),
    field("tls", &PlantConfig::tls, fields::flag()),
    field("ca", &PlantConfig::ca, path()),
    field("certificate", &PlantConfig::certificate, path()),
    field("key", &PlantConfig::key, path()),
    field("user", &PlantConfig::user, line()),
    field("password_file", &PlantConfig::password_file, path()),
    field("sparkplug", &PlantConfig::sparkplug, fields::flag())};

/// The type selects the value; null: unknown.
fields::Value<Metric> metric() {
  return {[](const Metric& one) {
            Json json{{"name", one.name}, {"type", static_cast<std::uint32_t>(one.type)}};
            std::visit(
                [&](const auto& value) {
                  if constexpr (std::is_same_v<std::decay_t<decltype(value)>, std::monostate>)
                    json["value"] = nullptr;
                  else
                    json["value"] = value;
                },
                one.value);
            return json;
          },
          [](const calib::JsonReader& reader) {
            Metric one{line().from(reader.at("name")),
                       static_cast<DataType>(reader.at("type").whole()),
                       {}};
            const calib::JsonReader at = reader.at("value");
            const nlohmann::json& value = reader.object()["value"];
            if (value.is_null()) return one;
            switch (one.type) {
              case DataType::kInt64:
              case DataType::kDateTime:
                if (!value.is_number_integer()) at.fail("must be a whole number");
                one.value = value.get<std::int64_t>();
                return one;
              case DataType::kDouble: one.value = at.number(); return one;
              case DataType::kBoolean: one.value = at.flag(); return one;
              case DataType::kString: one.value = at.text(); return one;
            }
            reader.at("type").fail("is none");
          }};
}

const fields::Table<LineStatus> kLineFields{
    field("connected", &LineStatus::connected, fields::flag()),
    field("problem", &LineStatus::problem, fields::named<LineProblem, '-'>()),
    field("words", &LineStatus::words, bounded(kLongestWords)),
    field("since", &LineStatus::since, line()),
    field("acknowledged", &LineStatus::acknowledged, count<std::uint64_t>())};

const fields::Table<LinesStatus> kLinesFields{
    field("facts", &LinesStatus::facts, fields::object(kLineFields)),
    maybe("sparkplug", &LinesStatus::sparkplug, fields::object(kLineFields)),
    field("restarts", &LinesStatus::restarts, count<std::uint64_t>())};

const fields::Table<Orders> kOrdersFields{
    field("daemon", &Orders::daemon, line()),
    maybe("plant", &Orders::plant, fields::object(kPlantFields)),
    field("mock", &Orders::mock, fields::flag()),
    field("metrics", &Orders::metrics, fields::list(metric()))};

const fields::Table<WaitingCount> kCountFields{
    field("source", &WaitingCount::source, line()),
    field("newest", &WaitingCount::newest, count<std::int64_t>()),
    field("rows", &WaitingCount::rows, count<std::int64_t>()),
    field("elsewhere", &WaitingCount::elsewhere, count<std::int64_t>()),
    field("elsewhere_address", &WaitingCount::elsewhere_address, line())};

const fields::Table<WaitingFact> kFactFields{
    field("row", &WaitingFact::row, count<std::int64_t>()),
    field("source", &WaitingFact::source, line()),
    field("number", &WaitingFact::number, count<std::int64_t>()),
    field("session", &WaitingFact::session, count<std::int64_t>()),
    field("kind", &WaitingFact::kind, name()),
    field("worth", &WaitingFact::worth, fields::named<Worth>())};

template <class T>
T read(const fields::Table<T>& table, std::string_view json, const char* name) {
  const nlohmann::json parsed = json_of(json, kLargest, name);
  T value;
  fields::from_json(table, calib::JsonReader(parsed, name), value);
  return value;
}

/// Removes and returns the next line.
std::string_view line_of(std::string_view& left) {
  const std::size_t end = left.find('\n');
  if (end == std::string_view::npos) throw calib::FileError("facts", "a line is not whole");
  const std::string_view line = left.substr(0, end);
  left.remove_prefix(end + 1);
  return line;
}

}  // namespace

Desk::Desk(Parts parts)
    : parts_(std::move(parts)),
      born_(fmt::format("{} {}", parts_.utc(), ::getpid())),
      heard_at_(parts_.now()),
      heard_utc_(parts_.utc()) {}

void Desk::use(std::shared_ptr<Outbox> outbox, std::optional<PlantConfig> plant, bool mock) {
  const std::lock_guard lock(mutex_);
  now_ = {std::move(outbox), std::move(plant), mock};
}

Desk::Now Desk::now() const {
  const std::lock_guard lock(mutex_);
  return now_;
}

std::optional<LinesStatus> Desk::status() const {
  const std::lock_guard lock(mutex_);
  if (!now_.plant) return std::nullopt;
  if (parts_.now() - heard_at_ <= kDeskSilence)
    return heard_.value_or(LinesStatus{{false, LineProblem::kNone, {}, heard_utc_, 0}});
  LinesStatus lines{silent(heard_utc_)};
  if (now_.plant->sparkplug) lines.sparkplug = lines.facts;
  if (heard_) lines.restarts = heard_->restarts;
  return lines;
}

Response Desk::answer(const Request& request) try {
  const Now now = this->now();
  const auto is = [&](const char* method, const char* path) {
    return request.method == method && request.path == path;
  };
  if (is("POST", "/v1/line")) return hear(request, now);
  const bool proposal = request.method == "POST" && request.path.starts_with(kProposals);
  const bool outbox = is("GET", "/v1/count") || is("GET", "/v1/facts") || is("POST", "/v1/stored");
  if (!proposal && !outbox) return error(404, "no such resource: " + request.path);
  const auto as = request.query.find("as");
  if (!now.outbox || !now.plant || as == request.query.end() ||
      as->second != address_of(*now.plant))
    return error(409, "[plant] has changed");
  if (proposal) return take(request, now);
  if (is("GET", "/v1/count")) return {.body = to_json(now.outbox->count())};
  if (is("GET", "/v1/facts")) {
    Response facts{
        200, "application/x-ndjson",
        to_lines(now.outbox->facts(static_cast<std::int64_t>(number_in(request, "after")),
                                   std::min(number_in(request, "most"), kMostFacts)))};
    sign_of_life();  // composing took time in which no report was received
    return facts;
  }
  now.outbox->acknowledge(rows_from_json(request.body));
  return {.body = "{}"};
} catch (const BadRequest& bad) {
  return error(400, bad.what());
} catch (const calib::FileError& wrong) {
  return error(422, wrong.what());
} catch (const OutboxError& away) {
  return error(503, away.what());
} catch (const std::exception& failed) {
  return error(500, failed.what());
}

void Desk::sign_of_life() {
  const std::lock_guard lock(mutex_);
  heard_at_ = parts_.now();
  heard_utc_ = parts_.utc();
}

Response Desk::hear(const Request& request, const Now& now) {
  LinesStatus lines = lines_from_json(request.body);
  {
    const std::lock_guard lock(mutex_);
    heard_ = std::move(lines);
  }
  sign_of_life();
  Orders orders{born_, now.plant, now.mock, {}};
  if (!now.plant) return {.body = to_json(orders)};
  if (now.plant->sparkplug) {
    try {
      metrics_ = parts_.metrics();
    } catch (const std::exception& failed) {
      if (unread_.count(parts_.now()))
        spdlog::warn("[plant]: Sparkplug: {}; the last metrics are kept", printable(failed.what()));
      if (metrics_.empty()) metrics_ = sparkplug::metrics_of({});
    }
    orders.metrics = metrics_;
  }
  const auto period = std::chrono::duration<double, std::ratio<60>>(now.plant->health_minutes);
  if (health_at_ == Time{}) health_at_ = parts_.now();
  if (parts_.now() - health_at_ >= period) {
    health_at_ = parts_.now();
    try {
      parts_.publish_health();
    } catch (const std::exception& failed) {
      spdlog::warn("[plant]: health not reported: {}", printable(failed.what()));
    }
  }
  return {.body = to_json(orders)};
}

Response Desk::take(const Request& request, const Now& now) {
  const Time time = parts_.now();
  if (time - proposals_since_ >= std::chrono::minutes(1)) {
    proposals_since_ = time;
    proposals_ = 0;
  }
  if (++proposals_ > kMostProposals) {
    if (const auto more = refused_.count(time))
      spdlog::warn("[plant]: {} proposals beyond {} a minute, left at the broker", *more,
                   kMostProposals);
    return error(429, fmt::format("{} proposals a minute are taken", kMostProposals));
  }
  const Topic topic{{now.plant->plant, now.plant->cell},
                    Subject::kProposal,
                    request.path.substr(kProposals.size())};
  const bool answered = parts_.proposal(proposal_from_json(request.body, topic));
  return {.body = answered ? "{\"answered\": true}" : "{\"answered\": false}"};
}

Orders report_to_desk(const std::filesystem::path& socket, const LinesStatus& lines) {
  const std::string answer = asked(socket, "POST", "/v1/line", to_json(lines));
  return read_as([&] { return orders_from_json(answer); });
}

DeskClient::DeskClient(std::filesystem::path socket, const PlantConfig& as)
    : socket_(std::move(socket)), as_("?as=" + as.plant + "/" + as.cell) {}

WaitingCount DeskClient::count() {
  return read_as([&] { return count_from_json(asked(socket_, "GET", "/v1/count" + as_)); });
}

std::vector<WaitingFact> DeskClient::facts(std::int64_t after, std::size_t most) {
  return read_as([&] {
    return facts_from_lines(
        asked(socket_, "GET", fmt::format("/v1/facts{}&after={}&most={}", as_, after, most)));
  });
}

void DeskClient::acknowledge(const std::vector<std::int64_t>& rows) {
  for (std::size_t from = 0; from < rows.size(); from += kMostDeskRows) {
    const std::vector<std::int64_t> some(
        rows.begin() + static_cast<std::ptrdiff_t>(from),
        rows.begin() + static_cast<std::ptrdiff_t>(std::min(rows.size(), from + kMostDeskRows)));
    read_as([&] { return asked(socket_, "POST", "/v1/stored" + as_, rows_to_json(some)); });
  }
}

bool DeskClient::propose(const Proposal& proposal) {
  return read_as([&] {
    const std::string answer =
        asked(socket_, "POST", "/v1/proposals/" + proposal.id + as_, to_json(proposal));
    const auto json = calib::parse_json(answer);
    return json.is_object() && json.value("answered", nlohmann::json(false)) == true;
  });
}

std::string to_json(const Orders& orders) {
  return text_of(fields::to_json(kOrdersFields, orders));
}

Orders orders_from_json(std::string_view json) { return read(kOrdersFields, json, "orders"); }

std::string to_json(const LinesStatus& lines) {
  LinesStatus cut = lines;
  const auto shorten = [](LineStatus& line) {
    constexpr std::size_t kReadable =
        kLongestWords / 4;  // truncation within a character enlarges the text
    line.words = printable(line.words).substr(0, kReadable);
  };
  shorten(cut.facts);
  if (cut.sparkplug) shorten(*cut.sparkplug);
  return text_of(fields::to_json(kLinesFields, cut));
}

LinesStatus lines_from_json(std::string_view json) { return read(kLinesFields, json, "line"); }

std::string to_json(const WaitingCount& count) {
  return text_of(fields::to_json(kCountFields, count));
}

WaitingCount count_from_json(std::string_view json) { return read(kCountFields, json, "count"); }

std::string to_lines(const std::vector<WaitingFact>& facts) {
  std::string lines;
  for (const WaitingFact& fact : facts)
    lines += text_of(fields::to_json(kFactFields, fact)) + '\n' + fact.text + '\n';
  return lines;
}

std::vector<WaitingFact> facts_from_lines(std::string_view lines) {
  std::vector<WaitingFact> facts;
  while (!lines.empty()) {
    WaitingFact fact = read(kFactFields, line_of(lines), "fact");
    const std::string_view text = line_of(lines);
    if (text.size() > kLargestMessage) throw calib::FileError("facts", "one is too large");
    fact.text = text;
    facts.push_back(std::move(fact));
  }
  return facts;
}

std::string rows_to_json(const std::vector<std::int64_t>& rows) {
  return text_of(Json{{"rows", rows}});
}

std::vector<std::int64_t> rows_from_json(std::string_view json) {
  const nlohmann::json parsed = json_of(json, kLargest, "rows");
  const calib::JsonReader rows(parsed, "rows");
  const auto all = fields::list(count<std::int64_t>()).from(rows.at("rows"));
  if (all.size() > kMostDeskRows) rows.at("rows").fail("are too many");
  return all;
}

}  // namespace cellcal::daemon::plant
