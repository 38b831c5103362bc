// What is told of this journal's facts.

#include "daemon/journal/journal_impl.h"

namespace cellcal::daemon {

void Journal::report_to(std::shared_ptr<const Reporter> reporter) {
  const std::string address = reporter ? reporter->address() : "";
  bool other = false;
  {
    const std::lock_guard lock(impl_->mutex);
    other = impl_->outbox.is_other(address);
    if (!other) impl_->outbox.use(reporter);
    if (!reporter) return;
  }
  if (other) {
    impl_->write([&] {
      impl_->outbox.use(reporter);
      impl_->outbox.speak_as(address);
    });
  }
  for (const SessionRecord& newest : sessions()) {
    if (newest.origin) continue;
    const std::int64_t entry = last_entry(newest.id);
    if (newest.state != "interrupted") return;
    impl_->write([&] {
      if (impl_->outbox.was_told_interrupted(entry)) return;
      impl_->outbox.put(newest.id, {}, [&](const Reporter& to) { return to.session(newest); });
      impl_->outbox.told_interrupted(entry);
    });
    return;
  }
}

void Journal::report_no_more_to(const Reporter& reporter) {
  const std::lock_guard lock(impl_->mutex);
  if (impl_->outbox.on() && &impl_->outbox.reporter() == &reporter) impl_->outbox.use(nullptr);
}

void Journal::report(std::int64_t session, const Report& report) {
  impl_->write([&] {
    // Where the end of a session could not be written its last touch would hold back all results behind it.
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
