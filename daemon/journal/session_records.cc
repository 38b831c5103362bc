// Session records: single ones, the newest, lists.

#include <cstring>
#include <limits>

#include "calib/files/input_file.h"
#include "calib/model/long_work.h"
#include "daemon/journal/journal.h"
#include "daemon/journal/prepare.h"
#include "daemon/result/outcome_json.h"

namespace cellcal::daemon {

namespace {

constexpr std::int64_t kNewest = std::numeric_limits<std::int64_t>::max();

constexpr const char* kSelectSession =
    "SELECT id, started, ended, state, cell_name, robot_name, plan_hash, planned, failure, options,"
    " (SELECT count(*) FROM touch WHERE touch.session = session.id), software, origin, "
    "cell_text, robot_text, calibration, "
    "(SELECT max(time) FROM dropped WHERE dropped.session = session.id), outcome, "
    "calibration <> '', document, CASE WHEN state IN ('failed', 'aborted') THEN document END FROM session ";

SessionRecord session_from(Statement& row, bool with_texts) {
  SessionRecord record;
  record.id = row.integer(0);
  record.started = row.text(1);
  record.ended = row.text(2);
  record.state = record_state_of(row.text(3));
  record.inputs.cell_name = row.text(4);
  record.inputs.robot_name = row.text(5);
  record.plan_hash = row.text(6);
  record.planned = static_cast<int>(row.integer(7));
  record.failure = row.text(8);
  record.inputs.options = row.text(9);
  record.touches = static_cast<int>(row.integer(10));
  record.software = row.text(11);
  if (!row.is_null(12)) record.origin = origin_of(row.text(12));
  record.dropped = row.text(16);
  record.outcome = outcome_from_json(row.text(17));
  record.has_calibration = row.integer(18) != 0;
  if (!row.is_null(20)) record.failure_said = failure_said_in(row.text(20));
  if (!with_texts) return record;
  record.inputs.cell_text = row.text(13);
  record.inputs.robot_text = row.text(14);
  record.calibration = row.text(15);
  if (row.is_null(20)) record.document = row.text(19);
  return record;
}

Blob blob_of(const std::vector<calib::JointVector>& postures) {
  Blob blob;
  for (const calib::JointVector& posture : postures)
    blob.bytes.append(reinterpret_cast<const char*>(posture.data()),
                      posture.size() * sizeof(double));
  return blob;
}

std::vector<calib::JointVector> postures(const std::string& bytes, std::int64_t axes) {
  const auto size = static_cast<std::size_t>(axes) * sizeof(double);
  if (axes < 0 || (size == 0 ? !bytes.empty() : bytes.size() % size != 0))
    throw DamagedError(std::to_string(bytes.size()) +
                       " bytes where the journal has postures: not as it was written");
  std::vector<calib::JointVector> all(size == 0 ? 0 : bytes.size() / size,
                                      calib::JointVector(static_cast<std::size_t>(axes)));
  for (std::size_t k = 0; k < all.size(); ++k)
    std::memcpy(all[k].data(), bytes.data() + k * size, size);
  return all;
}

}  // namespace

std::string SessionRecord::failure_words(const calib::Language& language) const {
  return failure_said.empty() ? failure : calib::words(failure_said, language);
}

RecordState record_state_of(std::string_view text) {
  return by_own_name<RecordState>(text).value_or(RecordState::kDamaged);
}

std::optional<SessionRecord> Journal::as_stored(std::int64_t session, bool with_texts) {
  Statement select(database_, (std::string(kSelectSession) + "WHERE id=?").c_str());
  if (!select.bind(1, session).step()) return std::nullopt;
  return session_from(select, with_texts);
}

void Journal::judge(SessionRecord& record) {
  if (record.state == RecordState::kRunning && record.id != running_)
    record.state = RecordState::kInterrupted;
  if (!chain_.is_whole(record.id)) record.state = RecordState::kDamaged;
}

std::vector<SessionRecord> Journal::sessions() {
  return sessions(kNewest, std::numeric_limits<std::size_t>::max());
}

std::vector<SessionRecord> Journal::sessions(std::int64_t before, std::size_t most) {
  const std::lock_guard lock(mutex_);
  std::vector<SessionRecord> records;
  if (most == 0) return records;
  visit_sessions(before, [&](SessionRecord record) {
    records.push_back(std::move(record));
    return records.size() == most;
  });
  return records;
}

void Journal::visit_sessions(std::int64_t before, const std::function<bool(SessionRecord)>& visit) {
  Statement select(database_, (std::string(kSelectSession) + "WHERE id<? ORDER BY id DESC").c_str(),
                   before);
  std::int64_t next = std::min(chain_.newest_session(), before - 1);
  const auto is_among_missing_down_to = [&](std::int64_t id) {
    for (; next > id; --next) {
      SessionRecord missing;
      missing.id = next;
      missing.state = RecordState::kDamaged;
      if (visit(std::move(missing))) return true;
    }
    return false;
  };
  while (select.step()) {
    calib::poll_cancelled();
    SessionRecord record = session_from(select, false);
    if (is_among_missing_down_to(record.id)) return;
    judge(record);
    if (visit(std::move(record))) return;
    --next;
  }
  is_among_missing_down_to(0);
}

std::optional<SessionRecord> Journal::newest_own() {
  const std::lock_guard lock(mutex_);
  std::optional<SessionRecord> newest;
  visit_sessions(kNewest, [&](SessionRecord record) {
    if (record.origin) return false;
    newest = std::move(record);
    return true;
  });
  return newest;
}

std::optional<bool> Journal::was_published(std::int64_t session) {
  const std::lock_guard lock(mutex_);
  const auto record = as_stored(session, false);
  if (!record || record->state != RecordState::kDone || !record->outcome) return std::nullopt;
  return published(*record->outcome);
}

bool Journal::may_be_published(std::int64_t session) {
  if (const auto stated = was_published(session)) return *stated;
  const std::lock_guard lock(mutex_);
  if (chain_.is_whole(session)) return false;  // certainly no published calibration
  Statement select(database_, "SELECT origin IS NULL AND calibration<>'' FROM session WHERE id=?");
  return !select.bind(1, session).step() || select.integer(0) != 0;
}

std::optional<SessionRecord> Journal::session(std::int64_t id) {
  if (id < 1) return std::nullopt;  // the chain's 0 is the journal itself
  const std::lock_guard lock(mutex_);
  chain_.verify(id);
  std::optional<SessionRecord> record = as_stored(id, true);
  if (record) judge(*record);
  return record;
}

std::optional<SessionRecord> Journal::newest_resumable() {
  // Only the newest session: the cell may have been changed since an older one. Imported sessions
  // belong to another cell.
  const std::optional<SessionRecord> newest = newest_own();
  if (!newest || !newest->resumable()) return std::nullopt;
  return session(newest->id);
}

// Searches for spheres, recorded before the motion, for a session that starts where one was
// interrupted.

void Journal::record(std::int64_t session, const RecordSearch& record, const std::string& utc) {
  const calib::SearchUnderWay& search = *record.search;
  write([&] {
    chain_.insert(session, "search", utc, search.target,
                  search.way.empty() ? 0 : search.way.front().size(), blob_of(search.way),
                  blob_of({search.end}), blob_of(search.out));
  });
}

std::optional<LeftSearch> Journal::search_left() {
  const std::lock_guard lock(mutex_);
  Statement select(
      database_,
      "SELECT search.session, target, axes, way_rad, end_rad, out_rad FROM search "
      "JOIN session ON session.id=search.session WHERE origin IS NULL "
      "AND NOT EXISTS (SELECT 1 FROM touch JOIN session AS later ON later.id=touch.session "
      "WHERE later.id > search.session AND later.origin IS NULL) "
      "ORDER BY search.rowid DESC LIMIT 1");
  if (!select.step()) return std::nullopt;
  LeftSearch left{select.integer(0), {}};
  chain_.verify(left.session);
  left.search.target = select.text(1);
  left.search.way = postures(select.text(3), select.integer(2));
  const auto end = postures(select.text(4), select.integer(2));
  if (!end.empty()) left.search.end = end.front();
  left.search.out = postures(select.text(5), select.integer(2));
  return left;
}

// Activations (append-only rows) and state of the schedule (one row).

void Journal::activate(const Activation& activation) {
  write([&] {
    chain_.insert(activation.session, "activation", activation.time, activation.who,
                  activation.reason);
    report(activation);
  });
}

std::vector<Activation> Journal::activations() {
  const std::lock_guard lock(mutex_);
  Statement select(
      database_,
      "SELECT activation.session, activation.time, who, reason, chain.number, activation.rowid "
      "FROM activation JOIN chain ON chain.kind='activation' AND chain.session=activation.session "
      "AND chain.row=activation.rowid ORDER BY chain.number");
  std::vector<Activation> activations;
  while (select.step()) {
    if (!chain_.is_whole(select.integer(0), "activation", select.integer(5))) continue;
    activations.push_back(
        {select.integer(0), select.text(1), select.text(2), select.text(3), select.integer(4)});
  }
  return activations;
}

void Journal::store_schedule(const std::string& state) {
  write([&] {
    database_.run("INSERT OR REPLACE INTO schedule (id, state, sum) VALUES (1,?,?)", state,
                  calib::sha256(state));
  });
}

StoredSchedule Journal::schedule() {
  const std::lock_guard lock(mutex_);
  Statement select(database_, "SELECT state, sum FROM schedule");
  if (!select.step()) return {};
  StoredSchedule stored{select.text(0)};
  const std::string sum = calib::sha256(stored.state);
  stored.newest = select.text(1) == sum;
  if (!stored.newest && select.text(1) != kOlderSchedule + sum)
    throw DamagedError(
        "the journal's row of the schedule is altered: what was begun or held is not known");
  return stored;
}

std::int64_t Journal::last_entry(std::int64_t session) {
  const std::lock_guard lock(mutex_);
  return chain_.last_entry(session);
}

}  // namespace cellcal::daemon
