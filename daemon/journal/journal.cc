#include "daemon/journal/journal.h"

#include <bit>
#include <cstring>
#include <functional>
#include <mutex>
#include <span>

#include "daemon/journal/schema.h"
#include "daemon/journal/sqlite.h"

namespace cellcal::daemon {

namespace {

static_assert(std::endian::native == std::endian::little, "blobs of doubles are little endian");

std::string blob(std::span<const double> values) {
  std::string bytes(values.size_bytes(), '\0');
  if (!values.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

std::vector<double> numbers(const std::string& bytes) {
  std::vector<double> values(bytes.size() / sizeof(double));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), values.size() * sizeof(double));
  return values;
}

std::span<const double> span_of(const drivers::AxisAngles& angles) {
  return {angles.data(), angles.size()};
}

const char* word_for(Ending ending) {
  switch (ending) {
    case Ending::kDone:
      return "done";
    case Ending::kAborted:
      return "aborted";
    case Ending::kFailed:
      return "failed";
  }
  return "failed";
}

/// Settings before anything is written; refuses what is not a journal of this version.
void prepare(Database& database) {
  // The journal belongs to one daemon; holding the lock is what refuses a second one.
  database.execute("PRAGMA busy_timeout = 1000; PRAGMA locking_mode = EXCLUSIVE");
  const std::int64_t tables = database.integer("SELECT count(*) FROM sqlite_schema");
  const std::int64_t application = database.integer("PRAGMA application_id");
  const std::int64_t version = database.integer("PRAGMA user_version");
  if (tables > 0 && application != kApplicationId) {
    throw JournalError("journal " + database.name() +
                       ": this is the database of another program; name another state directory");
  }
  if (version > kSchemaVersion) {
    throw JournalError("journal " + database.name() + ": written by a newer cellcald (schema " +
                       std::to_string(version) + ", this one knows " +
                       std::to_string(kSchemaVersion) + "); install that version again");
  }
  const std::string mode = database.text("PRAGMA journal_mode = WAL");
  if (mode != "wal") {
    throw JournalError("journal " + database.name() + ": no write-ahead log on this file system (" +
                       mode + "); put the state directory on a local disk");
  }
  database.execute("PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON");
  if (tables == 0) {
    Transaction transaction(database);
    database.execute(kSchema);
    database.execute(("PRAGMA application_id = " + std::to_string(kApplicationId)).c_str());
    database.execute(("PRAGMA user_version = " + std::to_string(kSchemaVersion)).c_str());
    transaction.commit();
  }
  const std::string check = database.text("PRAGMA quick_check(1)");
  if (check != "ok") {
    throw JournalError("journal " + database.name() + ": damaged (" + check +
                       "); move it aside (its -wal and -shm files too) and keep it, the daemon "
                       "begins a new one");
  }
}

constexpr const char* kSelectSession =
    "SELECT id, started, ended, state, cell_name, robot_name, plan_hash, planned, failure, options,"
    " (SELECT count(*) FROM touch WHERE touch.session = session.id), "
    "cell_text, robot_text, calibration FROM session ";

SessionRecord session_from(Statement& row, bool with_texts) {
  SessionRecord record;
  record.id = row.integer(0);
  record.started = row.text(1);
  record.ended = row.text(2);
  record.state = row.text(3);
  record.inputs.cell_name = row.text(4);
  record.inputs.robot_name = row.text(5);
  record.plan_hash = row.text(6);
  record.planned = static_cast<int>(row.integer(7));
  record.failure = row.text(8);
  record.inputs.options = row.text(9);
  record.touches = static_cast<int>(row.integer(10));
  if (!with_texts) return record;
  record.inputs.cell_text = row.text(11);
  record.inputs.robot_text = row.text(12);
  record.calibration = row.text(13);
  return record;
}

calib::Touch touch_from(Statement& row) {
  calib::Touch touch;
  touch.joint_rad = numbers(row.text(0));
  touch.target = row.text(1);
  touch.set = row.integer(2) != 0 ? calib::TouchSet::kCheck : calib::TouchSet::kFit;
  touch.sigma_m = row.number(3);
  touch.radius_m = row.number(4);
  const std::vector<double> tracker = numbers(row.text(5));
  for (std::size_t i = 0; i < 3 && i < tracker.size(); ++i) touch.tracker_m[i] = tracker[i];
  touch.time = row.text(6);
  touch.settled_joint_rad = numbers(row.text(7));
  touch.readings = static_cast<int>(row.integer(8));
  touch.spread_m = row.number(9);
  touch.speed_m_s = row.number(10);
  return touch;
}

}  // namespace

struct Journal::Impl {
  explicit Impl(const std::filesystem::path& path) : database(path) {}

