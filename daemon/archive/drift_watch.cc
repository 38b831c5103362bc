#include "daemon/archive/drift_watch.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

#include "calib/check/drift.h"
#include "calib/model/error.h"
#include "calib/model/iso_time.h"
#include "daemon/result/outcome_json.h"
#include "daemon/tasks/options.h"
#include "daemon/tasks/planned_round.h"

namespace cellcal::daemon {

namespace {

// Changes of a cell on its control chart, from the journal.

/// Before it the calibration's own clock gives no age: that of an emulated cell starts at 2000-01-01.
constexpr double kYear2001S = 978'307'200.0;

/// At most this number of publications of a cell, the newest.
constexpr std::size_t kMostEvents = 30;

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
  const auto options = options_in(record.inputs);
  if (!options) return event;  // an entry of another version is a calibration without details
  if (options->update) event.kind = calib::DriftEventKind::kUpdated;
  event.accepted = options->accept_change;
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

/// Calibrations of this cell file that came into use, by publication or activation; oldest first. A session whose cell
/// file is damaged or unreadable counts as unchanged. Throws JournalError.
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

// The chart.

constexpr std::size_t kMostChecks = 1500;
constexpr std::size_t kMostOtherCharts = 3;
/// Criterion for equal touches, as in daemon/tasks/planned_round.cc.
constexpr double kSameLineRad = 0.08;

struct Check {
  calib::CheckMeasurement seen;
  std::vector<calib::Touch> touches;
  Eigen::VectorXd off_m;
};

double ended_s(const SessionRecord& record) {
  const auto seconds = calib::seconds_of(record.ended);
  if (!seconds) throw std::runtime_error("its end \"" + record.ended + "\" is not a time");
  return *seconds;
}

bool same_line(const calib::Touch& one, const calib::Touch& other) {
  if (one.target != other.target || one.load != other.load ||
      one.joint_rad.size() != other.joint_rad.size())
    return false;
  for (std::size_t i = 0; i < one.joint_rad.size(); ++i)
    if (!(std::abs(one.joint_rad[i] - other.joint_rad[i]) < kSameLineRad)) return false;
  return true;
}

bool same_touches(const Check& one, const Check& other) {
  return std::ranges::equal(one.touches, other.touches, same_line);
}

/// Plausible temperature: rows may come from other programs, and one outlier would distort the chart.
bool is_of_a_cell(double temperature_c) { return temperature_c >= -40.0 && temperature_c <= 80.0; }

std::optional<double> temperature_of(const SessionOptions& options,
                                     const std::vector<calib::Touch>& touches) {
  if (options.temperature_c)
    return is_of_a_cell(*options.temperature_c) ? options.temperature_c : std::nullopt;
  if (touches.empty()) return std::nullopt;
  double sum = 0.0;
  for (const calib::Touch& touch : touches) {
    if (!touch.temperature_c || !is_of_a_cell(*touch.temperature_c)) return std::nullopt;
    sum += *touch.temperature_c;
  }
  return sum / static_cast<double>(touches.size());
}

/// From the outcome in the journal. Without one the check is undecided: its missed touches are unknown.
void apply_outcome(const std::optional<SessionOutcome>& outcome, calib::CheckMeasurement& seen) {
  seen.left_out = calib::LeftOut::kUndecided;
  if (!outcome || outcome->kind == OutcomeKind::kUndecided) return;
  const bool held = outcome->kind == OutcomeKind::kHolds;
  seen.verdict = held ? calib::CheckVerdict::kHolds : calib::CheckVerdict::kDoesNotHold;
  seen.change = outcome->change;
  if (outcome->tcp_shift) {
    seen.tcp_shift_m = outcome->tcp_shift->shift_m.norm();
    seen.u_tcp_shift_m = outcome->tcp_shift->u_m;
  }
  const bool whole = outcome->not_found.empty() && outcome->unsteady.empty();
  const bool of_the_tool =
      held || (outcome->change && outcome->change->kind == calib::ChangeKind::kTool);
  seen.left_out = !whole        ? calib::LeftOut::kIncomplete
                  : of_the_tool ? calib::LeftOut::kNo
                                : calib::LeftOut::kNotTheTool;
}

/// Checks of that calibration, oldest first.
std::vector<Check> checks_of(Journal& journal, const std::vector<SessionRecord>& newest_first,
                             std::int64_t calibrated) {
  std::vector<Check> checks;
  for (const SessionRecord& record : newest_first) {
    if (record.id <= calibrated || checks.size() == kMostChecks) break;
    if (record.state != RecordState::kDone || record.origin) continue;
    try {
      const SessionOptions options = options_from_json(record.inputs.options);
      // After a mastering the arm is not as this calibration has it.
      if (options.kind != SessionKind::kCheck || options.against != calibrated ||
          !options.mastered.empty())
        continue;
      Check check;
      check.touches = journal.touches(record.id);
      check.seen.session = record.id;
      check.seen.time_s = ended_s(record);
      check.seen.temperature_c = temperature_of(options, check.touches);
      apply_outcome(record.outcome, check.seen);
      checks.push_back(std::move(check));
    } catch (const std::runtime_error& error) {
      spdlog::warn("check {} is not in the chart: {}", record.id, error.what());
    }
  }
  std::ranges::reverse(checks);
  return checks;
}

bool complete(const Check& check) {
  return check.seen.left_out != calib::LeftOut::kUndecided &&
         check.seen.left_out != calib::LeftOut::kIncomplete && !check.touches.empty();
}

/// One check of each group with the same touches, the newest group first.
std::vector<const Check*> groups_of(const std::vector<Check>& checks) {
  std::vector<const Check*> groups;
  constexpr std::size_t kMostGroups = 20;
  for (auto check = checks.rbegin(); check != checks.rend() && groups.size() < kMostGroups; ++check)
    if (complete(*check) && std::ranges::none_of(groups, [&](const Check* group) {
          return same_touches(*check, *group);
        }))
      groups.push_back(&*check);
  return groups;
}

/// Measures the checks with the same touches as `like`; the others are left out.
calib::ShiftGauge measure(const calib::Calibration& calibration, const Check& like,
                          std::vector<Check>& checks) {
  const std::vector<calib::Touch> touches = like.touches;
  calib::ShiftGauge gauge(calibration, touches);
  for (Check& check : checks) {
    if (!complete(check)) continue;
    if (!std::ranges::equal(check.touches, touches, same_line)) {
      check.seen.left_out = calib::LeftOut::kOtherTouches;
      continue;
    }
    const auto shift = gauge.measure(check.touches);
    check.seen.shift_m = shift.shift_m;
    check.seen.covariance_m2 = shift.covariance_m2;
    check.off_m = shift.off_m;
  }
  return gauge;
}

/// Compares the checks since the begin of the trend with the earlier ones that raised no alarm.
void find_causes(const calib::ShiftGauge& gauge, const std::vector<Check>& checks,
                 calib::DriftChart& chart) {
  Eigen::VectorXd before = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(gauge.touches()));
  Eigen::VectorXd since = before;
  double n_before = 0.0, n_since = 0.0;
  for (std::size_t k = 0; k < checks.size(); ++k) {
    if (checks[k].seen.left_out != calib::LeftOut::kNo) continue;
    if (checks[k].seen.session >= chart.trend->since) {
      since += checks[k].off_m;
      ++n_since;
    } else if (chart.points[k].state != calib::DriftState::kAlarms) {
      before += checks[k].off_m;
      ++n_before;
    }
  }
  if (!(n_before > 0.0 && n_since > 0.0)) return;
  const double scatter = chart.noise * chart.noise * (1.0 / n_before + 1.0 / n_since);
  chart.trend->causes = gauge.causes(since / n_since - before / n_before, scatter);
}

/// Chart of the checks with the touches of `like`; none: no check counts.
calib::DriftChart chart_of(const calib::Calibration& calibration, const Check* like,
                           std::vector<Check> checks) {
  std::optional<calib::ShiftGauge> gauge;
  if (like != nullptr) gauge = measure(calibration, *like, checks);
  std::vector<calib::CheckMeasurement> seen;
  for (const Check& check : checks) seen.push_back(check.seen);
  calib::DriftChart chart = calib::drift_chart(seen);
  if (gauge && chart.trend) {
    find_causes(*gauge, checks, chart);
    calib::advise(chart);
  }
  return chart;
}

/// None: as of its evidence, as where a clock is of no year of this century (virtual time).
calib::Standing standing_at(const Drift& drift, std::optional<double> now_s) {
  const double calibrated_s = calib::seconds_of(drift.calibrated_at).value_or(0.0);
  const bool ages = calibrated_s >= kYear2001S;
  const calib::CheckMeasurement* decided = drift.chart.newest_decided();
  const double evidence_s = decided != nullptr ? decided->time_s : calibrated_s;
  calib::Standing standing =
      calib::standing_of(drift.chart, calibrated_s, ages ? now_s.value_or(evidence_s) : evidence_s);
  if (!ages) standing.due_s = std::numeric_limits<double>::infinity();
  return standing;
}

/// Chart of all checks of that calibration.
calib::DriftChart chart_of(Journal& journal, const std::vector<SessionRecord>& newest_first,
                           std::int64_t calibrated) {
  const std::vector<Check> checks = checks_of(journal, newest_first, calibrated);
  // By the newest touches; by earlier ones where these alarm or warn and the newest are too few to decide.
  const calib::Calibration calibration = calibration_of(journal, calibrated);
  calib::DriftChart shown = chart_of(calibration, nullptr, checks);
  bool newest = true;
  for (const Check* group : groups_of(checks)) {
    calib::DriftChart chart = chart_of(calibration, group, checks);
    const bool standing =
        chart.state == calib::DriftState::kAlarms || chart.state == calib::DriftState::kWarns;
    const bool says = chart.state != calib::DriftState::kTooFew;
    if (newest || standing) shown = std::move(chart);
    if (says) break;
    newest = false;
  }
  return shown;
}

/// Charts of the calibrations before, so that a change is seen against the checks before it; and the cell's changes since.
void add_history(Journal& journal, const std::vector<SessionRecord>& newest_first, Drift& drift) {
  std::vector<calib::DriftEvent> events = events_of(journal, newest_first, drift.cell);
  std::set<std::int64_t> sessions;
  for (const calib::DriftEvent& event : events) sessions.insert(event.session);
  sessions.erase(drift.calibrated);
  std::int64_t oldest = drift.calibrated;
  for (auto one = sessions.rbegin();
       one != sessions.rend() && drift.chart.others.size() < kMostOtherCharts; ++one)
    try {
      calib::DriftChart chart = chart_of(journal, newest_first, *one);
      const double noise = chart.counted > 0 ? chart.noise : 0.0;
      drift.chart.others.push_back({*one, noise, std::move(chart.points)});
      oldest = std::min(oldest, *one);
    } catch (const std::runtime_error& error) {
      spdlog::warn("no control chart of the calibration of session {}: {}", *one, error.what());
    }
  std::ranges::reverse(drift.chart.others);
  std::erase_if(events, [&](const calib::DriftEvent& event) { return event.session < oldest; });
  drift.chart.events = std::move(events);
}

std::shared_ptr<const Drift> worked_out(Journal& journal,
                                        const std::vector<SessionRecord>& newest_first,
                                        const std::filesystem::path& cell) try {
  const SessionRecord calibrated = published_session(journal, cell, std::nullopt);
  auto drift = std::make_shared<Drift>();
  drift->calibrated = calibrated.id;
  drift->cell = calibrated.inputs.cell_name;
  drift->calibrated_at = calibrated.ended;
  drift->chart = chart_of(journal, newest_first, calibrated.id);
  add_history(journal, newest_first, *drift);
  // As of its evidence: evaluate() compares it with that of the time.
  drift->standing = standing_at(*drift, std::nullopt);
  return drift;
} catch (const NothingToCheck&) {
  return nullptr;
} catch (const calib::IdentifyError& error) {
  spdlog::warn("no control chart: {}", error.what());
  return nullptr;
}

}  // namespace

double DriftWatch::wall_clock_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

std::shared_ptr<const Drift> DriftWatch::evaluate(const std::filesystem::path& cell) {
  const std::vector<SessionRecord> sessions = journal_.sessions();
  std::string of = cell.string() + '\n';
  for (const SessionRecord& record : sessions)
    if (record.state == RecordState::kDone) of += std::to_string(record.id) + ' ';
  // Another calibration may have been activated since.
  for (const Activation& one : journal_.activations()) of += '@' + std::to_string(one.entry);
  const std::lock_guard lock(mutex_);
  if (of != of_) {
    newest_ = worked_out(journal_, sessions, cell);
    of_ = std::move(of);
  }
  if (!newest_) return nullptr;
  const double now_s = now_();
  const calib::Standing standing = standing_at(*newest_, now_s);
  if (standing.holding == newest_->standing.holding) return newest_;
  auto aged = std::make_shared<Drift>(*newest_);
  calib::age(aged->chart, now_s);
  aged->standing = standing;
  return aged;
}

}  // namespace cellcal::daemon
