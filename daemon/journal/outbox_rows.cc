#include "daemon/journal/outbox_rows.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <map>

#include "daemon/journal/journal.h"
#include "daemon/session/interruption.h"

namespace cellcal::daemon {

namespace {

/// Estimated size of a row without its body.
constexpr std::int64_t kOutboxRowBytes = 100;
/// Maximum number of bytes per reading, which limits the time of the lock.
constexpr std::size_t kMostAtOnce = std::size_t{1} << 20;
/// Fraction of the bound that is dropped at once, so that not every new row causes a drop.
constexpr std::int64_t kDroppedShare = 10;

constexpr const char* kBytes = "length(CAST(body AS BLOB))";

std::int64_t bytes_of(const Report& report) {
  return static_cast<std::int64_t>(report.body.size()) + kOutboxRowBytes;
}

void name_source(Database& database) {
  database.run(
      "INSERT OR REPLACE INTO outbox_source (first, name) SELECT coalesce(max(seq), 0) + 1, ? FROM "
      "sqlite_sequence WHERE name='outbox'",
      random_name(4));
}

/// `count` facts with numbers from `first` to `last` were dropped. Of the journal itself: no reporter may be there.
Report dropped(std::int64_t first, std::int64_t last, std::int64_t count) {
  return {"dropped", Worth::kResult,
          fmt::format(R"({{"first":{},"last":{},"count":{}}})", first, last, count)};
}

double seconds(drivers::TimePoint at) {
  return std::chrono::duration<double>(at.time_since_epoch()).count();
}

/// SQLite stores NaN as NULL, which the NOT NULL column rejects together with all later touches. NaN is stored as
/// infinity.
double kept(double value) {
  return std::isnan(value) ? std::numeric_limits<double>::infinity() : value;
}

/// Adds a row to its table and to the chain.
struct Insert {
  Chain& chain;
  std::int64_t session;

  void operator()(const Words& row) const { chain.insert(session, "event", row.utc, row.words); }

  void operator()(const RecordChange& row) const {
    chain.insert(session, "change", row.utc, kept(row.clock_s), to_string(row.change.from),
                 to_string(row.change.to), to_string(row.on), row.late_replies,
                 kept(row.sensor_late_s));
  }

  void operator()(const RecordCause& row) const {
    chain.insert(session, "interruption", row.utc, name_of_cause(row.by));
  }

  void operator()(const AssessedTouch&) const {}  // the outbox's alone
  void operator()(const SessionEnd&) const {}     // the session's own row

