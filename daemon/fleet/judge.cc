#include "daemon/fleet/judge.h"

#include <algorithm>
#include <regex>

#include "calib/model/error.h"
#include "calib/model/iso_time.h"
#include "daemon/files/atomic_file.h"
#include "daemon/fleet/connection.h"
#include "daemon/plant/messages/fact.h"
#include "daemon/plant/messages/presence.h"

namespace cellcal::daemon::fleet {

namespace {

constexpr double kDay_s = 86'400.0;
/// Names beyond that share one meter, so that invented names use no memory.
constexpr std::size_t kMostCells = 20'000;

using plant::Subject;
using plant::Topic;

void require_time(const std::string& time) {
  if (!is_time(time))
    throw calib::FileError("time: \"" + printable(time) +
                           "\" must be like 2026-11-22T20:51:17.123Z");
}

void read(const Message& message, const Topic& topic, Batch& batch) {
  if (topic.subject == Subject::kPresence) {
    plant::Presence presence = plant::presence_from_json(message.payload, topic);
    require_time(presence.time);
    batch.presences.push_back(std::move(presence));
    return;
  }
  plant::Fact fact = plant::fact_from_json(message.payload, topic);
  require_time(fact.time);
  batch.facts.push_back(std::move(fact));
}

void refuse(Message message, const plant::CellName& of, Refusal why, const std::string& words,
            Batch& batch) {
  batch.refused.push_back(
      {of, printable(message.topic), std::move(message.payload), why, printable(words)});
}

// Times as ISO 8601 UTC, as everywhere else; PostgreSQL's own JSON has "+00:00" and is left as it is.
constexpr const char* kCells =
    "SELECT json_build_object('cells', coalesce(json_agg(row_to_json(s) ORDER BY worst NULLS LAST, plant, cell), "
    "'[]')) FROM (SELECT s.*, n.worst, coalesce(n.needs, '[]') AS needs FROM cell_states s LEFT JOIN "
    "(SELECT plant, cell, min(what) AS worst, json_agg(json_build_object('what', what, 'since', since, "
    "'detail', detail) ORDER BY what) AS needs FROM attention GROUP BY plant, cell) n USING (plant, cell)) s";

constexpr const char* kCell =
    "WITH j AS (SELECT j.id, j.name FROM journals j JOIN cells c ON c.id = j.cell_id "
    "WHERE c.plant = $1 AND c.cell = $2) "
    "SELECT json_build_object('state', row_to_json(s), "
    "'needs', (SELECT coalesce(json_agg(json_build_object('what', what, 'since', since, 'detail', detail) "
    "ORDER BY what), '[]') FROM attention WHERE plant = $1 AND cell = $2), "
    "'calibrations', (SELECT coalesce(json_agg(k), '[]') FROM (SELECT j.name AS journal, session, at, robot, "
    "robot_serial, published, is_update, findings, near_mm, over_mm, u95_near_mm, u95_over_mm, sha256, EXISTS (SELECT FROM "
    "certificates x WHERE x.journal_id = j.id AND x.session = c.session) AS certificate FROM calibrations c "
    "JOIN j ON j.id = c.journal_id ORDER BY j.id DESC, number DESC LIMIT 200) k), "
    "'checks', (SELECT coalesce(json_agg(k), '[]') FROM (SELECT j.name AS journal, session, at, against, held, "
    "shift_mm, u_mm, cause, temperature_c, sha256 FROM checks c JOIN j ON j.id = c.journal_id "
    "ORDER BY j.id DESC, number DESC LIMIT 200) k), "
    "'sessions', (SELECT coalesce(json_agg(k), '[]') FROM (SELECT DISTINCT ON (j.id, session) j.name AS journal, "
    "session, at, state, purpose, touches, planned, failure_kind, failure FROM session_facts f "
    "JOIN j ON j.id = f.journal_id ORDER BY j.id DESC, session DESC, number DESC LIMIT 200) k), "
    "'gaps', (SELECT coalesce(json_agg(json_build_object('journal', journal, 'first', first, 'last', last, "
    "'settled', settled)), '[]') FROM (SELECT * FROM gaps WHERE plant = $1 AND cell = $2 LIMIT 200) g), "
    "'refused', (SELECT coalesce(json_agg(json_build_object('why', why, 'count', count, 'newest', newest)), '[]') "
    "FROM refusals WHERE plant = $1 AND cell = $2)) "
    "FROM cell_states s WHERE plant = $1 AND cell = $2";

constexpr const char* kCompare =
    "SELECT json_build_object('robot', $1::text, 'joint', $2::text, 'corrections', coalesce(json_agg(row_to_json(r) "
    "ORDER BY parameter, abs(correction) DESC, plant, cell), '[]')) FROM (SELECT plant, cell, robot_serial, "
    "session, at, parameter, unit, correction, sigma, decided_by FROM joint_corrections "
    "WHERE robot = $1 AND joint = $2) r";

constexpr const char* kOverdue =
    "SELECT json_build_object('overdue', coalesce(json_agg(row_to_json(o) ORDER BY due, plant, cell), '[]')) "
    "FROM (SELECT plant, cell, \"of\", last, due FROM overdue) o";

constexpr const char* kOfSession =
    " JOIN journals j ON j.id = t.journal_id JOIN cells c ON c.id = j.cell_id WHERE c.plant = $1 AND c.cell = $2 "
    "AND j.name = $3 AND t.session = $4 ";

std::string bytes_of(const pqxx::field& field) { return pqxx::binarystring(field).str(); }

}  // namespace

Meters::Meter& Meters::meter_of(const plant::CellName& cell, Time now) {
  const auto known = meters_.find(cell);
  if (known != meters_.end()) return known->second;
  const Meter full{allowance_.burst, allowance_.bytes_per_day, now};
  return meters_.try_emplace(meters_.size() < kMostCells ? cell : plant::CellName{}, full)
      .first->second;
}

bool Meters::allows(const plant::CellName& cell, std::size_t bytes, Time now) {
  Meter& meter = meter_of(cell, now);
  const double passed_s = std::max(0.0, std::chrono::duration<double>(now - meter.at).count());
  meter.at = now;
  meter.messages =
      std::min(allowance_.burst, meter.messages + passed_s * allowance_.messages_per_s);
  meter.bytes = std::min(allowance_.bytes_per_day,
                         meter.bytes + passed_s * allowance_.bytes_per_day / kDay_s);
  const auto size = static_cast<double>(bytes);
  if (meter.messages < 1.0 || meter.bytes < size) return false;
  meter.messages -= 1.0;
  meter.bytes -= size;
  return true;
}

bool is_time(std::string_view text) {
  static const std::regex kForm(R"(\d{4}-\d\d-\d\dT([01]\d|2[0-3]):[0-5]\d:[0-5]\d(\.\d{1,9})?Z)");
  return std::regex_match(text.begin(), text.end(), kForm) &&
         calib::seconds_of(text).value_or(-1.0) >= 0.0;
}

void judge(Message message, Meters& meters, Meters::Time now, Batch& batch) {
  const std::optional<Topic> topic = plant::topic_of(message.topic);
  const plant::CellName of = topic ? topic->of : plant::CellName{};
  if (!meters.allows(of, message.payload.size(), now)) {
    ++batch.too_many[of];  // refused to limit the load
    return;
  }
  if (!topic || (topic->subject != Subject::kFact && topic->subject != Subject::kPresence))
    return refuse(std::move(message), of, Refusal::kTopic, "the topic is none of a cell's", batch);
  if (message.payload.size() > plant::kLargestMessage)
    return refuse(std::move(message), of, Refusal::kSize,
                  std::to_string(message.payload.size()) + " bytes, " +
                      std::to_string(plant::kLargestMessage) + " at most",
                  batch);
  try {
    read(message, *topic, batch);
  } catch (const std::exception& bad) {  // including unforeseen ones
    refuse(std::move(message), of, Refusal::kMessage, bad.what(), batch);
  }
}

struct Reading::Impl {
  std::string uri;
  std::unique_ptr<pqxx::connection> connection;

