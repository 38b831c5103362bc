// What somebody, or the schedule, has decided beside the sessions: which calibration is used (rows that are added, never
// changed), and the schedule's state (one row).

#include "calib/files/input_file.h"
#include "daemon/journal/journal_impl.h"

namespace cellcal::daemon {

void Journal::activate(const Activation& activation) {
  impl_->write([&] {
    Statement insert(impl_->database,
                     "INSERT INTO activation (session, time, who, reason) VALUES (?,?,?,?)");
    insert.bind(1, activation.session).bind(2, std::string_view(activation.time));
    insert.bind(3, std::string_view(activation.who));
    insert.bind(4, std::string_view(activation.reason)).step();
    impl_->added(activation.session, "activation");
    impl_->outbox.put(activation.session, activation.time,
                      [&](const Reporter& to) { return to.activation(activation); });
  });
}

std::vector<Activation> Journal::activations() {
  const std::lock_guard lock(impl_->mutex);
  Statement select(
      impl_->database,
      "SELECT activation.session, activation.time, who, reason, chain.number, activation.rowid "
      "FROM activation JOIN chain ON chain.kind='activation' AND chain.session=activation.session "
      "AND chain.row=activation.rowid ORDER BY chain.number");
  std::vector<Activation> activations;
  while (select.step()) {
    if (!impl_->chain.is_whole(select.integer(0), "activation", select.integer(5))) continue;
    activations.push_back(
        {select.integer(0), select.text(1), select.text(2), select.text(3), select.integer(4)});
  }
  return activations;
}

void Journal::store_schedule(const std::string& state) {
  impl_->write([&] {
    Statement insert(impl_->database,
                     "INSERT OR REPLACE INTO schedule (id, state, sum) VALUES (1,?,?)");
    insert.bind(1, std::string_view(state));
    insert.bind(2, std::string_view(calib::sha256(state))).step();
  });
}

std::string Journal::schedule() {
  const std::lock_guard lock(impl_->mutex);
  Statement select(impl_->database, "SELECT state, sum FROM schedule");
  if (!select.step()) return {};
  std::string state = select.text(0);
  if (calib::sha256(state) != select.text(1))
    throw DamagedError(
        "the journal's row of the schedule is altered: what was begun or held is not known");
  return state;
}

std::int64_t Journal::last_entry(std::int64_t session) {
  const std::lock_guard lock(impl_->mutex);
  return impl_->chain.last_entry(session);
}

}  // namespace cellcal::daemon