  struct Note {
    std::int64_t session;
    std::string utc, words;
  };

  /// One transaction: the notes that wait, then what `act` writes.
  void write(const std::function<void()>& act) {
    const std::lock_guard lock(mutex);
    Transaction transaction(database);
    for (const Note& one : notes) {
      Statement insert(database, "INSERT INTO event (session, time, words) VALUES (?,?,?)");
      insert.bind(1, one.session).bind(2, std::string_view(one.utc));
      insert.bind(3, std::string_view(one.words)).step();
    }
    act();
    transaction.commit();
    notes.clear();
  }

  void set_state(std::int64_t session, std::string_view state, std::string_view ended,
                 std::string_view failure) {
    Statement update(database, "UPDATE session SET state=?, ended=?, failure=? WHERE id=?");
    update.bind(1, state).bind(2, ended).bind(3, failure).bind(4, session).step();
  }

  std::mutex mutex;
  Database database;
  std::vector<Note> notes;
};

Journal::Journal(const std::filesystem::path& path) : impl_(std::make_unique<Impl>(path)) {
  prepare(impl_->database);
  impl_->write([&] {
    impl_->database.execute("UPDATE session SET state='interrupted' WHERE state='running'");
  });
}

Journal::~Journal() = default;

std::int64_t Journal::begin(const SessionInputs& inputs, const std::string& utc) {
  std::int64_t id = 0;
  impl_->write([&] {
    Statement insert(impl_->database,
                     "INSERT INTO session (started, state, cell_name, cell_text, robot_name, "
                     "robot_text, options) VALUES (?,'running',?,?,?,?,?)");
    insert.bind(1, std::string_view(utc)).bind(2, std::string_view(inputs.cell_name));
    insert.bind(3, std::string_view(inputs.cell_text));
    insert.bind(4, std::string_view(inputs.robot_name));
    insert.bind(5, std::string_view(inputs.robot_text));
    insert.bind(6, std::string_view(inputs.options)).step();
    id = impl_->database.last_row_id();
  });
  return id;
}

void Journal::resume(std::int64_t session, const std::string& utc) {
  impl_->write([&] { impl_->set_state(session, "running", "", ""); });
  note(session, utc, "resumed");
}

void Journal::record(std::int64_t session, const RecordPlan& plan) {
  impl_->write([&] {
    Statement update(impl_->database, "UPDATE session SET plan_hash=?, planned=? WHERE id=?");
    update.bind(1, std::string_view(plan.hash));
    update.bind(2, static_cast<std::int64_t>(plan.touches)).bind(3, session).step();
  });
}

void Journal::record(std::int64_t session, const RecordReading& record) {
  const Reading& reading = record.reading;
  impl_->write([&] {
    Statement insert(impl_->database,
                     "INSERT INTO reading (session, touch, number, slow, contact_rad, settled_rad, "
                     "along_m, time_sigma_s, reaction_s, bounces, time) "
                     "VALUES (?,?,?,?,?,?,?,?,?,?,?)");
    insert.bind(1, session).bind(2, static_cast<std::int64_t>(record.touch));
    insert.bind(3, static_cast<std::int64_t>(record.number));
    insert.bind(4, static_cast<std::int64_t>(reading.slow ? 1 : 0));
    insert.bind_blob(5, blob(span_of(reading.contact_rad)));
    insert.bind_blob(6, blob(span_of(reading.settled_rad)));
    insert.bind(7, reading.along_m).bind(8, reading.time_sigma_s).bind(9, reading.reaction_s);
    insert.bind(10, static_cast<std::int64_t>(reading.bounces));
    insert.bind(11, std::string_view(reading.utc)).step();
  });
}

void Journal::record(std::int64_t session, const RecordTouch& record) {
  const calib::Touch& touch = record.touch;
  impl_->write([&] {
    Statement insert(impl_->database,
                     "INSERT INTO touch (session, number, joint_rad, target, held_out, sigma_m, "
                     "radius_m, tracker_m, time, settled_rad, readings, spread_m, speed_m_s) "
                     "VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?)");
    insert.bind(1, session).bind(2, static_cast<std::int64_t>(record.index));
    insert.bind_blob(3, blob(touch.joint_rad)).bind(4, std::string_view(touch.target));
    insert.bind(5, static_cast<std::int64_t>(touch.set == calib::TouchSet::kCheck ? 1 : 0));
    insert.bind(6, touch.sigma_m).bind(7, touch.radius_m);
    insert.bind_blob(8, blob(touch.tracker_m)).bind(9, std::string_view(touch.time));
    insert.bind_blob(10, blob(touch.settled_joint_rad));
    insert.bind(11, static_cast<std::int64_t>(touch.readings));
    insert.bind(12, touch.spread_m).bind(13, touch.speed_m_s).step();
  });
}

void Journal::record(std::int64_t session, const RecordEnd& end, const std::string& utc) {
  impl_->write([&] { impl_->set_state(session, word_for(end.ending), utc, end.failure); });
}

void Journal::store_calibration(std::int64_t session, const std::string& json) {
  impl_->write([&] {
    Statement update(impl_->database, "UPDATE session SET calibration=? WHERE id=?");
    update.bind(1, std::string_view(json)).bind(2, session).step();
  });
}

void Journal::note(std::int64_t session, const std::string& utc, const std::string& words) {
  const std::lock_guard lock(impl_->mutex);
  impl_->notes.push_back({session, utc, words});
}

std::vector<SessionRecord> Journal::sessions() {
  const std::lock_guard lock(impl_->mutex);
  Statement select(impl_->database, (std::string(kSelectSession) + "ORDER BY id DESC").c_str());
  std::vector<SessionRecord> records;
  while (select.step()) records.push_back(session_from(select, false));
  return records;
}

std::optional<SessionRecord> Journal::session(std::int64_t id) {
  const std::lock_guard lock(impl_->mutex);
  Statement select(impl_->database, (std::string(kSelectSession) + "WHERE id=?").c_str());
  select.bind(1, id);
  if (!select.step()) return std::nullopt;
  return session_from(select, true);
}

std::optional<SessionRecord> Journal::newest_resumable() {
  const std::vector<SessionRecord> all = sessions();
  // Only the newest session: behind an older one the cell may have been moved or mended since.
  if (all.empty() || !all.front().resumable()) return std::nullopt;
  return session(all.front().id);
}

std::vector<calib::Touch> Journal::touches(std::int64_t session) {
  const std::lock_guard lock(impl_->mutex);
  Statement select(impl_->database,
                   "SELECT joint_rad, target, held_out, sigma_m, radius_m, tracker_m, time, "
                   "settled_rad, readings, spread_m, speed_m_s FROM touch WHERE session=? "
                   "ORDER BY number");
  select.bind(1, session);
  std::vector<calib::Touch> touches;
  while (select.step()) touches.push_back(touch_from(select));
  return touches;
}

std::vector<std::string> Journal::events(std::int64_t session) {
  const std::lock_guard lock(impl_->mutex);
  Statement select(impl_->database,
                   "SELECT time || ' ' || words FROM event WHERE session=? ORDER BY rowid");
  select.bind(1, session);
  std::vector<std::string> events;
  while (select.step()) events.push_back(select.text(0));
  for (const auto& waiting : impl_->notes) {
    if (waiting.session == session) events.push_back(waiting.utc + " " + waiting.words);
  }
  return events;
}

int Journal::reading_count(std::int64_t session) {
  const std::lock_guard lock(impl_->mutex);
  Statement select(impl_->database, "SELECT count(*) FROM reading WHERE session=?");
  select.bind(1, session);
  return select.step() ? static_cast<int>(select.integer(0)) : 0;
}

std::vector<FastAndSlow> Journal::contacts(std::int64_t session) {
  const std::lock_guard lock(impl_->mutex);
  // A touch that was begun anew (after a retry, by a resumed session) counts from its last fast
  // contact on.
  Statement select(impl_->database,
                   "SELECT touch, slow, along_m FROM reading WHERE session=?1 AND touch IN "
                   "(SELECT number FROM touch WHERE session=?1) ORDER BY touch, rowid");
  select.bind(1, session);
  struct Sum {
    std::optional<double> fast_m;
    double slow_m = 0.0;
    int slow = 0;
  } sum;
  std::vector<FastAndSlow> contacts;
  const auto finish = [&] {
    if (sum.fast_m && sum.slow > 0) contacts.push_back({*sum.fast_m, sum.slow_m / sum.slow});
    sum = {};
  };
  std::int64_t touch = -1;
  while (select.step()) {
    if (select.integer(0) != touch) finish();
    touch = select.integer(0);
    if (select.integer(1) == 0) {
      sum = {select.number(2), 0.0, 0};
    } else {
      sum.slow_m += select.number(2);
      ++sum.slow;
    }
  }
  finish();
  return contacts;
}

}  // namespace cellcal::daemon
