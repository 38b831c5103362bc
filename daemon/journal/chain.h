#pragma once
// Checksums of all rows, chained: a row that was changed, left out or lost shows.
//
// Every row that is written, and every change of a session's row, adds an entry: the row's SHA-256,
// and the SHA-256 of the previous entry and this one. Entries are numbered without a gap. The head
// file next to the journal repeats the sum of the newest entry, so that a lost tail is detected. It
// is written after the commit: after a crash the journal may be ahead of the head, never older.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "daemon/journal/store/sqlite.h"
#include "daemon/journal/store/store_files.h"

namespace cellcal::daemon {

/// Tables whose rows have entries.
inline constexpr const char* kChainedTables[] = {"session",    "touch",   "reading",     "event",
                                                 "change",     "contact", "compared",    "dropped",
                                                 "activation", "search",  "interruption"};
/// Tables whose rows retention may drop. Their entries stay: entries before an entry of kind 'dropped' of the same
/// session belong to rows that no longer exist.
inline constexpr const char* kRawTables[] = {"event",   "change", "contact",
                                             "reading", "search", "interruption"};
bool is_raw(const std::string& table);

/// The row's SHA-256. Columns that are empty at its end do not count: a later version's.
std::string digest_of(const std::vector<Value>& row);
/// A chain's next sum.
std::string sum_of(const std::string& before, std::int64_t number, std::int64_t session,
                   const std::string& kind, std::int64_t row, const std::string& digest);
/// Rows of one session, or the one row of a table; first its rowid.
std::string rows_of(const std::string& table, const char* column);
const char* session_column(const std::string& table);

struct Walked {
  Head end;
  bool met = false;  ///< the entry that was looked for
};
/// Along all entries. Throws JournalError where one was changed or lost.
Walked walk_chain(Database& database, const std::optional<Head>& look_for = {});
/// Throws DamagedError if a row of this session was changed or is missing; JournalError if it cannot be read
/// now.
void verify_rows(Database& database, std::int64_t session);
/// Sessions with a changed or missing row.
std::vector<std::int64_t> damaged_sessions(Database& database);

class Chain {
 public:
  Chain(Database& database, HeadFile& head) : database_(database), head_(head) {}

  /// Adds the first entry of a new journal, within its transaction.
  void begin();
  /// Walks all entries, compares the last with the head and continues after it. Returns warnings.
  /// Throws JournalError if entries were changed or lost.
  std::vector<std::string> open();

  /// Adds an entry for the row with this rowid, within its transaction.
  void add(std::int64_t session, const char* table, std::int64_t row);
  /// The transaction is on disk, or was rolled back.
  void committed();
  void rolled_back() {
    newest_ = on_disk_;
    known_.clear();
  }
  void write_head() { head_.write(on_disk_); }

  /// Throws as verify_rows(). What it finds is remembered until the session is written to.
  void verify(std::int64_t session);
  /// The session's own row is as it was written, and all others as far as they were verified. What others do to the file
  /// meanwhile only verify() sees.
  bool is_whole(std::int64_t session);
  bool was_verified(std::int64_t session) const;
  /// The same of one other row.
  bool is_whole(std::int64_t session, const char* table, std::int64_t row);
  /// Number of the newest entry of the session's own row; 0: there is none.
  std::int64_t last_entry(std::int64_t session);
  /// Highest session number ever used.
  std::int64_t newest_session();
  /// Unique name of this journal.
  std::string name();
  const Head& end() const { return on_disk_; }

 private:
  void append(std::int64_t session, const std::string& table, std::int64_t row,
              const std::string& digest);
  Database& database_;
  HeadFile& head_;
  Head newest_, on_disk_;
  struct Known {
    std::optional<bool> own_row, all_rows;  ///< as they were written
  };
  std::map<std::int64_t, Known> known_;  ///< by session
};

// Origin of an imported session, as stored in its row.

struct Origin {
  std::string journal;  ///< its name
  std::int64_t session = 0;
  std::string sum;  ///< SHA-256 of the rows that were imported
  /// Number and sum (sum_of_entries) of its chain's entries.
  std::size_t entries = 0;
  std::string entries_sum{};
};

std::string to_text(const Origin& origin);
/// Returns an empty origin if the text is malformed.
Origin origin_of(const std::string& text);

}  // namespace cellcal::daemon
