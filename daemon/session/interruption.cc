// Effects at an interruption and during recovery, until the links are verified.

#include "daemon/session/interruption.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "daemon/session/rules.h"

namespace cellcal::daemon {

namespace {

using drivers::Interruption;
using F = FailureKind;
using enum GoesOn;
constexpr std::nullopt_t kAny = std::nullopt;

// clang-format off
constexpr std::array kHarmless{
InterruptionRule{F::kComputerBusy,      Interruption::kLateReplies,    kRepeats, "the controller runs on and holds the arm; this computer was late"},
InterruptionRule{F::kComputerBusy,      Interruption::kLateBytes,      kRepeats, "the sensor sent in time, by its own stamps; this computer delivered late"},
InterruptionRule{F::kComputerBusy,      kAny, kNever, "no cause is known"},
InterruptionRule{F::kRobotSilent,       Interruption::kPacketsStopped, kRetries, "the arm holds without replies; harmless only if the same RSI session goes on"},
InterruptionRule{F::kRobotSilent,       Interruption::kOther,          kNever, "program ended or stopped, connection closed, watchdog tripped: requires an operator"},
InterruptionRule{F::kRobotSilent,       Interruption::kNone,           kNever, "no cause is known"},
InterruptionRule{F::kNotFollowing,      kAny, kNever, "emergency stop, enabling switch, drives off, collision: a person may be in the cell"},
InterruptionRule{F::kMoveRefused,       kAny, kNever, "the same move would be refused again"},
InterruptionRule{F::kStoppedElsewhere,  kAny, kNever, "stopped by another party"},
InterruptionRule{F::kUnexpectedContact, kAny, kNever, "the arm has met something that is not in the plan"},
InterruptionRule{F::kStillInContact,    kAny, kNever, "the tip may be stuck"},
InterruptionRule{F::kContactTooEarly,   kAny, kNever, "an obstacle is missing in the plan"},
InterruptionRule{F::kContactClosed,     kAny, kNever, "the tip touches something, or the line is shorted"},
InterruptionRule{F::kContactSilent,     Interruption::kUnheard,        kNever,   "cause still unknown: the arm is held until the sensor's time stamps show it, and the row of that cause applies"},
InterruptionRule{F::kContactSilent,     kAny, kNever, "without the sensor no contact is detected"},
InterruptionRule{F::kContactFault,      kAny, kNever, "without the sensor no contact is detected"},
InterruptionRule{F::kArmRefused,        kAny, kNever, "the sensor was already asked twice"},
InterruptionRule{F::kNoContact,         kAny, kNever, "the sphere is not there, or the circuit is dead"},
InterruptionRule{F::kReadingsDisagree,  kAny, kNever, "dirt, a loose sphere or a loose tool remain"},
InterruptionRule{F::kTooManyRevoked,    kAny, kNever, "it was already repeated"},
InterruptionRule{F::kDevice,            kAny, kNever, "a port or address is lost"},
InterruptionRule{F::kLinkNotReady,      kAny, kNever, "already waited for"},
InterruptionRule{F::kTimeout,           kAny, kNever, "the reason is not known"},
InterruptionRule{F::kStopUnconfirmed,   kAny, kNever, "the arm may still move"},
InterruptionRule{F::kJournal,           kAny, kNever, "nothing moves that cannot be recorded"},
InterruptionRule{F::kPlan,              kAny, kNever, "no free path exists"},
InterruptionRule{F::kNotFound,          kAny, kNever, "a person has to measure the position of the sphere"},
InterruptionRule{F::kPlanChanged,       kAny, kNever, "it would be another session"},
InterruptionRule{F::kIdentify,          kAny, kNever, "the same touches give the same answer"},
InterruptionRule{F::kReport,            kAny, kNever, "the disk has to be checked first"},
InterruptionRule{F::kAttended,          kAny, kNever, "a person works at the robot"},
InterruptionRule{F::kControllerTest,    kAny, kNever, "the controller's program is left for its test"},
InterruptionRule{F::kWindowOver,        kAny, kNever, "the time of the schedule is used up"},
InterruptionRule{F::kDaemonStopped,     kAny, kNever, "the daemon ends"},
InterruptionRule{F::kUnexpectedEvent,   kAny, kNever, "the cause is not known"},
};
// clang-format on

}  // namespace

std::span<const InterruptionRule> interruption_rule_table() { return kHarmless; }

GoesOn goes_on(FailureKind failure, Interruption by) {
  const auto row =
      std::find_if(kHarmless.begin(), kHarmless.end(), [&](const InterruptionRule& harm) {
        return harm.failure == failure && (!harm.by || *harm.by == by);
      });
  return row != kHarmless.end() ? row->goes_on : kNever;
}

int InterruptionCounts::total() const { return std::accumulate(of.begin(), of.end(), 0); }

int InterruptionCounts::of_computer() const {
  int late = 0;
  for (std::size_t i = 0; i < of.size(); ++i)
    if (kCountedCauses[i].of_computer) late += of[i];
  return late;
}

void InterruptionCounts::count(Interruption by) {
  for (std::size_t i = 0; i < of.size(); ++i)
    if (kCountedCauses[i].by == by) ++of[i];
}

const char* name_of_cause(Interruption by) {
  for (const CountedCause& one : kCountedCauses)
    if (one.by == by) return one.name;
  return "";
}

std::optional<Interruption> cause_of(std::string_view name) {
  for (const CountedCause& one : kCountedCauses)
    if (one.name == name) return one.by;
  return std::nullopt;
}

calib::Phrase phrase(const InterruptionCounts& counts) {
  calib::Phrase all;
  for (std::size_t i = 0; i < counts.of.size(); ++i)
    if (counts.of[i] > 0)
      all = joined("say.join.comma", all, {kCountedCauses[i].words, {{"n", counts.of[i]}}});
  return all;
}

std::string words(const InterruptionCounts& counts) { return calib::words(phrase(counts)); }

FailureKind failure_by(Interruption by, FailureKind otherwise) {
  const bool late = by == Interruption::kLateReplies || by == Interruption::kLateBytes;
  return late ? FailureKind::kComputerBusy : otherwise;
}

}  // namespace cellcal::daemon

