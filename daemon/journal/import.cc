// Import of the rows of another journal's session.

#include <fcntl.h>
#include <fmt/format.h>
#include <stdio.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>
#include <thread>
#include <vector>

#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "daemon/journal/chain.h"
#include "daemon/journal/journal.h"
#include "daemon/journal/outbox_rows.h"
#include "daemon/journal/rows.h"
#include "daemon/journal/store/sqlite.h"

namespace cellcal::daemon {

namespace {

// A whole copy of a journal's database under another name. It has that name when it is whole, on
// disk and looked through, and not before.

class DatabaseCopy {
 public:
  /// Begins it as `to`.part. Throws JournalError where `to` is there already.
  DatabaseCopy(Database& from, std::filesystem::path to);
  /// Removes the part file unless it was published.
  ~DatabaseCopy();
  DatabaseCopy(const DatabaseCopy&) = delete;
  DatabaseCopy& operator=(const DatabaseCopy&) = delete;

  /// As PageCopy::step().
  bool step(int pages) { return pages_->step(pages); }
  /// Gives the copy a new outbox source, because the original journal continues to report under its own, whether or not
  /// the copy is opened with a head file.
  void speak_as_another();
  /// Reads all of it. Throws JournalError where its pages contradict each other, or it does not end
  /// with this entry. Returns the sessions that are damaged in it, as they are in the journal.
  std::vector<std::int64_t> verify(const Head& end);
  /// Gives it its name. Throws JournalError where a file has it by now.
  void publish();

 private:
  std::filesystem::path to_, part_;
  std::unique_ptr<Database> database_;
  std::unique_ptr<PageCopy> pages_;
};

std::filesystem::path part_of(std::filesystem::path path) { return path += ".part"; }

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& words) {
  throw JournalError("copy " + file.string() + ": " + words);
}

void refuse_existing(const std::filesystem::path& file) {
  std::error_code code;
  if (std::filesystem::exists(std::filesystem::symlink_status(file, code)))
    fail(file, "there is a file of this name already. Name another, or remove it");
}

void sync(const std::filesystem::path& path, int flags) {
  const int descriptor = ::open(path.c_str(), flags | O_CLOEXEC);
  const bool synced = descriptor >= 0 && ::fsync(descriptor) == 0;
  const int code = errno;
  if (descriptor >= 0) ::close(descriptor);
  if (!synced) fail(path, std::string("cannot be written to disk (") + std::strerror(code) + ")");
}

void remove_with_logs(const std::filesystem::path& part) {
  for (const char* suffix : {"", "-wal", "-shm", "-journal"}) {
    std::error_code ignored;  // the first error is reported
    std::filesystem::remove(part.string() + suffix, ignored);
  }
}

DatabaseCopy::DatabaseCopy(Database& from, std::filesystem::path to)
    : to_(std::move(to)), part_(part_of(to_)) {
  refuse_existing(to_);
  remove_with_logs(part_);  // of one that was killed
  database_ = std::make_unique<Database>(part_);
  try {
    // It is synchronized once, when it is whole.
    database_->execute("PRAGMA synchronous = OFF; PRAGMA journal_mode = MEMORY");
    pages_ = std::make_unique<PageCopy>(from, *database_);
  } catch (...) {
    remove_with_logs(part_);
    throw;
  }
}

DatabaseCopy::~DatabaseCopy() {
  pages_.reset();
  if (!database_) return;
  database_.reset();
  remove_with_logs(part_);
}

std::vector<std::int64_t> DatabaseCopy::verify(const Head& end) {
  pages_.reset();
  // A single file that can be read without its log.
  database_->execute("PRAGMA locking_mode = EXCLUSIVE; PRAGMA journal_mode = DELETE");
  if (const std::string found = database_->text("PRAGMA quick_check(1)"); found != "ok")
    fail(to_, "damaged while it was written (" + found + "). Check the disk");
  if (end.entries == 0) return {};
  const Head copied = walk_chain(*database_).end;
  if (copied.entries != end.entries || copied.sum != end.sum)
    fail(to_, "does not end where the journal does. Check the disk");
  return damaged_sessions(*database_);
}

void DatabaseCopy::speak_as_another() {
  pages_.reset();
  Transaction transaction(*database_);
  begin_source(*database_);
  transaction.commit();
}

void DatabaseCopy::publish() {
  database_->execute("PRAGMA locking_mode = NORMAL");
  database_.reset();
  const auto give_up = [&](const std::string& words) {
    remove_with_logs(part_);
    fail(to_, words);
  };
  sync(part_, O_RDONLY);
  if (::renameat2(AT_FDCWD, part_.c_str(), AT_FDCWD, to_.c_str(), RENAME_NOREPLACE) != 0) {
    if (errno == EEXIST) give_up("there is a file of this name already. Name another");
    if (errno != EINVAL) give_up(std::string("cannot get its name (") + std::strerror(errno) + ")");
    refuse_existing(to_);  // this file system cannot do both at once
    std::filesystem::rename(part_, to_);
  }
  const std::filesystem::path parent = to_.parent_path();
  sync(parent.empty() ? "." : parent, O_RDONLY | O_DIRECTORY);
}

std::vector<std::string> columns_of(Database& database, const std::string& table) {
  return Statement(database, ("SELECT * FROM " + table).c_str()).column_names();
}

/// Inserts the rows of one session under a new number.
class Import {
 public:
  Import(Database& database, Chain& chain, const SessionRows& rows, const std::string& origin,
         const std::string& from)
      : database_(database), chain_(chain), rows_(rows), origin_(origin), from_(from) {}

