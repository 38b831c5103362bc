#pragma once
// A session's rows as JSON lines that can be checked without the journal, format "cellcal.rows/1".
//
// The first line says whose they are, how many entries there are, and their sum. Each further one is an entry of the chain: its number, the sum
// before it, the row's table, number and digest, its own sum; and `columns`, the row, where no later
// entry has another. Values are JSON's own, or {"blob": hex}, {"text": hex} (not UTF-8), {"float":
// hex} (infinite). Sums hold all but the journal's name in the first line. Who alters a value has to
// alter a digest and all sums behind it, and those are in the journal that they came from.

#include <cstdint>
#include <string>
#include <vector>

#include "daemon/journal/store/sqlite.h"

namespace cellcal::daemon {

struct RowEntry {
  std::int64_t number = 0, row = 0;
  std::string before, table, digest, sum;
  std::vector<std::string> names;  ///< of the columns; none: changed since
  std::vector<Value> columns;
};

struct SessionRows {
  std::string journal;
  std::int64_t session = 0;
  std::vector<RowEntry> entries;
};

/// As they stand in the journal, which verified them.
SessionRows read_rows(Database& database, const std::string& journal, std::int64_t session);

std::string to_lines(const SessionRows& rows);
/// SHA-256 of the sums of the first `count` entries in their order: one left out, put in or altered makes it
/// another.
std::string sum_of_entries(const SessionRows& rows, std::size_t count);
/// Of the session.
std::size_t touches_in(const SessionRows& rows);
bool is_utf8(const std::string& text);
/// Throws JournalError naming `from`, line, row and column where a value is none that a journal writes, whatever its sums
/// (row_check.cc).
void refuse_impossible(const SessionRows& rows, const std::string& from);
/// Throws JournalError naming `from` and the line where they are not as they were written.
SessionRows parse_lines(const std::string& lines, const std::string& from);

}  // namespace cellcal::daemon
