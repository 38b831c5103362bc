#include "daemon/journal/sqlite.h"

#include <sqlite3.h>

#include "daemon/journal/journal.h"

namespace cellcal::daemon {

namespace {

const char* advice(int code) {
  switch (code & 0xff) {
    case SQLITE_FULL:
      return "the disk is full. Make room (what was recorded before is safe)";
    case SQLITE_IOERR:
      return "the disk reports errors. Check it";
    case SQLITE_READONLY:
    case SQLITE_PERM:
    case SQLITE_CANTOPEN:
      return "check that the directory exists and that the daemon may write there";
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      return "the file is damaged or no journal. Move it aside with its -wal and -shm files and "
             "keep it; the daemon begins a new one";
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return "used by another program. Check whether a second cellcald runs";
    default:
      return "see the message";
  }
}

}  // namespace

Database::Database(const std::filesystem::path& path) : name_(path.string()) {
  const int code =
      sqlite3_open_v2(name_.c_str(), &handle_, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, nullptr);
  if (code == SQLITE_OK) {
    sqlite3_extended_result_codes(handle_, 1);
    return;
  }
  const std::string message =
      "journal " + name_ + ": " + sqlite3_errstr(code) + "; " + advice(code);
  sqlite3_close(handle_);
  throw JournalError(message);
}

Database::~Database() { sqlite3_close_v2(handle_); }

void Database::fail(int code) const {
  throw JournalError("journal " + name_ + ": " + sqlite3_errmsg(handle_) + "; " + advice(code));
}

void Database::execute(const char* sql) {
  const int code = sqlite3_exec(handle_, sql, nullptr, nullptr, nullptr);
  if (code != SQLITE_OK) fail(code);
}

std::int64_t Database::integer(const char* sql) {
  Statement statement(*this, sql);
  return statement.step() ? statement.integer(0) : 0;
}

std::string Database::text(const char* sql) {
  Statement statement(*this, sql);
  return statement.step() ? statement.text(0) : std::string();
}

void Database::keep_log_on_close(bool keep) {
  sqlite3_db_config(handle_, SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, keep ? 1 : 0, nullptr);
}

std::int64_t Database::last_row_id() const { return sqlite3_last_insert_rowid(handle_); }

Statement::Statement(Database& database, const char* sql) : database_(database) {
  check(sqlite3_prepare_v2(database.handle_, sql, -1, &handle_, nullptr));
}

Statement::~Statement() { sqlite3_finalize(handle_); }

void Statement::check(int code) {
  if (code != SQLITE_OK) database_.fail(code);
}

Statement& Statement::bind(int index, std::int64_t value) {
  check(sqlite3_bind_int64(handle_, index, value));
  return *this;
}

Statement& Statement::bind(int index, double value) {
  check(sqlite3_bind_double(handle_, index, value));
  return *this;
}

Statement& Statement::bind(int index, std::string_view value) {
  check(sqlite3_bind_text64(handle_, index, value.data() == nullptr ? "" : value.data(),
                            value.size(), SQLITE_TRANSIENT, SQLITE_UTF8));
  return *this;
}

Statement& Statement::bind_blob(int index, std::string_view value) {
  check(sqlite3_bind_blob64(handle_, index, value.data() == nullptr ? "" : value.data(),
                            value.size(), SQLITE_TRANSIENT));
  return *this;
}

bool Statement::step() {
  const int code = sqlite3_step(handle_);
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  database_.fail(code);
}

std::int64_t Statement::integer(int column) { return sqlite3_column_int64(handle_, column); }

double Statement::number(int column) { return sqlite3_column_double(handle_, column); }

std::string Statement::text(int column) {
  const void* bytes = sqlite3_column_blob(handle_, column);
  const int size = sqlite3_column_bytes(handle_, column);
  return bytes == nullptr
             ? std::string()
             : std::string(static_cast<const char*>(bytes), static_cast<std::size_t>(size));
}

std::string Statement::bytes() {
  std::string all;
  const auto put = [&all](char type, const void* bytes, std::size_t size) {
    const std::uint64_t length = size;
    all += type;
    all.append(reinterpret_cast<const char*>(&length), sizeof length);
    if (size > 0) all.append(static_cast<const char*>(bytes), size);
  };
  for (int column = 0; column < sqlite3_column_count(handle_); ++column) {
    if (sqlite3_column_type(handle_, column) == SQLITE_INTEGER) {
      const std::int64_t value = integer(column);
      put('i', &value, sizeof value);
    } else if (sqlite3_column_type(handle_, column) == SQLITE_FLOAT) {
      const double value = number(column);
      put('f', &value, sizeof value);
    } else {
      const std::string value = text(column);
      put(sqlite3_column_type(handle_, column) == SQLITE_TEXT ? 't' : 'b', value.data(),
          value.size());
    }
  }
  return all;
}

Transaction::Transaction(Database& database) : database_(database) {
  database_.execute("BEGIN IMMEDIATE");
}

Transaction::~Transaction() {
  if (!open_) return;
  // SQLite has rolled back by itself after most errors; then there is nothing left to roll back.
  sqlite3_exec(database_.handle_, "ROLLBACK", nullptr, nullptr, nullptr);
}

void Transaction::commit() {
  database_.execute("COMMIT");
  open_ = false;
}

}  // namespace cellcal::daemon