  std::int64_t run() {
    const auto session = std::find_if(
        rows_.entries.begin(), rows_.entries.end(),
        [](const RowEntry& entry) { return entry.table == "session" && !entry.names.empty(); });
    if (session == rows_.entries.end()) refuse("the session's own row is missing");
    insert(*session);
    id_ = database_.last_row_id();
    chain_.add(id_, "session", id_);
    for (const RowEntry& entry : rows_.entries) {
      if (entry.names.empty() || &entry == &*session) continue;
      if (entry.table == "session") refuse("it holds more than one session");
      insert(entry);
      chain_.add(id_, entry.table.c_str(), database_.last_row_id());
    }
    return id_;
  }

 private:
  [[noreturn]] void refuse(const std::string& why) const {
    throw JournalError(from_ + ": " + why + ": damaged or altered. Export the session again");
  }

  void insert(const RowEntry& entry) {
    if (std::find(std::begin(kChainedTables), std::end(kChainedTables), entry.table) ==
        std::end(kChainedTables))
      refuse("there is no table '" + entry.table + "'");
    const std::vector<std::string> known = columns_of(database_, entry.table);
    std::string names, places;
    // Rows of earlier versions lack the last columns.
    if (entry.names.size() > known.size() ||
        !std::equal(entry.names.begin(), entry.names.end(), known.begin()))
      refuse("the columns of table '" + entry.table + "' are not those of this version");
    for (const std::string& name : entry.names) {
      names += (names.empty() ? "" : ", ") + name;
      places += places.empty() ? "?" : ",?";
    }
    Statement insert(
        database_,
        fmt::format("INSERT INTO {} ({}) VALUES ({})", entry.table, names, places).c_str());
    for (std::size_t i = 0; i < entry.names.size(); ++i)
      insert.bind(static_cast<int>(i) + 1, value(entry, i));
    insert.step();
    if (entry.table == "session") mark();
  }

  /// Value as recorded, except for the session's number.
  Value value(const RowEntry& entry, std::size_t column) const {
    const std::string& name = entry.names[column];
    if (entry.table != "session") return name == "session" ? Value(id_) : entry.columns[column];
    return name == "id" ? Value() : entry.columns[column];
  }

  /// Sets the origin, and the state of a running session to interrupted.
  void mark() {
    const std::int64_t id = database_.last_row_id();
    Statement select(database_, "SELECT state FROM session WHERE id=?");
    select.bind(1, id).step();
    const std::string text = select.text(0);
    RecordState state = record_state_of(text);
    if (state == RecordState::kDamaged) refuse("there is no state '" + text + "'");
    if (state == RecordState::kRunning) state = RecordState::kInterrupted;
    Statement update(database_, "UPDATE session SET state=?, origin=? WHERE id=?");
    update.bind(1, std::string_view(to_string(state)))
        .bind(2, std::string_view(origin_))
        .bind(3, id)
        .step();
  }

