#pragma once
// Facts as rows of their tables: JSON records, which PostgreSQL expands (jsonb_to_recordset).

#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "daemon/plant/messages/fact.h"

namespace cellcal::daemon::fleet {

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
