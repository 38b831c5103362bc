// Rows of sessions, as records: one, the newest, lists.

#include <limits>

#include "calib/model/long_work.h"
#include "daemon/journal/journal_impl.h"

namespace cellcal::daemon {

namespace {

constexpr std::int64_t kNewest = std::numeric_limits<std::int64_t>::max();

constexpr const char* kSelectSession =
    "SELECT id, started, ended, state, cell_name, robot_name, plan_hash, planned, failure, options,"
    " (SELECT count(*) FROM touch WHERE touch.session = session.id), software, origin, "
    "cell_text, robot_text, calibration, "
    "(SELECT max(time) FROM dropped WHERE dropped.session = session.id), outcome, "
    "calibration <> '' FROM session ";

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
  record.outcome = row.text(17);
  record.has_calibration = row.integer(18) != 0;
  if (!with_texts) return record;
  record.inputs.cell_text = row.text(13);
  record.inputs.robot_text = row.text(14);
  record.calibration = row.text(15);
  return record;
}

}  // namespace

std::optional<SessionRecord> Journal::Impl::as_stored(std::int64_t session, bool with_texts) {
  Statement select(database, (std::string(kSelectSession) + "WHERE id=?").c_str());
  select.bind(1, session);
  if (!select.step()) return std::nullopt;
  return session_from(select, with_texts);
}

void Journal::Impl::judge(SessionRecord& record) {
  if (record.state == RecordState::kRunning && record.id != running)
    record.state = RecordState::kInterrupted;
  if (!chain.is_whole(record.id)) record.state = RecordState::kDamaged;
}

std::vector<SessionRecord> Journal::sessions() {
  const std::lock_guard lock(impl_->mutex);
  return impl_->sessions();
}

std::vector<SessionRecord> Journal::sessions(std::int64_t before, std::size_t most) {
  const std::lock_guard lock(impl_->mutex);
  std::vector<SessionRecord> records;
  if (most == 0) return records;
  impl_->look_for(before, [&](SessionRecord record) {
    records.push_back(std::move(record));
    return records.size() == most;
  });
  return records;
}

std::vector<SessionRecord> Journal::Impl::sessions() {
  std::vector<SessionRecord> records;
  look_for(kNewest, [&](SessionRecord record) {
    records.push_back(std::move(record));
    return false;
  });
  return records;
}

void Journal::Impl::look_for(std::int64_t before, const std::function<bool(SessionRecord)>& visit) {
  Statement select(database, (std::string(kSelectSession) + "WHERE id<? ORDER BY id DESC").c_str());
  select.bind(1, before);
  std::int64_t next = std::min(chain.newest_session(), before - 1);
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

std::optional<SessionRecord> Journal::Impl::newest_own() {
  std::optional<SessionRecord> newest;
  look_for(kNewest, [&](SessionRecord record) {
    if (record.origin) return false;
    newest = std::move(record);
    return true;
  });
  return newest;
}

std::optional<bool> Journal::was_published(std::int64_t session) {
  const std::lock_guard lock(impl_->mutex);
  Statement select(impl_->database,
                   "SELECT CASE WHEN state='done' AND json_valid(calibration)"
                   " THEN json_extract(calibration, '$.verdict.publish') END"
                   " FROM session WHERE id=?");
  select.bind(1, session);
  if (!select.step() || select.is_null(0)) return std::nullopt;
  return select.integer(0) != 0;
}

bool Journal::may_be_published(std::int64_t session) {
  if (const auto stated = was_published(session)) return *stated;
  const std::lock_guard lock(impl_->mutex);
  if (impl_->chain.is_whole(session)) return false;  // it says what it always said: none
  Statement select(impl_->database,
                   "SELECT origin IS NULL AND calibration<>'' FROM session WHERE id=?");
  return !select.bind(1, session).step() || select.integer(0) != 0;
}

std::optional<SessionRecord> Journal::session(std::int64_t id) {
  const std::lock_guard lock(impl_->mutex);
  impl_->chain.verify(id);
  std::optional<SessionRecord> record = impl_->as_stored(id, true);
  if (record) impl_->judge(*record);
  return record;
}

std::optional<SessionRecord> Journal::newest_own() {
  const std::lock_guard lock(impl_->mutex);
  return impl_->newest_own();
}

std::optional<SessionRecord> Journal::newest_resumable() {
  // Only the newest session: behind an older one the cell may have been moved or mended since. What
  // was imported happened elsewhere.
  const std::optional<SessionRecord> newest = newest_own();
  if (!newest || !newest->resumable()) return std::nullopt;
  return session(newest->id);
}

}  // namespace cellcal::daemon
