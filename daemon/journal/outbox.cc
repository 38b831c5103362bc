// What is reported of this journal's facts.

#include "daemon/journal/journal_impl.h"

namespace cellcal::daemon {

void Journal::report_to(std::shared_ptr<const Reporter> reporter) {
  const std::string address = reporter ? reporter->address() : "";
  // The newest of this journal's own, where nobody runs it any more and it was not reported.
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
