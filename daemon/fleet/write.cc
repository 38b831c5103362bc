#include <algorithm>
#include <array>
#include <boost/algorithm/hex.hpp>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <tuple>

#include "calib/files/calibration_json.h"
#include "calib/files/input_file.h"
#include "calib/files/text.h"
#include "daemon/fleet/connection.h"
#include "daemon/plant/messages/fact.h"
#include "daemon/plant/messages/text_fields.h"

namespace cellcal::daemon::fleet {

namespace {

using nlohmann::json;
using plant::CellName;
using plant::Fact;

/// JSON text for jsonb: bytes that are not UTF-8 are replaced.
std::string dumped(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

/// Rows of the corrections of the arm's joints, for comparison between robots. Empty for a document that this version
/// cannot read, which is stored nevertheless.
std::vector<json> corrections_of(std::string_view document) {
  std::vector<json> all;
  try {
    const calib::Calibration calibration = calib::calibration_from_json(document, "calibration");
    const calib::Cell& cell = calibration.cell;
    for (const calib::ParameterResult& one : calibration.parameters) {
      const bool of_the_arm = one.key.kind <= calib::ParameterKind::kPlay &&
                              !calib::is_by_evidence(one.key.kind) && one.key.joint >= 0;
      const double correction = one.correction * one.to_unit, sigma = one.sigma * one.to_unit;
      if (!of_the_arm || !std::isfinite(correction) || !std::isfinite(sigma)) continue;
      const std::string& joint = cell.robot.joints.at(static_cast<std::size_t>(one.key.joint)).name;
      // "A3.theta" without the joint, which has its own column.
      all.push_back({{"joint", joint},
                     {"parameter", calib::parameter_name(cell, one.key).substr(joint.size() + 1)},
                     {"unit", one.unit},
                     {"correction", correction},
                     {"sigma", sigma},
                     {"decided_by", calib::to_string(one.decided_by)}});
    }
  } catch (const std::exception&) {  // of any kind: the document is stored as received
    return {};
  }
  return all;
}

// Facts as rows of their tables: JSON records, which PostgreSQL expands (jsonb_populate_recordset).

/// Arrays of records by table.
using Rows = std::map<std::string, json>;

/// Tables of rows, parents first: those of the facts in the order of FactBody, then what their documents hold.
constexpr std::array kRowTables{"session_facts",    "calibrations", "checks",  "activations",
                                "certificates",     "alarms",       "answers", "phases",
                                "touches",          "health",       "drops",   "corrections",
                                "certificate_files"};

/// Columns that are not named as the fact's key, by words that SQL reserves or that say more in a table.
constexpr std::pair<const char*, const char*> kColumnOf[] = {{"update", "is_update"},
                                                             {"predicted_near_mm", "near_mm"},
                                                             {"predicted_over_mm", "over_mm"},
                                                             {"by", "by_whom"},
                                                             {"from", "from_phase"},
                                                             {"to", "to_phase"},
                                                             {"on", "on_event"},
                                                             {"check", "held_out"}};

/// Hex form of PostgreSQL's bytea.
std::string bytea(std::string_view bytes) {
  return "\\x" + boost::algorithm::hex_lower(std::string(bytes));
}

/// Row of the fact's own table. Keys without a column are left out by PostgreSQL.
json row_of(const plant::FactBody& body) {
  if (const auto* certificate = std::get_if<plant::CertificateFact>(&body))
    return {{"certificate", certificate->certificate}};
  json row = plant::json_of(body);
  for (const auto& [key, column] : kColumnOf)
    if (row.contains(key)) row[column] = row[key];
  if (row.contains("document")) {
    const json document = row["document"];
    row["document"] = bytea(document.at("text").get_ref<const std::string&>());
    row["sha256"] = document.at("sha256");
  }
  return row;
}

/// Adds the rows of a fact of the journal `journal_id`.
void add_rows(const Fact& fact, long journal_id, Rows& rows) {
  const json head{{"journal_id", journal_id},
                  {"number", fact.number},
                  {"session", fact.session},
                  {"at", fact.time}};
  const auto add = [&](const char* table, json row) {
    row.update(head);
    rows[table].push_back(std::move(row));
  };
  add(kRowTables.at(fact.body.index()), row_of(fact.body));
  if (const auto* calibration = std::get_if<plant::CalibrationFact>(&fact.body))
    for (const json& row : corrections_of(calibration->document)) add("corrections", row);
  if (const auto* certificate = std::get_if<plant::CertificateFact>(&fact.body))
    for (std::size_t i = 0; i < certificate->files.size(); ++i)
      add("certificate_files", {{"position", i},
                                {"name", certificate->files[i].name},
                                {"bytes", bytea(certificate->files[i].bytes)},
                                {"sha256", calib::sha256(certificate->files[i].bytes)}});
}

/// Sets `received` of the tables that have it; telemetry has no key, and therefore no conflict.
void insert(pqxx::work& work, const std::string& table, const json& records) {
  work.exec_params0(
      "INSERT INTO " + table +
          " SELECT * FROM jsonb_populate_recordset(jsonb_populate_record(NULL::" + table +
          ", jsonb_build_object('received', now())), $1) ON CONFLICT DO NOTHING",
      dumped(records));
}

/// A cell has one journal, and another after the replacement of its disk.
constexpr int kMostJournals = 100;
constexpr int kMostCellsStored = 20'000;
/// Scattered numbers lengthen the ranges of a journal and slow every batch.
constexpr int kMostRanges = 5000;
constexpr std::size_t kMostPayload = 64u << 10, kMostTopic = 300;
constexpr long kMostOfCell = 100, kMostInAll = 10'000;
constexpr long kMostBytesOfCell = 16L << 20, kMostBytesInAll = 1L << 30;

/// Rows are created, and thereby locked, in the same order by all collectors, which avoids
/// deadlocks.
template <class Row>
json sorted(std::vector<Row> rows, json (*record)(const Row&)) {
  std::sort(rows.begin(), rows.end());
  rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
  json all = json::array();
  for (const Row& row : rows) all.push_back(record(row));
  return all;
}

json record_of(const CellName& name) { return {{"plant", name.plant}, {"cell", name.cell}}; }

/// Creates the cells of a batch. Returns those beyond the capacity, so that invented names do not
/// fill the database.
std::set<CellName> make_cells(pqxx::work& work, const Batch& batch) {
  std::vector<CellName> names;
  for (const Fact& fact : batch.facts) names.push_back(fact.of);
  for (const plant::Presence& presence : batch.presences) names.push_back(presence.of);
  std::set<CellName> refused;
  if (names.empty()) return refused;
  const std::string all = dumped(sorted<CellName>(std::move(names), record_of));
  work.exec_params(
      "INSERT INTO cells (plant, cell) SELECT r.plant, r.cell FROM jsonb_to_recordset($1) AS r(plant text, "
      "cell text) WHERE NOT EXISTS (SELECT FROM cells c WHERE c.plant = r.plant AND c.cell = r.cell) AND "
      "(SELECT count(*) FROM cells) < $2 ORDER BY 1, 2 ON CONFLICT DO NOTHING",
      all, kMostCellsStored);
  const pqxx::result left = work.exec_params(
      "SELECT r.plant, r.cell FROM jsonb_to_recordset($1) AS r(plant text, cell text) WHERE NOT EXISTS "
      "(SELECT FROM cells c WHERE c.plant = r.plant AND c.cell = r.cell)",
      all);
  for (const auto& row : left) refused.insert({row[0].as<std::string>(), row[1].as<std::string>()});
  return refused;
}

/// Removes and refuses messages of such cells.
template <class T>
std::vector<T> without(const std::set<CellName>& unknown, const std::vector<T>& all,
                       std::vector<Refused>& refused) {
  std::vector<T> kept;
  for (const T& one : all) {
    if (unknown.contains(one.of))
      refused.push_back(refused_as(one, Refusal::kBound, "the plant has 20000 cells already"));
    else
      kept.push_back(one);
  }
  return kept;
}

// A presence is newer than another of the same journal if its number is higher; with equal numbers, if it arrives later.
// Birth and will of one connection have the same time; the will is newer.
void put_presences(pqxx::work& work, std::vector<plant::Presence> presences) {
  std::ranges::stable_sort(presences, {}, &plant::Presence::of);
  for (const plant::Presence& one : presences)
    work.exec_params(
        "INSERT INTO presence AS p (cell_id, online, farewell, journal, number, software, mock, at, received) "
        "SELECT id, $3, $4, $5, $6, $7, $8, $9::timestamptz, now() FROM cells WHERE plant = $1 AND cell = $2 "
        "ON CONFLICT (cell_id) DO UPDATE SET online = excluded.online, farewell = excluded.farewell, "
        "journal = excluded.journal, number = excluded.number, software = excluded.software, "
        "mock = excluded.mock, at = excluded.at, received = excluded.received "
        "WHERE p.journal <> excluded.journal OR excluded.number > p.number OR "
        "(excluded.number = p.number AND (excluded.at <> p.at OR (p.online AND NOT excluded.online)))",
        one.of.plant, one.of.cell, one.online, one.farewell, one.journal, one.number, one.software,
        one.mock, one.time);
}

using JournalName = std::tuple<std::string, std::string, std::string>;  // plant, cell, journal

JournalName journal_of(const Fact& fact) { return {fact.of.plant, fact.of.cell, fact.journal}; }

json journal_record(const JournalName& name) {
  return {
      {"plant", std::get<0>(name)}, {"cell", std::get<1>(name)}, {"journal", std::get<2>(name)}};
}

void make_and_lock_journals(pqxx::work& work, const std::string& names) {
  work.exec_params(
      "INSERT INTO journals (cell_id, name) SELECT c.id, r.journal FROM jsonb_to_recordset($1) AS r(plant text, "
      "cell text, journal text, position int) JOIN cells c ON c.plant = r.plant AND c.cell = r.cell WHERE NOT EXISTS "
      "(SELECT FROM journals j WHERE j.cell_id = c.id AND j.name = r.journal) AND "
      "(SELECT count(*) FROM journals j WHERE j.cell_id = c.id) < $2 ORDER BY c.id, r.position ON CONFLICT DO NOTHING",
      names, kMostJournals);
  work.exec_params(
      "SELECT FROM journals WHERE id IN (SELECT j.id FROM jsonb_to_recordset($1) AS r(plant text, cell text, "
      "journal text) JOIN cells c ON c.plant = r.plant AND c.cell = r.cell JOIN journals j "
      "ON j.cell_id = c.id AND j.name = r.journal) ORDER BY id FOR UPDATE",
      names);
}

/// Journal of a fact, and whether its number is stored already or fits.
struct Place {
  long journal = 0;  ///< 0: none, the cell has too many
  bool known = false, fits = true;
};

/// Each name once. Of two new journals of a cell the later one in the batch counts as newer.
json in_order_of_arrival(const std::vector<JournalName>& names) {
  std::map<JournalName, std::size_t> first;
  for (std::size_t i = 0; i < names.size(); ++i) first.try_emplace(names[i], i);
  json all = json::array();
  for (const auto& [name, position] : first) {
    json record = journal_record(name);
    record["position"] = position;
    all.push_back(std::move(record));
  }
  return all;
}

std::vector<Place> places_of(pqxx::work& work, const std::vector<Fact>& facts) {
  json asked = json::array();
  std::vector<JournalName> names;
  for (const Fact& fact : facts) {
    names.push_back(journal_of(fact));
    json record = journal_record(names.back());
    record["number"] = fact.number;
    record["position"] = asked.size();
    asked.push_back(std::move(record));
  }
  make_and_lock_journals(work, dumped(in_order_of_arrival(names)));
  const pqxx::result found = work.exec_params(
      "WITH r AS (SELECT * FROM jsonb_to_recordset($1) AS r(plant text, cell text, journal text, "
      "number bigint, position int)), "
      "j AS MATERIALIZED (SELECT j.id, c.plant, c.cell, j.name, j.numbers, "
      "(SELECT count(*) FROM unnest(j.numbers)) AS ranges FROM journals j JOIN cells c ON c.id = j.cell_id "
      "WHERE (c.plant, c.cell, j.name) IN (SELECT plant, cell, journal FROM r)) "
      "SELECT r.position, j.id, j.numbers @> r.number, j.ranges < $2 OR j.numbers @> r.number - 1 OR "
      "j.numbers @> r.number + 1 FROM r JOIN j ON j.plant = r.plant AND j.cell = r.cell AND j.name = r.journal",
      dumped(asked), kMostRanges);
  std::vector<Place> places(facts.size());
  for (const auto& row : found)
    places.at(row[0].as<std::size_t>()) = {row[1].as<long>(), row[2].as<bool>(), row[3].as<bool>()};
  return places;
}

void mark_numbers_taken(pqxx::work& work, const json& taken) {
  work.exec_params(
      "UPDATE journals j SET newest = now(), numbers = j.numbers + n.numbers, dropped = CASE WHEN "
      "(SELECT count(*) FROM unnest(j.dropped)) < $2 THEN j.dropped + n.dropped ELSE j.dropped END "
      "FROM (SELECT journal, range_agg(int8range(number, number + 1)) AS numbers, coalesce(range_agg("
      "int8range(first, last + 1)) FILTER (WHERE first IS NOT NULL), '{}') AS dropped FROM "
      "jsonb_to_recordset($1) AS r(journal bigint, number bigint, first bigint, last bigint) GROUP BY journal) n "
      "WHERE j.id = n.journal",
      dumped(taken), kMostRanges);
}

json taken_record(const Fact& fact, long journal) {
  json record{{"journal", journal}, {"number", fact.number}};
  const auto* dropped = std::get_if<plant::DroppedFact>(&fact.body);
  if (dropped != nullptr && dropped->first <= dropped->last) {
    record["first"] = dropped->first;
    record["last"] = dropped->last;
  }
  return record;
}

/// Ranges of each journal that had a result, those of this batch first and then the newest; its cell keeps results
/// until they are confirmed.
std::vector<plant::Stored> stored_of(pqxx::work& work, const std::vector<Fact>& facts,
                                     const std::vector<Place>& places) {
  std::map<long, const Fact*> with_results;
  json results = json::array();
  for (std::size_t i = 0; i < facts.size(); ++i) {
    if (places[i].journal == 0 || plant::worth_of(facts[i].body) != plant::Worth::kResult) continue;
    with_results.emplace(places[i].journal, &facts[i]);
    results.push_back({{"journal", places[i].journal}, {"number", facts[i].number}});
  }
  if (results.empty()) return {};
  const pqxx::result found = work.exec_params(
      "SELECT j.id, lower(n.r), upper(n.r) - 1 FROM journals j JOIN (SELECT journal, range_agg(int8range(number, "
      "number + 1)) AS now FROM jsonb_to_recordset($1) AS r(journal bigint, number bigint) GROUP BY journal) b "
      "ON b.journal = j.id, LATERAL (SELECT r FROM unnest(j.numbers) r "
      "ORDER BY r && b.now DESC, lower(r) DESC LIMIT $2) n ORDER BY 1, 2",
      dumped(results), plant::kMostStoredRanges);
  std::map<long, plant::Stored> by_journal;
  for (const auto& row : found) {
    const long journal = row[0].as<long>();
    const Fact& fact = *with_results.at(journal);
    plant::Stored& stored =
        by_journal.try_emplace(journal, plant::Stored{fact.of, fact.journal, {}}).first->second;
    stored.numbers.emplace_back(row[1].as<std::int64_t>(), row[2].as<std::int64_t>());
  }
  std::vector<plant::Stored> all;
  for (auto& [journal, stored] : by_journal) all.push_back(std::move(stored));
  return all;
}

Written put_facts(pqxx::work& work, const std::vector<Fact>& facts, std::vector<Refused>& refused) {
  Written written;
  if (facts.empty()) return written;
  const std::vector<Place> places = places_of(work, facts);
  std::set<std::pair<long, std::int64_t>> in_batch;
  Rows rows;
  json taken = json::array();
  for (std::size_t i = 0; i < facts.size(); ++i) {
    const Place& place = places[i];
    if (place.journal == 0 || (!place.known && !place.fits)) {
      const char* words = place.journal == 0 ? "the cell has 100 journals already"
                                             : "the journal's numbers have 5000 gaps already";
      refused.push_back(refused_as(facts[i], Refusal::kBound, words));
      continue;
    }
    if (place.known || !in_batch.emplace(place.journal, facts[i].number).second) {
      ++written.twice;
      continue;
    }
    ++written.facts;
    add_rows(facts[i], place.journal, rows);
    taken.push_back(taken_record(facts[i], place.journal));
  }
  for (const char* table : kRowTables)
    if (rows.contains(table)) insert(work, table, rows[table]);
  if (!taken.empty()) mark_numbers_taken(work, taken);
  written.stored = stored_of(work, facts, places);
  return written;
}

/// True for messages that another version, or a plant with more capacity, may accept: they are kept
/// complete for a second reading.
bool may_be_read_later(Refusal why) {
  return why == Refusal::kMessage || why == Refusal::kBound || why == Refusal::kDatabase;
}

json refused_record(const Refused& one) {
  const std::size_t most = may_be_read_later(one.why) ? one.payload.size() : kMostPayload;
  return {{"plant", one.of.plant},
          {"cell", one.of.cell},
          {"topic", std::string(calib::beginning(one.topic, kMostTopic))},
          {"why", to_string(one.why)},
          {"words", std::string(calib::beginning(one.words, kMostTopic))},
          {"payload", plant::to_base64(std::string_view(one.payload).substr(0, most))},
          {"bytes", one.payload.size()},
          {"sum", calib::sha256(one.topic + '\n' + one.payload)},
          {"times", 1}};
}

/// Replaces NUL, which jsonb does not support.
void without_nul(std::string& text) { std::replace(text.begin(), text.end(), '\0', ' '); }

/// Each message once with its count, since cells repeat messages that are not acknowledged.
json refused_records(const std::vector<Refused>& refused) {
  std::map<std::tuple<std::string, std::string, std::string>, std::size_t> places;
  json records = json::array();
  for (Refused one : refused) {
    without_nul(one.topic);
    without_nul(one.words);
    json record = refused_record(one);
    const auto [place, is_new] = places.try_emplace(
        {one.of.plant, one.of.cell, record["sum"].get<std::string>()}, records.size());
    if (is_new)
      records.push_back(std::move(record));
    else
      records[place->second]["times"] = records[place->second]["times"].get<int>() + 1;
  }
  return records;
}

void count_refusals(pqxx::work& work, const Batch& batch, const std::vector<Refused>& refused) {
  std::map<std::tuple<std::string, std::string, Refusal>, std::size_t> counts;
  for (const Refused& one : refused) ++counts[{one.of.plant, one.of.cell, one.why}];
  for (const auto& [of, count] : batch.too_many)
    counts[{of.plant, of.cell, Refusal::kRate}] += count;
  json records = json::array();
  for (const auto& [key, count] : counts)
    records.push_back({{"plant", std::get<0>(key)},
                       {"cell", std::get<1>(key)},
                       {"why", to_string(std::get<2>(key))},
                       {"count", count}});
  work.exec_params(
      "INSERT INTO quarantine_counts AS q (plant, cell, why, count, newest) SELECT plant, cell, why::refusal, "
      "count, now() FROM jsonb_to_recordset($1) AS r(plant text, cell text, why text, count bigint) "
      "ON CONFLICT (plant, cell, why) DO UPDATE SET count = q.count + excluded.count, newest = excluded.newest",
      dumped(records));
}

/// Deletes rows beyond the bounds among the rows `kept`, ranked in each window; never the newest.
std::string beyond(const std::string& kept) {
  return "DELETE FROM quarantine q USING (SELECT id, row_number() OVER w AS place, sum(octet_length(payload)) "
         "OVER w AS bytes " +
         kept + ") k WHERE q.id = k.id AND k.place > 1 AND (k.place > $1 OR k.bytes > $2)";
}

void quarantine(pqxx::work& work, const Batch& batch, const std::vector<Refused>& refused) {
  if (refused.empty() && batch.too_many.empty()) return;
  count_refusals(work, batch, refused);
  if (refused.empty()) return;
  const std::string all = dumped(refused_records(refused));
  // Serialised, since the following statements count rows.
  work.exec_params("SELECT pg_advisory_xact_lock($1)", kTablesLock + 1);
  work.exec_params(
      "INSERT INTO quarantine AS q (plant, cell, topic, why, words, payload, bytes, sum, times) SELECT plant, cell, "
      "topic, why::refusal, words, decode(payload, 'base64'), bytes, sum, times FROM jsonb_to_recordset($1) AS r("
      "plant text, cell text, topic text, why text, words text, payload text, bytes bigint, sum text, times bigint) "
      "ON CONFLICT (plant, cell, sum) DO UPDATE SET received = now(), why = excluded.why, words = excluded.words, "
      "times = q.times + excluded.times",
      all);
  work.exec_params(
      beyond(
          "FROM quarantine WHERE (plant, cell) IN (SELECT plant, cell FROM jsonb_to_recordset($3) AS r("
          "plant text, cell text)) WINDOW w AS (PARTITION BY plant, cell ORDER BY id DESC)"),
      kMostOfCell, kMostBytesOfCell, all);
  work.exec_params(beyond("FROM quarantine WINDOW w AS (ORDER BY id DESC)"), kMostInAll,
                   kMostBytesInAll);
}

}  // namespace

Refused refused_as(const Fact& fact, Refusal why, const std::string& words) {
  const plant::Topic topic{fact.of, plant::Subject::kFact, plant::kind_of(fact.body)};
  return {fact.of, plant::to_text(topic), plant::to_json(fact), why, words};
}

Refused refused_as(const plant::Presence& presence, Refusal why, const std::string& words) {
  const plant::Topic topic{presence.of, plant::Subject::kPresence, ""};
  return {presence.of, plant::to_text(topic), plant::to_json(presence), why, words};
}

Written write_once(pqxx::connection& connection, const Batch& batch) {
  Written written;
  guarded([&] {
    pqxx::work work(connection);
    std::vector<Refused> refused = batch.refused;
    const std::set<CellName> unknown = make_cells(work, batch);
    if (unknown.empty()) {
      put_presences(work, batch.presences);
      written = put_facts(work, batch.facts, refused);
    } else {
      put_presences(work, without(unknown, batch.presences, refused));
      written = put_facts(work, without(unknown, batch.facts, refused), refused);
    }
    quarantine(work, batch, refused);
    written.refused = refused.size();
    for (const auto& [of, count] : batch.too_many) written.refused += count;
    work.commit();
  });
  return written;
}

}  // namespace cellcal::daemon::fleet
