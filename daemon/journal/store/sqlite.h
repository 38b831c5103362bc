#pragma once
// SQLite connection and statement. Errors are JournalError.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

struct sqlite3;
struct sqlite3_backup;
struct sqlite3_stmt;

namespace cellcal::daemon {

struct Blob {
  std::string bytes;
  bool operator==(const Blob&) const = default;
};
/// Value of a column: NULL or one of SQLite's types.
using Value = std::variant<std::monostate, std::int64_t, double, std::string, Blob>;
/// Values as bytes with their types and lengths: different rows have different bytes.
std::string bytes_of(std::span<const Value> values);

class Database {
 public:
  /// Opens or creates the file. Throws JournalError.
  explicit Database(const std::filesystem::path& path);
  ~Database();
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  /// One or more statements without results.
  void execute(const char* sql);
  /// One statement, its parameters bound in order.
  template <class... T>
  void run(const char* sql, const T&... values);
  /// First column of the first row.
  std::int64_t integer(const char* sql);
  std::string text(const char* sql);
  std::int64_t last_row_id() const;
  /// Keeps the write-ahead log when the database is closed (default: false).
  void keep_log_on_close(bool keep);
  /// Moves the write-ahead log into the file as far as space permits. Outside of a transaction.
  void move_log_into_file();
  /// Throws DiskFullError or JournalError.
  [[noreturn]] void fail(int code) const;

  const std::string& name() const { return name_; }

 private:
  static bool full(int code);
  friend class PageCopy;
  friend class Statement;
  friend class Transaction;
  std::string name_;
  sqlite3* handle_ = nullptr;
};

/// A prepared statement; parameters count from 1 and columns from 0, as in SQLite.
class Statement {
 public:
  Statement(Database& database, const char* sql);
  /// Binds the parameters in order: whole numbers, double, text, Blob, Value; an empty optional is NULL.
  template <class... T>
  requires(sizeof...(T) > 0) Statement(Database& database, const char* sql, const T&... values)
      : Statement(database, sql) {
    int index = 0;
    (bind_any(++index, values), ...);
  }
  ~Statement();
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  Statement& bind(int index, std::int64_t value);
  Statement& bind(int index, double value);
  Statement& bind(int index, std::string_view value);
  Statement& bind_blob(int index, std::string_view value);
  Statement& bind(int index, const Value& value);

  /// True if there is a row.
  bool step();
  std::int64_t integer(int column);
  double number(int column);
  std::string text(int column);  ///< text or blob; empty where NULL
  bool is_null(int column);
  /// The whole row.
  std::vector<Value> values();
  std::vector<std::string> column_names();

 private:
  template <class T>
  void bind_any(int index, const T& value) {
    if constexpr (std::is_integral_v<T>)
      bind(index, static_cast<std::int64_t>(value));
    else if constexpr (std::is_same_v<T, Blob>)
      bind_blob(index, value.bytes);
    else if constexpr (std::is_convertible_v<const T&, std::string_view>)
      bind(index, std::string_view(value));
    else
      bind(index, value);
  }
  template <class T>
  void bind_any(int index, const std::optional<T>& value) {
    if (value) bind_any(index, *value);
  }
  Value value(int column);
  void check(int code);

  Database& database_;
  sqlite3_stmt* handle_ = nullptr;
};

template <class... T>
void Database::run(const char* sql, const T&... values) {
  Statement(*this, sql, values...).step();
}

/// Begins a transaction; rolled back unless commit() returned.
class Transaction {
 public:
  explicit Transaction(Database& database);
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  void commit();

 private:
  Database& database_;
  bool open_ = true;
};

/// Copies a database page by page into another that is not open elsewhere. Concurrent writes by the
/// source's own connection are included in the copy.
class PageCopy {
 public:
  PageCopy(Database& from, Database& to);
  ~PageCopy();
  PageCopy(const PageCopy&) = delete;
  PageCopy& operator=(const PageCopy&) = delete;

  /// Returns true if pages are left, false if the copy is complete and on disk. Throws
  /// JournalError.
  bool step(int pages);

 private:
  Database& to_;
  sqlite3_backup* handle_ = nullptr;
};

/// A failed read or write of the journal. The message names the file and the remedy.
struct JournalError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The checksums of a session's rows do not match; permanent. SQLite's "malformed" is not a DamagedError, because it
/// is also returned for an unavailable disk (EIO, SQLITE_IOERR_CORRUPTFS).
struct DamagedError : JournalError {
  using JournalError::JournalError;
};

/// Another program's database, or of another schema version; permanent.
struct OtherJournalError : JournalError {
  using JournalError::JournalError;
};

/// For want of room, which may be made.
struct DiskFullError : JournalError {
  using JournalError::JournalError;
};

}  // namespace cellcal::daemon
