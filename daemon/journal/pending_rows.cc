// Pending rows and the journal's outbox.

#include "daemon/journal/pending_rows.h"

#include <chrono>
#include <cmath>
#include <limits>

#include "daemon/journal/journal_impl.h"
#include "daemon/session/interruption.h"

namespace cellcal::daemon {

namespace {

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
  Database& database;
  Chain& chain;
  std::int64_t session;

  void operator()(const Words& row) const {
    database.run("INSERT INTO event (session, time, words) VALUES (?,?,?)", session, row.utc,
                 row.words);
    chain.add(session, "event", database.last_row_id());
  }

  void operator()(const RecordChange& row) const {
    database.run(
        "INSERT INTO change (session, time, clock_s, from_phase, to_phase, event, "
        "late_replies, sensor_late_s) VALUES (?,?,?,?,?,?,?,?)",
        session, row.utc, kept(row.clock_s), to_string(row.change.from), to_string(row.change.to),
        to_string(row.on), row.late_replies, kept(row.sensor_late_s));
    chain.add(session, "change", database.last_row_id());
  }

  void operator()(const RecordCause& row) const {
    database.run("INSERT INTO interruption (session, time, cause) VALUES (?,?,?)", session, row.utc,
                 name_of_cause(row.by));
    chain.add(session, "interruption", database.last_row_id());
  }

  void operator()(const AssessedTouch&) const {}  // the outbox's alone

  void operator()(const RecordContact& row) const {
    const drivers::ContactRecord& contact = row.contact;
    database.run(
        "INSERT INTO contact (session, touch, time, kind, arm_id, sequence, number, "
        "ticks, confirmed_after_us, bounces, sense_v, heard_s, first_edge_s, "
        "time_sigma_s, lost) VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)",
        session, row.touch, row.utc, to_string(contact.kind), contact.arm_id, contact.sequence,
        contact.event, contact.ticks, contact.confirmed_after_us, contact.bounces,
        kept(contact.sense_v), seconds(contact.heard), seconds(contact.first_edge),
        kept(contact.time_sigma_s), contact.lost);
    chain.add(session, "contact", database.last_row_id());
  }
};

}  // namespace

void insert(Database& database, Chain& chain, const PendingRow& row) {
  std::visit(Insert{database, chain, row.session}, row.what);
}

void Journal::report_to(std::shared_ptr<const Reporter> reporter) {
  const std::string address = reporter ? reporter->address() : "";
  // The newest own session if it is interrupted and was not reported.
  const auto interrupted = [&]() -> std::optional<SessionRecord> {
    std::optional<SessionRecord> newest = impl_->newest_own();
    if (!newest || newest->state != RecordState::kInterrupted ||
        impl_->outbox.was_reported_interrupted(impl_->chain.last_entry(newest->id)))
      return std::nullopt;
    return newest;
  };
  {
    const std::lock_guard lock(impl_->mutex);
    if (!reporter || (!impl_->outbox.is_other(address) && !interrupted())) {
      impl_->outbox.use(std::move(reporter));
      return;
    }
  }
  impl_->write([&] {
    impl_->outbox.use_from_commit(reporter);
    if (impl_->outbox.is_other(address)) impl_->outbox.speak_as(address);
    if (const auto session = interrupted()) {
      impl_->outbox.put(session->id, {}, [&](const Reporter& to) { return to.session(*session); });
      impl_->outbox.mark_reported_interrupted(impl_->chain.last_entry(session->id));
    }
  });
}

void Journal::report_no_more_to(const Reporter& reporter) {
  const std::lock_guard lock(impl_->mutex);
  if (impl_->outbox.on() && &impl_->outbox.reporter() == &reporter) impl_->outbox.use(nullptr);
}

void Journal::report(std::int64_t session, const Report& report) {
  impl_->write([&] {
    // After a failed write of a session's end its last touch would hold back all later results.
    if (report.worth == Worth::kResult) impl_->outbox.close_touch();
    impl_->outbox.put(session, {}, [&](const Reporter&) { return std::vector{report}; });
  });
}

std::vector<WaitingReport> Journal::waiting(std::int64_t after, std::size_t most) {
  const std::lock_guard lock(impl_->mutex);
  return impl_->outbox.waiting(after, most);
}

void Journal::acknowledge(const std::vector<std::int64_t>& rows) {
  impl_->write([&] { impl_->outbox.acknowledge(rows); });
}

void Journal::replace(std::int64_t row, const Report& report) {
  impl_->write([&] { impl_->outbox.replace(row, report); });
}

OutboxCount Journal::outbox() {
  const std::lock_guard lock(impl_->mutex);
  return impl_->outbox.look();
}

}  // namespace cellcal::daemon
