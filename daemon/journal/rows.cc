#include "daemon/journal/rows.h"

#include <map>

#include "daemon/journal/database/chain.h"

namespace cellcal::daemon {

namespace {

/// The row that an entry is of, or nothing where it is gone or another by now.
void read_columns(Database& database, RowEntry& entry) {
  Statement row(database, rows_of(entry.table, "rowid").c_str());
  if (!row.bind(1, entry.row).step()) return;
  std::vector<Value> values = row.values();
  if (digest_of(values) != entry.digest) return;
  entry.names = row.column_names();
  // The rowid is the entry's own.
  entry.names.erase(entry.names.begin());
  entry.columns.assign(values.begin() + 1, values.end());
}

}  // namespace

SessionRows read_rows(Database& database, const std::string& journal, std::int64_t session) {
  SessionRows rows{journal, session, {}};
  std::map<std::pair<std::string, std::int64_t>, std::size_t> newest;
  Statement entries(database,
                    "SELECT chain.number, chain.row, chain.kind, chain.digest, chain.sum, "
                    "before.sum FROM chain LEFT JOIN chain AS before "
                    "ON before.number = chain.number - 1 WHERE chain.session=? "
                    "ORDER BY chain.number");
  entries.bind(1, session);
  while (entries.step()) {
    RowEntry entry;
    entry.number = entries.integer(0);
    entry.row = entries.integer(1);
    entry.table = entries.text(2);
    entry.digest = entries.text(3);
    entry.sum = entries.text(4);
    entry.before = entries.text(5);
    newest[{entry.table, entry.row}] = rows.entries.size();
    rows.entries.push_back(std::move(entry));
  }
  for (const auto& [of, index] : newest) read_columns(database, rows.entries[index]);
  return rows;
}

}  // namespace cellcal::daemon
