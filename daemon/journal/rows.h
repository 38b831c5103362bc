#pragma once
// A session's rows as JSON lines that can be verified without the journal, format "cellcal.rows/1".
//
// The first line has journal, session, number of entries and their sum. Each further line is an
// entry of the chain: its number, the previous sum, the row's table, number and digest, its own
// sum; and the row's `columns`, unless a later entry replaces it. Values are JSON's own, or
// {"blob": hex}, {"text": hex} (not UTF-8), {"float": hex} (infinite). Sums cover all but the
// journal's name in the first line. Altering a value requires altering its digest and all later
// sums, which the recording journal still has.

#include <cstdint>
#include <string>
#include <vector>

#include "daemon/journal/store/sqlite.h"

namespace cellcal::daemon {

struct RowEntry {
  std::int64_t number = 0, row = 0;
  std::string before, table, digest, sum;
  std::vector<std::string> names;  ///< of the columns; empty: changed since
  std::vector<Value> columns;
};

struct SessionRows {
  std::string journal;
  std::int64_t session = 0;
  std::vector<RowEntry> entries;
};

/// Text of a column; empty for another type, or without it.
std::string text_of(const RowEntry& entry, const std::string& column);

/// Reads a verified session.
SessionRows read_rows(Database& database, const std::string& journal, std::int64_t session);

std::string to_lines(const SessionRows& rows);
/// SHA-256 of the sums of the first `count` entries in order; any omission, insertion or change
/// alters it.
std::string sum_of_entries(const SessionRows& rows, std::size_t count);
/// Number of touches of the session.
std::size_t touches_in(const SessionRows& rows);
bool is_utf8(const std::string& text);
/// Throws JournalError naming `from`, line, row and column for a value that no journal writes,
/// regardless of its sums.
void refuse_impossible(const SessionRows& rows, const std::string& from);
/// Throws JournalError naming `from` and the line if the lines are damaged or altered.
SessionRows parse_lines(const std::string& lines, const std::string& from);

}  // namespace cellcal::daemon
