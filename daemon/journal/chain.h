#pragma once
// Checksums of all rows, chained, so that a changed, omitted or lost row is detected.
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

/// Of a journal, or of the outbox's source: `words` times 32 bits, in hexadecimal.
std::string random_name(int words);

/// Tables whose rows have entries.
inline constexpr const char* kChainedTables[] = {"session",    "touch",   "reading",     "event",
                                                 "change",     "contact", "compared",    "dropped",
                                                 "activation", "search",  "interruption"};
/// Tables whose rows retention may delete. Their entries remain: entries before an entry of kind
/// 'dropped' of the same session belong to rows that no longer exist.
inline constexpr const char* kRawTables[] = {"event",   "change", "contact",
                                             "reading", "search", "interruption"};
bool is_raw(const std::string& table);

/// The row's SHA-256, without empty trailing columns, which a later version may have added.
std::string digest_of(const std::vector<Value>& row);
/// Next sum of a chain.
std::string sum_of(const std::string& before, std::int64_t number, std::int64_t session,
                   const std::string& kind, std::int64_t row, const std::string& digest);
/// Statement that selects the rows of one session, or the one row of a table; first its rowid.
std::string rows_of(const std::string& table, const char* column);
const char* session_column(const std::string& table);

struct Walked {
  Head end;
  bool met = false;  ///< the entry `expected` exists
};
/// Verifies all entries. Throws JournalError if one was changed or lost.
Walked walk_chain(Database& database, const std::optional<Head>& expected = {});
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
  /// Inserts a row and adds its entry, within its transaction. `values`: all columns after `session` in the order of
  /// the schema, to which a later version only appends.
  template <class... T>
  void insert(std::int64_t session, const char* table, const T&... values) {
    std::string sql = std::string("INSERT INTO ") + table + " VALUES (?";
    for (std::size_t i = 0; i < sizeof...(T); ++i) sql += ",?";
    database_.run((sql + ")").c_str(), session, values...);
    add(session, table, database_.last_row_id());
  }
  /// The transaction is on disk, or was rolled back.
  void committed();
  void rolled_back() {
    newest_ = on_disk_;
    known_.clear();
  }
  void write_head() { head_.write(on_disk_); }

  /// Throws as verify_rows(). The result is cached until the session is written to.
  void verify(std::int64_t session);
  /// True if the session's own row is unchanged, and all others as far as they were verified.
  /// Changes by other programs in the meantime are detected by verify() only.
  bool is_whole(std::int64_t session);
  bool was_verified(std::int64_t session) const;
  /// True if the given row is unchanged.
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
  bool head_due_ = false;  ///< it could not be written
  Head newest_, on_disk_;
  struct Known {
    std::optional<bool> own_row, all_rows;  ///< unchanged
  };
  std::map<std::int64_t, Known> known_;  ///< by session
};

// Origin of an imported session, as stored in its row.

struct Origin {
  std::string journal;  ///< name of the journal
  std::int64_t session = 0;
  std::string sum;  ///< SHA-256 of the rows that were imported
  /// Number and sum (sum_of_entries) of the chain entries.
  std::size_t entries = 0;
  std::string entries_sum{};
};

std::string to_text(const Origin& origin);
/// Returns an empty origin if the text is malformed.
Origin origin_of(const std::string& text);

}  // namespace cellcal::daemon
