#pragma once
// Facts as rows of their tables: JSON records, which PostgreSQL takes apart (jsonb_to_recordset).

#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "daemon/plant/messages/fact.h"

namespace cellcal::daemon::fleet {

/// By table, in the order in which they must be written; of each an array of records.
using Rows = std::map<std::string, nlohmann::json>;

/// The fact is `journal_id`'s.
void add_rows(const plant::Fact& fact, long journal_id, Rows& rows);

/// "INSERT INTO touches ... SELECT ... FROM jsonb_to_recordset($1) ...", for each table of rows, parents first.
struct TableInsert {
  const char* table;
  const char* sql;
};
const std::vector<TableInsert>& inserts();

/// What jsonb takes: bytes that are not UTF-8 are replaced.
std::string dumped(const nlohmann::json& value);

}  // namespace cellcal::daemon::fleet