  template <class... Args>
  pqxx::result ask(const std::string& sql, const Args&... args) {
    // A connection lost between queries is opened again, once.
    const bool fresh = connection == nullptr;
    try {
      return ask_once(sql, args...);
    } catch (const StoreUnavailable&) {
      connection.reset();
      if (fresh) throw;
      return ask_once(sql, args...);
    }
  }

  template <class... Args>
  pqxx::result ask_once(const std::string& sql, const Args&... args) {
    if (!connection) connection = connect(uri);
    pqxx::result result;
    try {
      guarded([&] {
        pqxx::read_transaction work(*connection);
        result = work.exec_params(sql, args...);
      });
    } catch (const BadData& bad) {
      throw StoreUnavailable(bad.what());
    }
    return result;
  }

  std::optional<StoredFile> document(const std::string& table, const plant::CellName& name,
                                     const std::string& journal, std::int64_t session) {
    const pqxx::result found = ask("SELECT document, sha256 FROM " + table + " t" + kOfSession +
                                       "ORDER BY t.number DESC LIMIT 1",
                                   name.plant, name.cell, journal, session);
    if (found.empty()) return std::nullopt;
    return StoredFile{"", bytes_of(found[0][0]), found[0][1].as<std::string>()};
  }
};

Reading::Reading(std::string connection) : impl_(std::make_unique<Impl>()) {
  impl_->uri = std::move(connection);
}

Reading::~Reading() = default;

std::string Reading::cells() { return impl_->ask(kCells)[0][0].as<std::string>(); }

std::optional<std::string> Reading::cell(const plant::CellName& name) {
  const pqxx::result found = impl_->ask(kCell, name.plant, name.cell);
  if (found.empty()) return std::nullopt;
  return found[0][0].as<std::string>();
}

std::string Reading::compare(const std::string& robot, const std::string& joint) {
  return impl_->ask(kCompare, robot, joint)[0][0].as<std::string>();
}

std::string Reading::overdue() { return impl_->ask(kOverdue)[0][0].as<std::string>(); }

std::optional<StoredFile> Reading::calibration(const plant::CellName& name,
                                               const std::string& journal, std::int64_t session) {
  return impl_->document("calibrations", name, journal, session);
}

std::optional<StoredFile> Reading::check(const plant::CellName& name, const std::string& journal,
                                         std::int64_t session) {
  return impl_->document("checks", name, journal, session);
}

std::vector<StoredFile> Reading::certificate(const plant::CellName& name,
                                             const std::string& journal, std::int64_t session) {
  const pqxx::result found = impl_->ask(
      "SELECT name, bytes, sha256 FROM certificate_files WHERE (journal_id, number) = (SELECT t.journal_id, "
      "t.number FROM certificates t" +
          std::string(kOfSession) + "ORDER BY t.number DESC LIMIT 1) ORDER BY position",
      name.plant, name.cell, journal, session);
  std::vector<StoredFile> files;
  for (const auto& row : found)
    files.push_back({row[0].as<std::string>(), bytes_of(row[1]), row[2].as<std::string>()});
  return files;
}

Totals Reading::totals() {
  const pqxx::result one = impl_->ask(
      "SELECT (SELECT count(*) FROM cells), (SELECT count(*) FROM presence WHERE online), "
      "(SELECT count(*) FROM gaps WHERE settled), (SELECT coalesce(sum(count), 0) FROM quarantine_counts)");
  Totals totals{one[0][0].as<std::int64_t>(),
                one[0][1].as<std::int64_t>(),
                one[0][2].as<std::int64_t>(),
                one[0][3].as<std::int64_t>(),
                {}};
  const pqxx::result needs = impl_->ask(
      "SELECT n.what, count(DISTINCT (a.plant, a.cell)) FILTER (WHERE a.cell IS NOT NULL) "
      "FROM unnest(enum_range(NULL::need)) AS n(what) LEFT JOIN attention a USING (what) "
      "GROUP BY n.what ORDER BY n.what");
  for (const auto& row : needs)
    totals.needs.emplace_back(row[0].as<std::string>(), row[1].as<std::int64_t>());
  return totals;
}

}  // namespace cellcal::daemon::fleet