namespace cellcal::daemon::rules {

namespace {

void count_interruption(State& state, FailureKind kind, calib::Phrase detail,
                        drivers::Interruption by) {
  state.interrupted = Failure{kind, std::move(detail), by};
  state.interruptions.count(by);
  if (kind != FailureKind::kComputerBusy) return;
  state.busy_of_touch = repeats_of_touch(state) + 1;
  state.busy_touch = touch_number(state);
}

/// An unexplained silence is counted once its cause is known.
void record_interruption_cause(State& state, const Event& event) {
  const drivers::Interruption by = interruption_by(state, event);
  state.unheard = by == drivers::Interruption::kUnheard;
  const FailureKind kind =
      failure_by(by, state.unheard ? FailureKind::kContactSilent : FailureKind::kRobotSilent);
  calib::Phrase detail = failure_detail(kind, state, event);
  state.late_then = state.links.delivery.late;
  state.silent_then = state.links.delivery.silent;
  if (state.unheard)
    state.interrupted = Failure{kind, std::move(detail), by};
  else
    count_interruption(state, kind, std::move(detail), by);
}

/// From the current position.
ResumePath resume_path(const State& state) {
  if (state.plan->touches.empty()) return ResumePath::kNone;
  // Behind the last touch of a plan no route leads on from the contact.
  const std::size_t made = state.done + (state.phase == Phase::kRecording ? 1 : 0);
  const bool kept = state.phase == Phase::kReferencing || state.phase == Phase::kWatchingTheLinks;
  if (!state.one_by_one && !kept && made < state.plan->touches.size()) return ResumePath::kNone;
  switch (state.phase) {
    case Phase::kArmingFast:  // after noise it is near the surface
      return state.search_from_m > state.approach_m ? ResumePath::kToSearch : ResumePath::kNone;
    case Phase::kFastSearch:
    case Phase::kBackingOff:
    case Phase::kArmingSlow:
    case Phase::kSlowSearch: return ResumePath::kToSearch;
    case Phase::kRecording:
    case Phase::kRetreat:
      return state.one_by_one && state.leads_on ? ResumePath::kNone : ResumePath::kToClear;
    case Phase::kReferencing:
    case Phase::kWatchingTheLinks: return state.resume_path;
    case Phase::kFreeing:  // out of a contact, by the path alone or as a resumed session
      return state.resume_path;
    default: return ResumePath::kNone;
  }
}

void record_interruption(const State& state, Actions& actions) {
  RecordInterruption record{state.interruptions.total() - state.interruptions.of_computer(),
                            state.retries,
                            0,
                            0,
                            describe(*state.interrupted),
                            state.interrupted->by};
  if (state.interrupted->kind == FailureKind::kComputerBusy) {
    record.number = state.interruptions.of_computer();
    record.most = state.repeats.of_session;
    record.of_touch = repeats_of_touch(state);
    record.most_of_touch = state.repeats.of_touch;
  }
  actions.emplace_back(std::move(record));
}

void await_links(State& state, const Event& event) {
  state.busy_until.reset();
  if (state.interrupted->kind == FailureKind::kComputerBusy)
    state.busy_until = event.at + state.timeouts.busy;
  state.deadline = event.at + state.timeouts.recovering;
}

}  // namespace

void interrupt(State& state, const Event& event, Actions& actions) {
  // At the sphere being searched a contact is expected on the first move; elsewhere it is not.
  constexpr Phases kAtTheSphere{Phase::kFreeing,    Phase::kFastSearch, Phase::kBackingOff,
                                Phase::kSlowSearch, Phase::kRecording,  Phase::kRetreat};
  constexpr Phases kBeforeTheFirstMove{Phase::kReferencing, Phase::kRouting,
                                       Phase::kWatchingTheLinks};
  // A retreat that leads on to the next touch counts as at the sphere while in contact.
  const bool gone = state.leads_on && state.phase == Phase::kRetreat && !state.links.in_contact;
  if (!kBeforeTheFirstMove.has(state.phase)) state.resumed = kAtTheSphere.has(state.phase) && !gone;
  state.ahead = {};
  state.resume_path = resume_path(state);
  if (!state.pause_noted) note_pause(state, event, actions);
  if (kMoveResults.has(event.kind())) state.left_rad = event.move().at_rad;
  state.pause_noted = false;
  // Invalidates outstanding answers and held moves.
  state.held.reset();
  ++state.move_id;
  if (++state.arm_id == 0) state.arm_id = 1;
  ++state.route_id;
  if (!state.unheard) record_interruption(state, actions);
  actions.emplace_back(Disarm{});
  await_links(state, event);
}

/// A touch being written to the disk is counted first.
void note_pause(State& state, const Event& event, Actions&) {
  record_interruption_cause(state, event);
  state.pause_noted = true;
  state.left_session = state.links.robot_session;
  state.left_rad = state.links.actual_rad;
}

void interrupt_behind_touch(State& state, const Event& event, Actions& actions) {
  interrupt(state, event, actions);
  ++state.done;
  state.failed_in_a_row = 0;
}

void watch_links(State& state, const Event& event, Actions& actions) {
  state.replies_before = state.links.late;
  state.late_before = state.links.delivery.late;
  state.interruptions_before = state.links.interruptions;
  if (!state.links.in_contact) actions.emplace_back(SelfTest{});
  state.deadline = event.at + state.timeouts.watching;
}

/// The cause of the silence is known: the data were sent in time.
void blame_computer(State& state, const Event& event, Actions& actions) {
  state.unheard = false;
  count_interruption(state, FailureKind::kComputerBusy, state.links.contact_words,
                     drivers::Interruption::kLateBytes);
  record_interruption(state, actions);
  await_links(state, event);
}

void blame_computer_and_watch(State& state, const Event& event, Actions& actions) {
  blame_computer(state, event, actions);
  watch_links(state, event, actions);
}

void blame_computer_and_identify(State& state, const Event& event, Actions& actions) {
  blame_computer(state, event, actions);
  close_and_identify(state, event, actions);
}

void wait_longer(State& state, const Event&, Actions&) { state.deadline = state.busy_until; }

void identify_behind_interruption(State& state, const Event& event, Actions& actions) {
  state.held.reset();
  record_interruption_cause(state, event);
  record_interruption(state, actions);
  close_and_identify(state, event, actions);
}

}  // namespace cellcal::daemon::rules

