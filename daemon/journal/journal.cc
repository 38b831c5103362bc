#include "daemon/journal/journal.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <span>

#include "calib/files/calibration_json.h"
#include "calib/model/enum_table.h"
#include "daemon/journal/prepare.h"
#include "daemon/journal/rows.h"
#include "daemon/result/outcome_json.h"

namespace cellcal::daemon {

namespace {

static_assert(std::endian::native == std::endian::little, "blobs of doubles are little endian");

Blob blob(std::span<const double> values) {
  return {std::string(reinterpret_cast<const char*>(values.data()), values.size_bytes())};
}

/// Throws DamagedError unless the blob holds doubles.
std::vector<double> numbers(const std::string& bytes) {
  if (bytes.size() % sizeof(double) != 0)
    throw DamagedError(
        std::to_string(bytes.size()) +
        " bytes where the journal has angles: imported damaged. Do not use this session");
  std::vector<double> values(bytes.size() / sizeof(double));
  if (!values.empty()) std::memcpy(values.data(), bytes.data(), values.size() * sizeof(double));
  return values;
}

std::span<const double> span_of(const drivers::AxisAngles& angles) {
  return {angles.data(), angles.size()};
}

RecordState state_after(Ending ending) {
  using enum Ending;
  static constexpr EnumTable<Ending, RecordState> kTable{{{kDone, RecordState::kDone},
                                                          {kAborted, RecordState::kAborted},
                                                          {kFailed, RecordState::kFailed}}};
  return kTable[ending];
}

std::filesystem::path with(std::filesystem::path path, const char* suffix) {
  return path += suffix;
}

/// Replaces invalid UTF-8, which devices may send.
std::string as_utf8(const std::string& words) {
  using Json = nlohmann::json;
  if (is_utf8(words)) return words;
  return Json::parse(Json(words).dump(-1, ' ', false, Json::error_handler_t::replace));
}

/// Rejects NaN, which SQLite reads back as NULL.
double number_of(double value, const char* what) {
  if (std::isnan(value)) throw JournalError(std::string(what) + " of the touch is not a number");
  return value;
}

std::optional<std::array<double, 3>> three(Statement& row, int column) {
  const std::vector<double> values = numbers(row.text(column));
  if (values.size() != 3) return std::nullopt;
  return std::array{values[0], values[1], values[2]};
}

drivers::AxisAngles axes(const std::vector<double>& values) {
  drivers::AxisAngles result;
  if (values.size() > result.capacity())
    throw DamagedError(std::to_string(values.size()) +
                       " angles of an arm: imported damaged. Do not use this session");
  for (const double value : values) result.push_back(value);
  return result;
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
  touch.tool = row.text(11);
  touch.turn_sigma_rad = row.number(12);
  touch.tracker_abc_rad = three(row, 13);
  touch.approach = three(row, 14);
  if (!row.is_null(15)) touch.temperature_c = row.number(15);
  if (!row.is_null(16)) touch.load = row.text(16);
  if (!row.is_null(17)) touch.positioner_rad = numbers(row.text(17));
  return touch;
}

}  // namespace

std::vector<std::filesystem::path> Journal::file_names(const std::filesystem::path& path) {
  return {path, with(path, "-wal"), with(path, ".lock"), with(path, ".head")};
}

void Journal::write(const std::function<void()>& act) {
  const std::lock_guard guard(mutex_);
  files_.check();
  const std::vector<PendingRow> waiting = pending_.all();
  try {
    write_once([] {}, waiting, act);
  } catch (const DiskFullError&) {
    if (outbox_.count().telemetry_bytes == 0) throw;
    // A log that was moved into the file restarts, and dropped rows free space in the file.
    database_.move_log_into_file();
    write_once([&] { outbox_.drop_telemetry(); }, waiting, act);
  }
  pending_.written(waiting.size());
  outbox_.committed();
  chain_.committed();
  files_.check();
}

void Journal::write_once(const std::function<void()>& first, const std::vector<PendingRow>& waiting,
                         const std::function<void()>& act) {
  try {
    Transaction transaction(database_);
    first();
    for (const PendingRow& row : waiting) {
      insert(chain_, row);
      if (const auto* change = std::get_if<RecordChange>(&row.what))
        outbox_.put(row.session, change->utc,
                    [&](const Reporter& to) { return to.change(*change); });
      if (const auto* touch = std::get_if<AssessedTouch>(&row.what))
        outbox_.assess(row.session, *touch);
      if (const auto* end = std::get_if<SessionEnd>(&row.what)) write_end(row.session, *end);
    }
    act();
    transaction.commit();
  } catch (...) {
    chain_.rolled_back();
    outbox_.rolled_back();
    throw;
  }
}

void Journal::report_session(std::int64_t session, const std::string& utc,
                             std::optional<FailureKind> failed) {
  if (!outbox_.on()) return;
  std::optional<SessionRecord> record = as_stored(session, true);
  if (!record) return;
  record->failure_kind = failed;
  report(*record, utc);
}

void Journal::report(const SessionRecord& record, const std::string& utc) {
  // The calibration of a session that has not ended well is not in use.
  if (record.state == RecordState::kDone && record.has_calibration)
    report_calibration(record.id, utc);
  outbox_.put(record.id, utc, [&](const Reporter& to) { return to.session(record); });
}

void Journal::report(const Activation& activation) {
  outbox_.put(activation.session, activation.time,
              [&](const Reporter& to) { return to.activation(activation); });
}

void Journal::report_calibration(std::int64_t session, const std::string& utc) {
  outbox_.put(session, utc, [](const Reporter&) {
    return std::vector{Report{"calibration", Worth::kResult, {}}};
  });
}

void Journal::set_state(std::int64_t session, RecordState state, std::string_view ended,
                        std::string_view failure) {
  database_.run("UPDATE session SET state=?, ended=?, failure=? WHERE id=?", to_string(state),
                ended, failure, session);
  changed(session);
}

Journal::Journal(const std::filesystem::path& path)
    : lock_(with(path, ".lock"), path),
      head_(with(path, ".head"), path),
      database_(path),
      chain_(database_, head_),
      remarks_(prepare(database_, head_, chain_)),
      outbox_(database_),
      files_(path, file_names(path)) {
  try {
    if (const std::int64_t newest = chain_.newest_session()) chain_.verify(newest);
  } catch (const JournalError& damaged) {
    remarks_.emplace_back(damaged.what());
  }
}

Journal::~Journal() {
  try {
    if (!pending_.all().empty()) write([] {});
  } catch (const JournalError&) {
    // Only pending log entries are lost; the session's rows are on disk.
  }
}

void Journal::check() {
  const std::lock_guard lock(mutex_);
  files_.check();
}

std::int64_t Journal::begin(const SessionInputs& inputs, const std::string& utc) {
  std::int64_t id = 0;
  write([&] {
    database_.run(
        "INSERT INTO session (started, state, cell_name, cell_text, robot_name, "
        "robot_text, options, software) VALUES (?,'running',?,?,?,?,?,?)",
        utc, inputs.cell_name, inputs.cell_text, inputs.robot_name, inputs.robot_text,
        inputs.options, calib::software_version());
    id = database_.last_row_id();
    changed(id);
    report_session(id, utc);
  });
  running_ = id;
  return id;
}

void Journal::resume(std::int64_t session, const std::string& utc) {
  write([&] {
    set_state(session, RecordState::kRunning, "", "");
    report_session(session, utc);
  });
  running_ = session;
  note(session, utc, "resumed");
}

void Journal::record(std::int64_t session, const RecordPlan& plan) {
  write([&] {
    database_.run("UPDATE session SET plan_hash=?, planned=? WHERE id=?", plan.hash, plan.touches,
                  session);
    changed(session);
  });
}

void Journal::record(std::int64_t session, const RecordReading& record) {
  const Reading& reading = record.reading;
  write([&] {
    chain_.insert(session, "reading", record.touch, record.number, reading.slow,
                  blob(span_of(reading.contact_rad)), blob(span_of(reading.settled_rad)),
                  reading.along_m, reading.time_sigma_s, reading.reaction_s, reading.bounces,
                  reading.utc);
  });
}

void Journal::record(std::int64_t session, const RecordTouch& record) {
  const calib::Touch& touch = record.touch;
  write([&] {
    std::optional<Blob> abc, approach, positioner;
    if (!touch.positioner_rad.empty()) positioner = blob(touch.positioner_rad);
    if (touch.tracker_abc_rad) abc = blob(*touch.tracker_abc_rad);
    if (touch.approach) approach = blob(*touch.approach);
    std::optional<double> temperature_c;
    if (touch.temperature_c) temperature_c = number_of(*touch.temperature_c, "temperature");
    chain_.insert(session, "touch", record.index, blob(touch.joint_rad), touch.target,
                  touch.set == calib::TouchSet::kCheck, touch.sigma_m, touch.radius_m,
                  blob(touch.tracker_m), touch.time, blob(touch.settled_joint_rad), touch.readings,
                  touch.spread_m, touch.speed_m_s, touch.tool,
                  number_of(touch.turn_sigma_rad, "turn_sigma"), abc, approach, temperature_c,
                  touch.load.empty() ? std::nullopt : std::optional(touch.load), positioner);
    outbox_.put_touch(session, record);
  });
}

void Journal::record(std::int64_t session, const RecordEnd& end, const std::string& utc,
                     const std::vector<Report>& also) {
  running_ = 0;  // even if that cannot be recorded
  SessionEnd ended{state_after(end.ending), utc, as_utf8(end.failure), {}, {}, {}, also};
  if (end.result) {
    ended.outcome = outcome_to_json(outcome_of(*end.result));
    ended.document = document_of(*end.result);
  }
  if (end.why) {
    ended.failed = end.why->kind;
    ended.document = failure_to_json(*end.why);
  }
  // A session whose good end cannot be written fails; that end is the one to keep.
  if (end.ending == Ending::kDone) return write([&] { write_end(session, ended); });
  pending_.take({session, std::move(ended)});
  write([] {});
}

void Journal::write_end(std::int64_t session, const SessionEnd& end) {
  // An abort while the good end is on its way to the disk is too late.
  const auto stored = as_stored(session, false);
  if (stored && stored->state == RecordState::kDone) return;
  database_.run(
      "UPDATE session SET outcome=coalesce(?,outcome), document=coalesce(?,document) WHERE id=?",
      end.outcome, end.document, session);
  set_state(session, end.state, end.utc, end.failure);
  outbox_.close_touch();
  report_session(session, end.utc, end.failed);
  outbox_.put(session, end.utc, [&](const Reporter&) { return end.also; });
}

void Journal::store_calibration(std::int64_t session, const std::string& json,
                                const std::optional<Compared>& compared) {
  write([&] {
    if (session != running_)
      throw JournalError(
          fmt::format("session {} has ended: its calibration is not recorded", session));
    database_.run("UPDATE session SET calibration=? WHERE id=?", json, session);
    changed(session);
    if (compared)
      chain_.insert(session, "compared", compared->words, compared->accepted,
                    compared->calibration);
  });
}

std::optional<Compared> Journal::compared(std::int64_t session) {
  const std::lock_guard lock(mutex_);
  chain_.verify(session);
  Statement select(database_,
                   "SELECT words, accepted, calibration FROM compared WHERE session=? "
                   "ORDER BY rowid DESC LIMIT 1");
  if (!select.bind(1, session).step()) return std::nullopt;
  return Compared{select.text(0), select.integer(1) != 0, select.text(2)};
}

void Journal::note(std::int64_t session, const std::string& utc, const std::string& words) {
  pending_.take({session, Words{utc, as_utf8(words)}});
}
void Journal::note(
    std::int64_t session,
    const std::variant<RecordChange, RecordContact, RecordCause, AssessedTouch>& row) {
  std::visit([&](const auto& one) { pending_.take({session, one}); }, row);
}

bool Journal::is_whole(std::int64_t session) {
  const std::lock_guard lock(mutex_);
  if (session != running_ && !chain_.was_verified(session)) {
    try {
      chain_.verify(session);
    } catch (const DamagedError&) {
      return false;
    }
  }
  return chain_.is_whole(session);
}

void Journal::read(std::int64_t session, const char* sql,
                   const std::function<void(Statement&)>& each_row) {
  const std::lock_guard lock(mutex_);
  chain_.verify(session);
  for (Statement select(database_, sql, session); select.step();) each_row(select);
}

std::vector<calib::Touch> Journal::touches(std::int64_t session) {
  std::vector<calib::Touch> touches;
  read(session,
       "SELECT joint_rad, target, held_out, sigma_m, radius_m, tracker_m, time, "
       "settled_rad, readings, spread_m, speed_m_s, tool, turn_sigma_rad, "
       "tracker_abc_rad, approach, temperature_c, load, positioner_rad FROM touch "
       "WHERE session=? ORDER BY number",
       [&](Statement& row) { touches.push_back(touch_from(row)); });
  return touches;
}

std::vector<std::string> Journal::events(std::int64_t session) {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> events;
  read(session, "SELECT time || ' ' || words FROM event WHERE session=? ORDER BY rowid",
       [&](Statement& row) { events.push_back(row.text(0)); });
  pending_.visit<Words>(session,
                        [&](const Words& row) { events.push_back(row.utc + " " + row.words); });
  return events;
}

std::vector<TimedChange> Journal::changes(std::int64_t session) {
  const std::lock_guard lock(mutex_);
  std::vector<TimedChange> changes;
  read(session, "SELECT clock_s, from_phase, to_phase FROM change WHERE session=? ORDER BY rowid",
       [&](Statement& row) {
         const auto from = phase_of(row.text(1)), to = phase_of(row.text(2));
         if (from && to) changes.push_back({row.number(0), {*from, *to}});
       });
  pending_.visit<RecordChange>(session, [&](const RecordChange& row) {
    changes.push_back({row.clock_s, row.change});
  });
  return changes;
}

InterruptionCounts Journal::interruptions(std::int64_t session) {
  const std::lock_guard lock(mutex_);
  InterruptionCounts counts;
  read(session, "SELECT cause FROM interruption WHERE session=?", [&](Statement& row) {
    if (const auto by = cause_of(row.text(0))) counts.count(*by);
  });
  pending_.visit<RecordCause>(session, [&](const RecordCause& row) { counts.count(row.by); });
  return counts;
}

std::vector<RecordReading> Journal::readings(std::int64_t session) {
  std::vector<RecordReading> readings;
  read(session,
       "SELECT touch, number, slow, contact_rad, settled_rad, along_m, time_sigma_s, "
       "reaction_s, bounces, time FROM reading WHERE session=? ORDER BY rowid",
       [&](Statement& row) {
         RecordReading& one = readings.emplace_back();
         one.touch = static_cast<std::size_t>(row.integer(0));
         one.number = static_cast<int>(row.integer(1));
         one.reading.slow = row.integer(2) != 0;
         one.reading.contact_rad = axes(numbers(row.text(3)));
         one.reading.settled_rad = axes(numbers(row.text(4)));
         one.reading.along_m = row.number(5);
         one.reading.time_sigma_s = row.number(6);
         one.reading.reaction_s = row.number(7);
         one.reading.bounces = static_cast<int>(row.integer(8));
         one.reading.utc = row.text(9);
       });
  return readings;
}

}  // namespace cellcal::daemon