  void operator()(const RecordContact& row) const {
    const drivers::ContactRecord& contact = row.contact;
    chain.insert(session, "contact", row.touch, row.utc, to_string(contact.kind), contact.arm_id,
                 contact.sequence, contact.event, contact.ticks, contact.confirmed_after_us,
                 contact.bounces, kept(contact.sense_v), seconds(contact.heard),
                 seconds(contact.first_edge), kept(contact.time_sigma_s), contact.lost);
  }
};

}  // namespace

void begin_source(Database& database) {
  Statement waiting(
      database,
      "SELECT max(number), min(number) - first + 1, max(number) - first + 1, count(*) "
      "FROM outbox, (SELECT max(first) AS first FROM outbox_source) "
      "WHERE worth='telemetry' HAVING count(*) > 0");
  if (waiting.step()) {
    const Report notice = dropped(waiting.integer(1), waiting.integer(2), waiting.integer(3));
    // In the place of the last: the journal that this is a copy of may use the next number.
    database.run("UPDATE outbox SET session=0, kind=?, worth=?, body=? WHERE number=?", notice.kind,
                 own_name(notice.worth), notice.body, waiting.integer(0));
    database.execute("DELETE FROM outbox WHERE worth='telemetry'");
  }
  name_source(database);
}

void OutboxRows::assign_source() {
  Statement source(database_, "SELECT first, name FROM outbox_source ORDER BY first DESC LIMIT 1");
  source.step();
  first_ = source.integer(0);
  now_.source = source.text(1);
  now_.newest =
      database_.integer("SELECT coalesce(max(seq), 0) FROM sqlite_sequence WHERE name='outbox'") -
      first_ + 1;
}

OutboxRows::OutboxRows(Database& database) : database_(database) {
  assign_source();
  const auto sum = [&](const char* of) {
    return database_.integer(
        fmt::format("SELECT coalesce(sum({} + {}), 0) FROM outbox {}", kBytes, kOutboxRowBytes, of)
            .c_str());
  };
  now_.rows = database_.integer("SELECT count(*) FROM outbox");
  now_.bytes = sum("");
  now_.telemetry_bytes = sum("WHERE worth='telemetry'");
  on_disk_ = now_;
  first_on_disk_ = first_;
}

bool OutboxRows::is_other(const std::string& address) {
  return !address.empty() &&
         database_.text("SELECT address FROM outbox_source ORDER BY first DESC LIMIT 1") != address;
}

void OutboxRows::speak_as(const std::string& address) {
  const bool named =
      !database_.text("SELECT address FROM outbox_source ORDER BY first DESC LIMIT 1").empty();
  // If no number was reported under the previous name, the source is renamed.
  if (named && now_.newest > 0) {
    drop(now_.telemetry_bytes);  // its reports belong to the numbers that end here
    name_source(database_);
  }
  database_.run(
      "UPDATE outbox_source SET address=? WHERE first=(SELECT max(first) FROM outbox_source)",
      address);
  assign_source();
}

std::string OutboxRows::sources_reported(bool reported) {
  Statement sources(database_, "SELECT first, address FROM outbox_source");
  std::string list;
  while (sources.step()) {
    const std::string address = sources.text(1);
    if ((address.empty() || !reporter_ || reporter_->publishes_name(address)) != reported) continue;
    list += (list.empty() ? "" : ",") + std::to_string(sources.integer(0));
  }
  return "first IN (" + list + ")";
}

OutboxCount OutboxRows::read_count() {
  OutboxCount count = now_;
  count.oldest =
      database_.text("SELECT coalesce((SELECT time FROM outbox ORDER BY number LIMIT 1), '')");
  Statement others(
      database_,
      ("SELECT count(*), coalesce(min(first), 0) FROM outbox JOIN outbox_source ON first="
       "(SELECT max(first) FROM outbox_source WHERE first<=number) WHERE " +
       sources_reported(false))
          .c_str());
  if (!others.step() || others.integer(0) == 0) return count;
  count.elsewhere = others.integer(0);
  Statement address(database_, "SELECT address FROM outbox_source WHERE first=?");
  if (address.bind(1, others.integer(1)).step()) count.elsewhere_address = address.text(0);
  return count;
}

void OutboxRows::put_touch(std::int64_t session, const RecordTouch& touch) {
  close_touch();
  const std::int64_t before = now_.newest;
  put(session, touch.touch.time, [&](const Reporter& to) { return to.touch(touch); });
  if (touch.tip_m && now_.newest == before + 1) open_ = {first_ + now_.newest - 1, session, touch};
}

void OutboxRows::assess(std::int64_t session, const AssessedTouch& found) {
  if (!reporter_) close_touch();
  if (open_.row == 0 || open_.session != session || open_.touch.index != found.index) return;
  open_.touch.residual_m = found.residual_m;
  try {
    const std::vector<Report> now = reporter_->touch(open_.touch);
    if (now.size() == 1) rewrite(open_.row, now[0]);
  } catch (const std::exception&) {  // reported without the residual
  }
  close_touch();
  added_ = true;
}

void OutboxRows::rewrite(std::int64_t row, const Report& report) {
  Statement before(database_,
                   fmt::format("SELECT {}, worth FROM outbox WHERE number=?", kBytes).c_str());
  if (!before.bind(1, row).step()) return;  // dropped or acknowledged meanwhile
  const auto take = [&](std::int64_t bytes, bool telemetry) {
    now_.bytes += bytes;
    if (telemetry) now_.telemetry_bytes += bytes;
  };
  take(-(before.integer(0) + kOutboxRowBytes), before.text(1) == "telemetry");
  database_.run("UPDATE outbox SET kind=?, worth=?, body=? WHERE number=?", report.kind,
                own_name(report.worth), report.body, row);
  take(bytes_of(report), report.worth == Worth::kTelemetry);
}

void OutboxRows::replace(std::int64_t row, const Report& report) {
  rewrite(row, report);
  added_ = true;
}

void OutboxRows::put(std::int64_t session, const std::string& time,
                     const std::function<std::vector<Report>(const Reporter&)>& say) {
  if (!reporter_) return;
  std::vector<Report> reports;
  try {
    reports = say(*reporter_);
  } catch (const std::exception&) {  // the fact has priority
    ++now_.not_begun;
  }
  for (const Report& report : reports) {
    if (make_room(report, bytes_of(report))) add(session, time, report);
  }
}

bool OutboxRows::make_room(const Report& report, std::int64_t bytes) {
  const std::int64_t most = reporter_->most_bytes();
  const bool telemetry = report.worth == Worth::kTelemetry;
  const std::int64_t results = now_.bytes - now_.telemetry_bytes;
  if (telemetry && (only_results_ || results + bytes > most - most / kDroppedShare)) {
    ++now_.not_begun;
    return false;
  }
  if (now_.bytes + bytes > most && now_.telemetry_bytes > 0)
    drop(now_.bytes + bytes - most + most / kDroppedShare);
  return true;
}

void OutboxRows::add(std::int64_t session, const std::string& time, const Report& report) {
  database_.run(
      "INSERT INTO outbox (session, time, kind, worth, body) VALUES "
      "(?,coalesce(nullif(?,''),strftime('%Y-%m-%dT%H:%M:%fZ','now')),?,?,?)",
      session, time, report.kind, own_name(report.worth), report.body);
  now_.newest = database_.last_row_id() - first_ + 1;
  ++now_.rows;
  now_.bytes += bytes_of(report);
  if (report.worth == Worth::kTelemetry) now_.telemetry_bytes += bytes_of(report);
  added_ = true;
}

void OutboxRows::drop(std::int64_t bytes) {
  std::int64_t first = 0, last = 0, count = 0, freed = 0;
  {
    Statement oldest(database_, fmt::format("SELECT number, {} FROM outbox WHERE worth='telemetry' "
                                            "ORDER BY number",
                                            kBytes)
                                    .c_str());
    while (freed < bytes && oldest.step()) {
      last = oldest.integer(0);
      if (count++ == 0) first = last;
      freed += oldest.integer(1) + kOutboxRowBytes;
    }
  }
  if (count == 0) return;
  database_.run("DELETE FROM outbox WHERE worth='telemetry' AND number<=?", last);
  if (open_.row <= last) close_touch();
  now_.rows -= count;
  now_.bytes -= freed;
  now_.telemetry_bytes -= freed;
  now_.dropped += count;
  add(0, {}, dropped(first - first_ + 1, last - first_ + 1, count));
}

void OutboxRows::drop_telemetry() {
  only_results_ = true;
  drop(now_.telemetry_bytes);
}

bool OutboxRows::was_reported_interrupted(std::int64_t entry) {
  return database_.integer("SELECT interrupted FROM outbox_source ORDER BY first DESC LIMIT 1") >=
         entry;
}

void OutboxRows::mark_reported_interrupted(std::int64_t entry) {
  database_.run(
      "UPDATE outbox_source SET interrupted=? WHERE first=(SELECT max(first) FROM outbox_source)",
      entry);
}

void OutboxRows::acknowledge(const std::vector<std::int64_t>& rows) {
  for (const std::int64_t row : rows) {
    Statement gone(
        database_,
        fmt::format("DELETE FROM outbox WHERE number=? RETURNING {}, worth", kBytes).c_str());
    if (!gone.bind(1, row).step()) continue;  // dropped meanwhile
    const std::int64_t bytes = gone.integer(0) + kOutboxRowBytes;
    --now_.rows;
    now_.bytes -= bytes;
    if (gone.text(1) == "telemetry") now_.telemetry_bytes -= bytes;
    gone.step();
  }
}

void OutboxRows::committed() {
  on_disk_reporter_ = reporter_;
  on_disk_ = now_;
  open_on_disk_ = open_;
  first_on_disk_ = first_;
  only_results_ = false;
  if (std::exchange(added_, false) && reporter_) reporter_->waits();
}

void OutboxRows::rolled_back() {
  reporter_ = on_disk_reporter_;
  now_ = on_disk_;
  open_ = open_on_disk_;
  first_ = first_on_disk_;
  only_results_ = added_ = false;
}

std::vector<WaitingReport> OutboxRows::waiting(std::int64_t after, std::size_t most) {
  Statement select(
      database_,
      ("SELECT number, name, number - first + 1, session, time, kind, worth, body FROM outbox "
       "JOIN outbox_source ON first=(SELECT max(first) FROM outbox_source WHERE first<=number) "
       "WHERE number>? AND number<? AND " +
       sources_reported(true) + " ORDER BY number LIMIT ?")
          .c_str(),
      after, open_.row > 0 ? open_.row : std::numeric_limits<std::int64_t>::max(), most);
  std::vector<WaitingReport> rows;
  std::size_t bytes = 0;
  while (bytes < kMostAtOnce && select.step()) {
    const Worth worth = by_own_name<Worth>(select.text(6)).value_or(Worth::kTelemetry);
    rows.push_back({select.integer(0),
                    select.text(1),
                    select.integer(2),
                    select.integer(3),
                    select.text(4),
                    {select.text(5), worth, select.text(7)}});
    bytes += rows.back().report.body.size();
  }
  return rows;
}

void insert(Chain& chain, const PendingRow& row) {
  std::visit(Insert{chain, row.session}, row.what);
}

void Journal::report_to(std::shared_ptr<const Reporter> reporter) {
  const std::string address = reporter ? reporter->address() : "";
  // The newest own session if it is interrupted and was not reported.
  const auto interrupted = [&]() -> std::optional<SessionRecord> {
    std::optional<SessionRecord> newest = newest_own();
    if (!newest || newest->state != RecordState::kInterrupted ||
        outbox_.was_reported_interrupted(chain_.last_entry(newest->id)))
      return std::nullopt;
    return newest;
  };
  {
    const std::lock_guard lock(mutex_);
    if (!reporter || (!outbox_.is_other(address) && !interrupted())) {
      outbox_.use(std::move(reporter));
      return;
    }
  }
  write([&] {
    outbox_.use_from_commit(reporter);
    const bool other = outbox_.is_other(address);
    if (other) {
      outbox_.speak_as(address);
      report_state();
    }
    if (const auto session = interrupted()) {
      if (!other) report_newest();
      outbox_.mark_reported_interrupted(chain_.last_entry(session->id));
    }
  });
}

void Journal::report_newest() {
  const auto newest = newest_own();
  auto record = newest ? as_stored(newest->id, true) : std::nullopt;
  if (!record || newest->state == RecordState::kDamaged) return;
  record->state = newest->state;
  report(*record, record->ended);
}

void Journal::report_state() {
  std::map<std::int64_t, std::function<void()>> facts;  // by entry of the chain
  if (const std::int64_t used = outbox_.reporter().in_use(*this)) {
    facts[chain_.last_entry(used)] = [this, used] {
      if (const auto record = as_stored(used, false)) report_calibration(used, record->ended);
    };
    std::optional<Activation> activated;
    for (Activation& one : activations())
      if (one.session == used) activated = std::move(one);
    if (activated) facts[activated->entry] = [this, activated = *activated] { report(activated); };
  }
  if (const auto newest = newest_own())
    facts[chain_.last_entry(newest->id)] = [this] { report_newest(); };
  for (const auto& [entry, report_it] : facts) report_it();
}

void Journal::report_no_more_to(const Reporter& reporter) {
  const std::lock_guard lock(mutex_);
  if (outbox_.on() && &outbox_.reporter() == &reporter) outbox_.use(nullptr);
}

void Journal::report(std::int64_t session, const Report& report) {
  write([&] { outbox_.put(session, {}, [&](const Reporter&) { return std::vector{report}; }); });
}

std::vector<WaitingReport> Journal::waiting(std::int64_t after, std::size_t most) {
  const std::lock_guard lock(mutex_);
  return outbox_.waiting(after, most);
}

void Journal::acknowledge(const std::vector<std::int64_t>& rows) {
  write([&] { outbox_.acknowledge(rows); });
}

void Journal::replace(std::int64_t row, const Report& report) {
  write([&] { outbox_.replace(row, report); });
}

OutboxCount Journal::outbox() {
  const std::lock_guard lock(mutex_);
  return outbox_.read_count();
}

}  // namespace cellcal::daemon
