#include "daemon/archive/cell_events.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "calib/model/error.h"
#include "calib/model/iso_time.h"
#include "daemon/tasks/options.h"

namespace cellcal::daemon {

namespace {

bool same_tool(const calib::Tool& one, const calib::Tool& other) {
  return one.tcp.isApprox(other.tcp) && one.tip_radius_m == other.tip_radius_m &&
         one.mass_kg == other.mass_kg;
}

/// Differences between the inputs of two sessions.
void compare(const SessionInputs& before, const SessionInputs& after, calib::DriftEvent& event) {
  event.robot_changed = before.robot_text != after.robot_text;
  event.cell_changed = before.cell_text != after.cell_text;
  if (!event.cell_changed) return;
  try {
    const calib::Tool one = cell_of(before).tool, other = cell_of(after).tool;
    if (!same_tool(one, other))
      event.tcp_moved_m = (other.tcp.translation() - one.tcp.translation()).norm();
  } catch (const calib::FileError& unreadable) {
    spdlog::warn("session {}: its tool is not compared: {}", event.session, unreadable.what());
  }
}

std::optional<SessionRecord> read(Journal& journal, std::int64_t session) try {
  return journal.session(session);
} catch (const DamagedError&) {
  return std::nullopt;
}

calib::DriftEvent event_of(const SessionRecord& record) {
  calib::DriftEvent event;
  event.session = record.id;
  event.time_s = calib::seconds_of(record.ended).value_or(0.0);
  try {
    const SessionOptions options = options_from_json(record.inputs.options);
    if (options.update) event.kind = calib::DriftEventKind::kUpdated;
    event.accepted = options.accept_change;
  } catch (const std::runtime_error&) {
    // An entry of another version is a calibration without details.
  }
  return event;
}

bool is_published(Journal& journal, const SessionRecord& record, const std::string& cell_name) {
  return record.state == RecordState::kDone && !record.origin && record.has_calibration &&
         record.inputs.cell_name == cell_name && journal.was_published(record.id).value_or(false);
}

void add_publications(Journal& journal, const std::vector<SessionRecord>& newest_first,
                      const std::string& cell_name, std::vector<calib::DriftEvent>& events) {
  std::optional<SessionRecord> later;
  for (const SessionRecord& record : newest_first) {
    if (events.size() == kMostEvents) break;
    if (!is_published(journal, record, cell_name)) continue;
    std::optional<SessionRecord> whole = read(journal, record.id);
    if (later && whole) compare(whole->inputs, later->inputs, events.back());
    later = std::move(whole);
    events.push_back(event_of(record));
  }
}

void add_activations(Journal& journal, const std::vector<SessionRecord>& newest_first,
                     const std::string& cell_name, std::vector<calib::DriftEvent>& events) {
  for (const Activation& one : journal.activations()) {
    const auto of = std::ranges::find(newest_first, one.session, &SessionRecord::id);
    const auto time_s = calib::seconds_of(one.time);
    if (of == newest_first.end() || of->inputs.cell_name != cell_name || !time_s) continue;
    calib::DriftEvent& event = events.emplace_back();
    event.kind = calib::DriftEventKind::kActivated;
    event.session = one.session;
    // By this computer's clock, which is not that of an emulated cell.
    event.time_s = calib::seconds_of(of->ended).value_or(0.0) < kYear2001S ? 0.0 : *time_s;
    event.by = one.who;
    event.reason = one.reason;
  }
}

}  // namespace

std::vector<calib::DriftEvent> events_of(Journal& journal,
                                         const std::vector<SessionRecord>& newest_first,
                                         const std::string& cell_name) {
  std::vector<calib::DriftEvent> events;
  add_publications(journal, newest_first, cell_name, events);
  std::ranges::reverse(events);
  add_activations(journal, newest_first, cell_name, events);
  std::ranges::stable_sort(events, {}, [](const calib::DriftEvent& event) {
    return event.time_s > 0.0 ? event.time_s : std::numeric_limits<double>::infinity();
  });
  return events;
}

}  // namespace cellcal::daemon
