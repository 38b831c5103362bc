#include "daemon/journal/store/sqlite.h"

#include <sqlite3.h>

#include <cerrno>

namespace cellcal::daemon {

namespace {

const char* advice(int code) {
  switch (code & 0xff) {
    case SQLITE_FULL: return "the disk is full. Make room (what was recorded before is safe)";
    case SQLITE_IOERR: return "the disk reports errors. Check it";
    case SQLITE_READONLY:
    case SQLITE_PERM:
    case SQLITE_CANTOPEN:
      return "check that the directory exists and that the daemon may write there: the service "
             "writes to /var/lib/cellcal alone";
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      return "the file is damaged or no journal. Move it aside with its -wal and -shm files and "
             "keep it; the daemon begins a new one";
    case SQLITE_BUSY:
    case SQLITE_LOCKED: return "used by another program. Check whether a second cellcald runs";
    default: return "see the message";
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
  const bool no_room = full(code);
  const std::string words = "journal " + name_ + ": " + sqlite3_errmsg(handle_) + "; " +
                            advice(no_room ? SQLITE_FULL : code);
  if (no_room) throw DiskFullError(words);
  throw JournalError(words);
}

/// True for a full disk. SQLite reports quota and file size limits as "I/O error", without the
/// errno.
bool Database::full(int code) {
  return (code & 0xff) == SQLITE_FULL ||
         (code == SQLITE_IOERR_WRITE && (errno == ENOSPC || errno == EDQUOT || errno == EFBIG));
}

void Database::move_log_into_file() {
  sqlite3_wal_checkpoint_v2(handle_, nullptr, SQLITE_CHECKPOINT_PASSIVE, nullptr, nullptr);
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

bool Statement::is_null(int column) { return sqlite3_column_type(handle_, column) == SQLITE_NULL; }

Value Statement::value(int column) {
  switch (sqlite3_column_type(handle_, column)) {
    case SQLITE_INTEGER: return integer(column);
    case SQLITE_FLOAT: return number(column);
    case SQLITE_TEXT: return text(column);
    case SQLITE_BLOB: return Blob{text(column)};
    default: return {};
  }
}

std::vector<Value> Statement::values() {
  std::vector<Value> all;
  for (int column = 0; column < sqlite3_column_count(handle_); ++column)
    all.push_back(value(column));
  return all;
}

std::vector<std::string> Statement::column_names() {
  std::vector<std::string> names;
  for (int column = 0; column < sqlite3_column_count(handle_); ++column)
    names.emplace_back(sqlite3_column_name(handle_, column));
  return names;
}

Statement& Statement::bind(int index, const Value& value) {
  if (const auto* number = std::get_if<std::int64_t>(&value)) return bind(index, *number);
  if (const auto* number = std::get_if<double>(&value)) return bind(index, *number);
  if (const auto* text = std::get_if<std::string>(&value))
    return bind(index, std::string_view(*text));
  if (const auto* blob = std::get_if<Blob>(&value)) return bind_blob(index, blob->bytes);
  check(sqlite3_bind_null(handle_, index));
  return *this;
}

std::string bytes_of(std::span<const Value> values) {
  std::string all;
  const auto put = [&all](char type, const void* bytes, std::size_t size) {
    const std::uint64_t length = size;
    all += type;
    all.append(reinterpret_cast<const char*>(&length), sizeof length);
    if (size > 0) all.append(static_cast<const char*>(bytes), size);
  };
  for (const Value& value : values) {
    if (const auto* whole = std::get_if<std::int64_t>(&value)) {
      put('i', whole, sizeof *whole);
    } else if (const auto* number = std::get_if<double>(&value)) {
      put('f', number, sizeof *number);
    } else if (const auto* text = std::get_if<std::string>(&value)) {
      put('t', text->data(), text->size());
    } else if (const auto* blob = std::get_if<Blob>(&value)) {
      put('b', blob->bytes.data(), blob->bytes.size());
    } else {
      put('n', nullptr, 0);
    }
  }
  return all;
}

PageCopy::PageCopy(Database& from, Database& to)
    : to_(to), handle_(sqlite3_backup_init(to.handle_, "main", from.handle_, "main")) {
  if (handle_ == nullptr) to_.fail(sqlite3_extended_errcode(to_.handle_));
}

PageCopy::~PageCopy() { sqlite3_backup_finish(handle_); }

bool PageCopy::step(int pages) {
  const int code = sqlite3_backup_step(handle_, pages);
  if (code == SQLITE_OK) return true;
  if (code == SQLITE_DONE) return false;
  // The connection does not have the error yet.
  throw JournalError("journal " + to_.name() + ": " + sqlite3_errstr(code) + "; " + advice(code));
}

Transaction::Transaction(Database& database) : database_(database) {
  database_.execute("BEGIN IMMEDIATE");
}

Transaction::~Transaction() {
  if (!open_) return;
  // SQLite has rolled back already after most errors; the statement then has no effect.
  sqlite3_exec(database_.handle_, "ROLLBACK", nullptr, nullptr, nullptr);
}

void Transaction::commit() {
  database_.execute("COMMIT");
  open_ = false;
}

}  // namespace cellcal::daemon
