#include "daemon/tasks/delay_watch.h"

#include <spdlog/spdlog.h>

#include <stdexcept>

#include "calib/model/long_work.h"
#include "daemon/qualification/contact_delay.h"
#include "daemon/tasks/options.h"

namespace cellcal::daemon {

std::optional<ContactDelay> delay_of(Journal& journal, std::int64_t session) {
  const std::optional<SessionRecord> record = journal.session(session);
  if (!record) return std::nullopt;
  TouchPolicy policy;
  try {
    const SessionOptions options = options_from_json(record->inputs.options);
    // Its searches have speeds of their own, and it reports the delay itself.
    if (options.kind == SessionKind::kQualify) return std::nullopt;
    policy = options.touch;
  } catch (const std::runtime_error&) {
    return std::nullopt;  // another version: its speeds are unknown
  }
  return contact_delay(fast_and_slow(journal.readings(session), journal.touches(session).size()),
                       policy.fast_m_s, policy.slow_m_s);
}

std::optional<ContactDelay> delay_before(Journal& journal, std::int64_t session) {
  const std::optional<SessionRecord> record = journal.session(session);
  if (!record) return std::nullopt;
  for (const SessionRecord& earlier : journal.sessions()) {
    calib::poll_cancelled();
    if (earlier.id >= session || earlier.origin ||
        earlier.inputs.robot_name != record->inputs.robot_name)
      continue;
    try {
      if (const auto delay = delay_of(journal, earlier.id)) return delay;
    } catch (const JournalError& damaged) {
      spdlog::warn("not compared with session {}: {}", earlier.id, damaged.what());
    }
  }
  return std::nullopt;
}

void watch_delay(Journal& journal, std::int64_t session, const std::string& utc) {
  try {
    const std::optional<ContactDelay> delay = delay_of(journal, session);
    if (!delay) return;
    const std::string words = "latch delay: " + in_words(*delay);
    journal.note(session, utc, words);
    spdlog::info("session {}: {}", session, words);
    const std::string wrong = complaint(*delay, delay_before(journal, session));
    if (wrong.empty()) return;
    journal.note(session, utc, "warning: " + wrong);
    spdlog::warn("session {}: {}", session, wrong);
  } catch (const std::exception& error) {
    spdlog::warn("session {}: latch delay not estimated: {}", session, error.what());
  }
}

}  // namespace cellcal::daemon
