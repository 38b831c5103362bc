#pragma once
// Internal to this module: one batch in one transaction.

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/fleet/connection.h"
#include "daemon/plant/messages/fact.h"

namespace cellcal::daemon::fleet {

/// Throws StoreUnavailable, BadData; nothing is written then.
Written write_once(pqxx::connection& connection, const Batch& batch);

// Corrections of each joint, extracted from a calibration for comparison between robots.

struct Correction {
  std::string joint, parameter, unit;
  double correction = 0.0, sigma = 0.0;  ///< in `unit`
  const char* decided_by = "";
};

/// Corrections of the arm's joints. Empty for a document that this version cannot read, which is
/// stored nevertheless.
std::vector<Correction> corrections_of(std::string_view document);

// Facts as rows of their tables: JSON records, which PostgreSQL expands (jsonb_to_recordset).

/// Arrays of records by table, in the order in which they must be written.
using Rows = std::map<std::string, nlohmann::json>;

/// Adds the rows of a fact of the journal `journal_id`.
void add_rows(const plant::Fact& fact, long journal_id, Rows& rows);

/// "INSERT INTO touches ... SELECT ... FROM jsonb_to_recordset($1) ...", for each table of rows, parents first.
struct TableInsert {
  const char* table;
  const char* sql;
};
const std::vector<TableInsert>& inserts();

/// JSON text for jsonb: bytes that are not UTF-8 are replaced.
std::string dumped(const nlohmann::json& value);

}  // namespace cellcal::daemon::fleet
