#include "tests/daemon/fleet/faults/tally.h"

#include <fmt/format.h>

#include <array>
#include <map>
#include <pqxx/pqxx>

namespace cellcal::daemon::fleet::testing {

namespace {

struct Table {
  const char* name;
  const char* kind;
};
constexpr std::array kTables{Table{"session_facts", "session"},
                             Table{"calibrations", "calibration"},
                             Table{"checks", "check"},
                             Table{"activations", "activation"},
                             Table{"certificates", "certificate"},
                             Table{"alarms", "alarm"},
                             Table{"answers", "answer"},
                             Table{"drops", "dropped"},
                             Table{"phases", "phase"},
                             Table{"touches", "touch"},
                             Table{"health", "health"}};

using Key = std::pair<std::string, std::int64_t>;  // journal, number

void count_rows(pqxx::work& work, const Table& table,
                const std::map<std::string, const Truth*>& all, std::map<Key, int>& seen,
                Tally& tally) {
  const pqxx::result rows = work.exec(fmt::format(
      "SELECT c.cell, j.name, t.number, t.session, to_char(t.at AT TIME ZONE 'UTC', "
      "'YYYY-MM-DD\"T\"HH24:MI:SS.MS\"Z\"') FROM fleet.{} t JOIN fleet.journals j ON j.id = t.journal_id "
      "JOIN fleet.cells c ON c.id = j.cell_id",
      table.name));
  for (const auto& row : rows) {
    const auto cell = all.find(row[0].as<std::string>());
    const auto journal = row[1].as<std::string>();
    const auto number = row[2].as<std::int64_t>();
    if (cell == all.end() || cell->second->journal != journal || number < 1 ||
        number > static_cast<std::int64_t>(cell->second->facts.size())) {
      ++tally.strangers;
      continue;
    }
    if (seen[{journal, number}]++ > 0) {
      ++tally.twice;
      continue;
    }
    const ReportedFact& fact = cell->second->facts[static_cast<std::size_t>(number - 1)];
    if (fact.kind != table.kind || fact.session != row[3].as<std::int64_t>() ||
        (!fact.time.empty() && fact.time != row[4].as<std::string>()))
      ++tally.out_of_order;
    ++(fact.is_result() ? tally.stored_results : tally.stored_telemetry);
  }
}

std::size_t number(pqxx::work& work, const std::string& sql) {
  return work.exec(sql)[0][0].as<std::size_t>();
}

}  // namespace

Tally tally(const std::string& database, const std::vector<Truth>& cells) {
  pqxx::connection connection(database);
  pqxx::work work(connection);
  std::map<std::string, const Truth*> all;
  for (const Truth& cell : cells) all[cell.cell] = &cell;
  Tally tally;
  std::map<Key, int> seen;
  for (const Table& table : kTables) count_rows(work, table, all, seen, tally);
  for (const Truth& cell : cells) {
    std::int64_t newest_session = 0;
    for (std::size_t i = 0; i < cell.facts.size(); ++i) {
      const bool is_there = seen.contains({cell.journal, static_cast<std::int64_t>(i) + 1});
      if (cell.facts[i].is_result()) {
        ++tally.results;
        tally.missing_results += is_there ? 0 : 1;
      } else {
        ++tally.telemetry;
        tally.missing_telemetry += is_there ? 0 : 1;
      }
      if (cell.facts[i].kind == "session") newest_session = cell.facts[i].session;
    }
    if (newest_session == 0) continue;
    const pqxx::result state = work.exec_params(
        "SELECT session FROM fleet.cell_states WHERE cell = $1 AND state = 'done'", cell.cell);
    if (state.size() != 1 || state[0][0].as<std::int64_t>(0) != newest_session)
      ++tally.states_wrong;
  }
  for (const char* table : {"calibrations", "checks"})
    tally.altered += number(work, fmt::format("SELECT count(*) FROM fleet.{} WHERE sha256 <> "
                                              "encode(sha256(document), 'hex')",
                                              table));
  // A single text each.
  for (const char* table : {"calibrations", "checks"})
    tally.altered += number(work, fmt::format("SELECT greatest(count(DISTINCT sha256) - 1, 0) FROM "
                                              "fleet.{}",
                                              table));
  tally.refused = number(work, "SELECT coalesce(sum(count), 0) FROM fleet.quarantine_counts");
  return tally;
}

std::size_t stored_results(const std::string& database) {
  pqxx::connection connection(database);
  pqxx::work work(connection);
  std::size_t count = 0;
  for (const Table& table : kTables)
    if (ReportedFact{table.kind, 0, ""}.is_result())
      count += number(work, fmt::format("SELECT count(*) FROM fleet.{}", table.name));
  return count;
}

}  // namespace cellcal::daemon::fleet::testing