namespace cellcal::daemon {

namespace {

/// A nearer stand-off that saves less is not worth a move.
constexpr double kShortestApproachM = 0.0005;

/// Mean angles of the axes from `first` up to `end`, as far as there are any.
calib::JointVector mean(const drivers::AxisAngles& a, const drivers::AxisAngles& b,
                        std::size_t first, std::size_t end) {
  calib::JointVector result;
  for (std::size_t i = first; i < end && i < a.size() && i < b.size(); ++i) {
    result.push_back(0.5 * (a[i] + b[i]));
  }
  return result;
}

}  // namespace

drivers::AxisAngles axis_angles(const calib::JointVector& joint_rad,
                                const std::vector<double>& positioner_rad) {
  drivers::AxisAngles all(joint_rad.begin(), joint_rad.end());
  all.insert(all.end(), positioner_rad.begin(), positioner_rad.end());
  return all;
}

calib::JointVector joint_vector(const drivers::AxisAngles& axes_rad) {
  return {axes_rad.begin(), axes_rad.end()};
}

double travel_m(const calib::PlannedTouch& planned, const drivers::AxisAngles& axes_rad) {
  double along = 0.0, length = 0.0;
  for (std::size_t i = 0; i < planned.standoff.size() && i < axes_rad.size(); ++i) {
    const double step = planned.end[i] - planned.standoff[i];
    along += (axes_rad[i] - planned.standoff[i]) * step;
    length += step * step;
  }
  return length > 0.0 ? along / length * planned.search_m : 0.0;
}

drivers::AxisAngles at_travel(const calib::PlannedTouch& planned, double travel_m) {
  const double fraction = travel_m / planned.search_m;
  calib::JointVector result;
  for (std::size_t i = 0; i < planned.standoff.size(); ++i) {
    result.push_back(planned.standoff[i] + fraction * (planned.end[i] - planned.standoff[i]));
  }
  return axis_angles(result, planned.positioner_rad);
}

double approach_m(const calib::PlannedTouch& planned, const calib::ExpectedContact& expected,
                  const TouchPolicy& policy) {
  if (!(expected.sigma_m > 0.0) || planned.may_miss) return 0.0;
  const double before =
      std::max(policy.approach_least_m,
               policy.approach_sigmas * expected.sigma_m + policy.approach_margin_m);
  const double begin =
      std::min(expected.travel_m, planned.expected_m + policy.behind_nominal_m) - before;
  return begin >= kShortestApproachM ? begin : 0.0;  // 0 also for NaN
}

bool is_surprising(const Reading& reading, const calib::ExpectedContact& expected,
                   const TouchPolicy& policy) {
  const double off_m = std::abs(reading.along_m - expected.travel_m);
  const bool off = expected.sigma_m > 0.0 && !(off_m <= policy.surprise_sigmas * expected.sigma_m);
  const bool stamped = reading.time_sigma_s * policy.fast_m_s <= policy.most_stamp_m;
  return off || !stamped || reading.bounces > policy.most_bounces;
}

std::optional<Agreement> find_agreement(std::vector<Reading> readings, const TouchPolicy& policy) {
  const auto needed = static_cast<std::size_t>(policy.readings);
  std::erase_if(readings, [](const Reading& reading) { return !std::isfinite(reading.along_m); });
  if (needed == 0 || readings.size() < needed) return std::nullopt;
  std::stable_sort(readings.begin(), readings.end(),
                   [](const Reading& a, const Reading& b) { return a.along_m < b.along_m; });
  std::size_t best = 0;
  auto spread = [&](std::size_t from) {
    return readings[from + needed - 1].along_m - readings[from].along_m;
  };
  for (std::size_t from = 1; from + needed <= readings.size(); ++from) {
    if (spread(from) < spread(best)) best = from;
  }
  if (spread(best) > policy.tolerance_m) return std::nullopt;
  Agreement result;
  result.spread_m = spread(best);
  const auto first = readings.begin() + static_cast<std::ptrdiff_t>(best);
  result.readings.assign(first, first + static_cast<std::ptrdiff_t>(needed));
  return result;
}

calib::Touch touch_of(const calib::PlannedTouch& planned, const Agreement& agreement,
                      double speed_m_s) {
  const auto& readings = agreement.readings;
  const Reading& low = readings[(readings.size() - 1) / 2];
  const Reading& high = readings[readings.size() / 2];
  calib::Touch touch;
  const std::size_t turning = planned.positioner_rad.size();
  const std::size_t joints = low.contact_rad.size() - std::min(turning, low.contact_rad.size());
  touch.joint_rad = mean(low.contact_rad, high.contact_rad, 0, joints);
  touch.positioner_rad = mean(low.contact_rad, high.contact_rad, joints, joints + turning);
  touch.settled_joint_rad = mean(low.settled_rad, high.settled_rad, 0, joints);
  touch.target = planned.target;
  touch.set = planned.set;
  touch.readings = static_cast<int>(readings.size());
  touch.spread_m = agreement.spread_m;
  touch.speed_m_s = speed_m_s;
  for (const Reading& reading : readings) touch.time = std::max(touch.time, reading.utc);
  return touch;
}

}  // namespace cellcal::daemon