  Database& database_;
  Chain& chain_;
  const SessionRows& rows_;
  const std::string& origin_;
  const std::string& from_;
  std::int64_t id_ = 0;
};

// Comparison of a session to be imported with the journal's own entries.
//
// Entries are append-only: of two exports of one session, one is a prefix of the other, or one of them was
// altered. The comparison covers the journal's own entries and, for a session imported earlier, their sum at
// that time.

/// Start time to the millisecond, which distinguishes sessions of the same number.
std::string started_of(const SessionRows& rows) {
  for (const RowEntry& entry : rows.entries) {
    if (entry.table != "session") continue;
    if (std::string started = text_of(entry, "started"); !started.empty()) return started;
  }
  return "";
}

bool has_entry(Database& database, const RowEntry& entry) {
  Statement find(database, "SELECT 1 FROM chain WHERE number=? AND sum=?");
  return find.bind(1, entry.number).bind(2, std::string_view(entry.sum)).step();
}

/// True for a session of this journal, even if the journal's name was forged: the entries remain.
bool is_own(Database& database, const std::string& name, const SessionRows& rows) {
  if (rows.entries.empty()) return false;
  if (rows.journal != name && !has_entry(database, rows.entries.front())) return false;
  Statement find(database, "SELECT 1 FROM session WHERE id=? AND started=? AND origin IS NULL");
  return find.bind(1, rows.session).bind(2, std::string_view(started_of(rows))).step();
}

void compare_with_own(Database& database, const SessionRows& rows, const std::string& from) {
  Statement own(database, "SELECT number, sum FROM chain WHERE session=? ORDER BY number");
  own.bind(1, rows.session);
  for (const RowEntry& entry : rows.entries) {
    if (!own.step()) return;  // continued elsewhere
    if (own.integer(0) == entry.number && own.text(1) == entry.sum) continue;
    throw JournalError(fmt::format(
        "{}: session {} was recorded by this journal, and entry {} is not the one that was "
        "recorded: rows were altered, left out or put in. Export the session again",
        from, rows.session, entry.number));
  }
}

void compare_with_other_import(Database& database, const SessionRows& rows,
                               const std::string& from) {
  Statement imported(database,
                     "SELECT id, origin FROM session WHERE origin IS NOT NULL AND started=?");
  const std::string started = started_of(rows);
  imported.bind(1, std::string_view(started));
  while (imported.step()) {
    const Origin known = origin_of(imported.text(1));
    if (known.journal != rows.journal || known.session != rows.session) continue;
    if (known.entries > rows.entries.size()) continue;  // an earlier export
    if (sum_of_entries(rows, known.entries) == known.entries_sum) continue;
    throw JournalError(fmt::format(
        "{}: session {} was imported from the same session of the same journal, and its rows are not "
        "the same: one of both was altered. Export the session again, and compare",
        from, imported.integer(0)));
  }
}

/// Throws JournalError naming `from` if they differ. `name`: name of the journal.
void compare_with_imported(Database& database, const std::string& name, const SessionRows& rows,
                           const std::string& from) {
  if (is_own(database, name, rows)) compare_with_own(database, rows, from);
  compare_with_other_import(database, rows, from);
}

/// A quarter of a megabyte: half a millisecond.
constexpr int kPagesAtOnce = 64;
/// For waiting calls, which would not get a lock that is taken again immediately.
constexpr std::chrono::milliseconds kPause{1};

}  // namespace

std::string Journal::name() {
  const std::lock_guard lock(mutex_);
  return chain_.name();
}

std::string Journal::rows(std::int64_t session) {
  if (!pending_.all().empty()) write([] {});
  const std::lock_guard lock(mutex_);
  chain_.verify(session);
  return to_lines(read_rows(database_, chain_.name(), session));
}

std::pair<std::int64_t, bool> Journal::import(const std::string& lines, const std::string& from,
                                              std::optional<std::size_t> stated_touches) {
  const SessionRows rows = parse_lines(lines, from);
  if (stated_touches && *stated_touches != touches_in(rows))
    throw JournalError(fmt::format(
        "{}: it holds {} of {} touches that the export states: damaged or altered. Export "
        "the session again",
        from, touches_in(rows), *stated_touches));
  refuse_impossible(rows, from);
  const std::string sum = calib::sha256(lines);
  const std::vector<SessionRecord> all = sessions();
  for (const SessionRecord& there : all)
    if (there.origin && there.origin->sum == sum) return {there.id, false};
  // A session of this journal, unchanged since its export.
  if (rows.journal == name() && session(rows.session) && this->rows(rows.session) == to_lines(rows))
    return {rows.session, false};
  const std::string origin = to_text({rows.journal, rows.session, sum, rows.entries.size(),
                                      sum_of_entries(rows, rows.entries.size())});
  std::int64_t id = 0;
  write([&] {
    compare_with_imported(database_, chain_.name(), rows, from);
    id = Import(database_, chain_, rows, origin, from).run();
  });
  return {id, true};
}

// Copy of the whole journal during operation.

std::vector<std::string> Journal::backup(const std::filesystem::path& file) {
  const std::lock_guard one(one_backup_);  // backups of one name would collide
  std::unique_lock lock(mutex_);
  DatabaseCopy copy(database_, file);
  Head end = chain_.end();
  while (copy.step(kPagesAtOnce)) {
    lock.unlock();
    std::this_thread::sleep_for(kPause);
    lock.lock();
    end = chain_.end();
  }
  lock.unlock();
  copy.speak_as_another();
  std::vector<std::string> remarks;
  for (const std::int64_t session : copy.verify(end)) {
    remarks.push_back(
        fmt::format("session {} is damaged in the journal, and so it is in the copy", session));
  }
  copy.publish();
  return remarks;
}

}  // namespace cellcal::daemon
