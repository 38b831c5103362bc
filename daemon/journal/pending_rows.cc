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

/// SQLite stores NaN as NULL, which the NOT NULL column rejects together with all later touches.
/// NaN is therefore stored as infinity.
double kept(double value) {
  return std::isnan(value) ? std::numeric_limits<double>::infinity() : value;
}

/// Adds a row to its table and to the chain.
struct Insert {
  Database& database;
  Chain& chain;
  std::int64_t session;

  void operator()(const Words& row) const {
    Statement insert(database, "INSERT INTO event (session, time, words) VALUES (?,?,?)");
    insert.bind(1, session).bind(2, std::string_view(row.utc));
    insert.bind(3, std::string_view(row.words)).step();
    chain.add(session, "event", database.last_row_id());
  }

  void operator()(const RecordChange& row) const {
    Statement insert(database,
                     "INSERT INTO change (session, time, clock_s, from_phase, to_phase, event, "
                     "late_replies, sensor_late_s) VALUES (?,?,?,?,?,?,?,?)");
    insert.bind(1, session).bind(2, std::string_view(row.utc)).bind(3, kept(row.clock_s));
    insert.bind(4, std::string_view(to_string(row.change.from)));
    insert.bind(5, std::string_view(to_string(row.change.to)));
    insert.bind(6, std::string_view(to_string(row.on)));
    insert.bind(7, static_cast<std::int64_t>(row.late_replies))
        .bind(8, kept(row.sensor_late_s))
        .step();
    chain.add(session, "change", database.last_row_id());
  }

  void operator()(const RecordCause& row) const {
    Statement insert(database, "INSERT INTO interruption (session, time, cause) VALUES (?,?,?)");
    insert.bind(1, session).bind(2, std::string_view(row.utc));
    insert.bind(3, std::string_view(name_of_cause(row.by))).step();
    chain.add(session, "interruption", database.last_row_id());
  }

  void operator()(const AssessedTouch&) const {}  // for the outbox only

  void operator()(const RecordContact& row) const {
    Statement insert(database,
                     "INSERT INTO contact (session, touch, time, kind, arm_id, sequence, number, "
                     "ticks, confirmed_after_us, bounces, sense_v, heard_s, first_edge_s, "
                     "time_sigma_s, lost) VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)");
    const drivers::ContactRecord& contact = row.contact;
    const auto whole = [&](int index, std::int64_t value) { insert.bind(index, value); };
    insert.bind(1, session).bind(3, std::string_view(row.utc));
    insert.bind(4, std::string_view(to_string(contact.kind)));
    whole(2, static_cast<std::int64_t>(row.touch));
    whole(5, contact.arm_id);
    whole(6, contact.sequence);
    whole(7, contact.event);
    whole(8, contact.ticks);
    whole(9, contact.confirmed_after_us);
    whole(10, contact.bounces);
    insert.bind(11, kept(contact.sense_v)).bind(12, seconds(contact.heard));
    insert.bind(13, seconds(contact.first_edge)).bind(14, kept(contact.time_sigma_s));
    whole(15, static_cast<std::int64_t>(contact.lost));
    insert.step();
    chain.add(session, "contact", database.last_row_id());
  }
};

}  // namespace

void insert(Database& database, Chain& chain, const PendingRow& row) {
  std::visit(Insert{database, chain, row.session}, row.what);
}

void Journal::report_to(std::shared_ptr<const Reporter> reporter) {
  const std::string address = reporter ? reporter->address() : "";
  // The newest own session if it is interrupted and not yet reported.
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
    // After a failed write of a session's end its last touch would delay all later results.
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
