#include "daemon/unattended/schedule.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "daemon/files/atomic_file.h"
#include "daemon/unattended/decision.h"

namespace cellcal::daemon {

namespace {

/// Smaller steps are clock adjustments by synchronisation.
constexpr double kSetBy_s = 60.0;
/// A relative drift below this is not a step.
constexpr double kSlew = 1e-3;
/// Comparison interval of the wall clock.
constexpr double kMarkFor_s = 3600.0;
/// Synchronisation time after which a stepped wall clock is trusted again.
constexpr std::chrono::minutes kAgreeFor{10};
/// Storage interval of the time already evaluated, which is re-evaluated after a restart.
constexpr UtcSeconds kKeepEvery = 3600;
/// After a long shutdown, older windows are not reported individually.
constexpr UtcSeconds kMostBacklog = 8 * 86400;

/// True for failures that count against `resumes`: the controller's own test does not.
bool counts(const Failure& failure) { return failure.kind != FailureKind::kControllerTest; }

double since_boot_s(Schedule::Steady at) {
  return std::chrono::duration<double>(at.time_since_epoch()).count();
}

}  // namespace

Schedule::Schedule(Parts parts) : parts_(std::move(parts)), started_(parts_.clocks.utc()) {
  // Without an id of the kernel each start counts as a boot; steps of the clock are seen until the next.
  if (parts_.clocks.boot.empty()) parts_.clocks.boot = fmt::format("{:x}", std::random_device{}());
  bool past_known = true;
  try {
    const StoredSchedule stored = parts_.store.load();
    state_ = schedule_state_from(stored.state);
    past_known = stored.newest;
  } catch (const std::exception& damaged) {
    damaged_ = damaged.what();
    spdlog::error("schedule: {}", damaged_);
  }
  kept_ = state_.evaluated_until;
  if (state_.evaluated_until == 0) state_.evaluated_until = started_;
  state_.evaluated_until = std::max(state_.evaluated_until, started_ - kMostBacklog);
  const Inputs inputs = read_inputs();
  aborts_seen_ = inputs.cell.aborts;
  notice_clock(inputs);
  if (!past_known) {
    state_.hold_from({inputs.cell.session, Why::kPastUnknown});
    report_held(inputs, Why::kPastUnknown, 0.0);
  }
  report_left(inputs);
  show(inputs);
}

Schedule::Inputs Schedule::read_inputs() {
  return {parts_.config(), parts_.clocks.utc(), parts_.clocks.steady(), parts_.cell.standing()};
}

void Schedule::update() {
  const std::lock_guard lock(deciding_);
  Inputs inputs = read_inputs();
  notice_clock(inputs);
  notice_ends(inputs);
  follow(inputs);
  const UtcSeconds since =
      std::clamp(state_.evaluated_until, inputs.now - kMostBacklog, inputs.now);
  for (const ScheduledSession& entry : inputs.config.sessions) {
    const auto [known, is_new] = state_.known.try_emplace(entry.name, inputs.now);
    // Otherwise an entry first seen while the clock was ahead would not run until that date.
    const bool ahead = !state_.clock_doubt && known->second > inputs.now;
    if (ahead) known->second = inputs.now;
    dirty_ |= is_new || ahead;
    if (entry.on_request) continue;
    for (const Window& window : windows_between(entry.window, since, inputs.now))
      decide(inputs, entry, window);
  }
  state_.evaluated_until = inputs.now;
  if (dirty_ || inputs.now - kept_ >= kKeepEvery) keep();
  show(inputs);
}

void Schedule::notice_clock(const Inputs& inputs) {
  clock_set_ = false;
  const ClockMark now{parts_.clocks.boot, inputs.now, since_boot_s(inputs.steady)};
  if (now.boot != state_.clock.boot) {
    state_.clock = now;
    if (now.utc < state_.evaluated_until - static_cast<UtcSeconds>(kSetBy_s))
      doubt_clock(inputs, Why::kClockStepped,
                  static_cast<double>(now.utc - state_.evaluated_until));
    else if (!parts_.clocks.synchronised())
      doubt_clock(inputs, Why::kClockNotSynchronised, 0.0);
  } else {
    const double passed_s = now.since_boot_s - state_.clock.since_boot_s;
    const double set_by_s = static_cast<double>(now.utc - state_.clock.utc) - passed_s;
    if (std::abs(set_by_s) >= kSetBy_s + kSlew * passed_s) {
      clock_set_ = set_by_s > 0.0;
      state_.clock = now;
      doubt_clock(inputs, Why::kClockStepped, set_by_s);
    } else if (passed_s >= kMarkFor_s) {
      state_.clock = now;
    }
  }
  restore_clock_trust(inputs);
}

/// Once, also without a schedule: the operator may be absent.
void Schedule::report_left(const Inputs& inputs) {
  if (inputs.cell.state != Standing::State::kInterrupted || state_.left == inputs.cell.end) return;
  state_.left = inputs.cell.end;
  report({.at = inputs.now,
          .verb = Verb::kHeld,
          .why = Why::kInterruptedBefore,
          .session = inputs.cell.session});
}

bool Schedule::trusts_clock() {
  const std::lock_guard lock(deciding_);
  notice_clock(read_inputs());
  return !state_.clock_doubt;
}

void Schedule::doubt_clock(const Inputs& inputs, Why why, double set_by_s) {
  state_.clock_doubt = ClockDoubt{why, set_by_s};
  agrees_since_.reset();
  report_held(inputs, why, set_by_s);
}

void Schedule::report_held(const Inputs& inputs, Why why, double figure_s) {
  dirty_ = true;
  if (!inputs.config.unattended) return;  // time-based sessions are disabled
  report({.at = inputs.now, .verb = Verb::kHeld, .why = why, .figure_s = figure_s});
}

void Schedule::restore_clock_trust(const Inputs& inputs) {
  if (!state_.clock_doubt) return;
  if (!parts_.clocks.synchronised()) {
    agrees_since_.reset();
    return;
  }
  if (!agrees_since_) agrees_since_ = inputs.steady;
  if (inputs.steady - *agrees_since_ < kAgreeFor) return;
  state_.clock_doubt.reset();
  dirty_ = true;
  report({.at = inputs.now,
          .verb = Verb::kReleased,
          .why = Why::kClockAgrees,
          .figure_s = std::chrono::duration<double>(kAgreeFor).count()});
}

/// Evaluates the newest end for the sessions that may follow.
void Schedule::notice_ends(const Inputs& inputs) {
  const Standing& cell = inputs.cell;
  if (cell.aborts != aborts_seen_) {
    aborts_seen_ = cell.aborts;
    state_.hold_from({cell.session, Why::kAbortedBefore});
    dirty_ = true;
  }
  if (cell.busy) {
    // Its future end differs from the inspected one.
    if (!state_.released.empty() || !state_.left.empty()) dirty_ = true;
    state_.released.clear();
    state_.left.clear();
    return;
  }
  const bool newer = state_.hold && cell.session > state_.hold->session;
  if (newer && cell.state == Standing::State::kDone) {
    state_.hold.reset();
    dirty_ = true;
  }
  if (aftermath(cell.failure.kind, cell.failure.by).begin && state_.harmless != cell.end) {
    state_.harmless = cell.end;
    dirty_ = true;
  }
}

Why Schedule::held(const Inputs& inputs, Decision& why) const {
  const Standing& cell = inputs.cell;
  if (inputs.config.unattended && inputs.config.program_start == ProgramStart::kNone)
    return Why::kNoProgramStart;
  if (state_.clock_doubt && inputs.config.unattended) {
    why.figure_s = state_.clock_doubt->set_by_s;
    return state_.clock_doubt->why;
  }
  why.session = cell.session;
  using State = Standing::State;
  if (!state_.released.empty() && state_.released == cell.end) return Why::kNothing;
  if (cell.state == State::kAborted && state_.harmless != cell.end) return Why::kAbortedBefore;
  if (state_.hold) {
    why.session = 0;
    return state_.hold->why;
  }
  if (cell.state == State::kInterrupted) return Why::kInterruptedBefore;
  if (cell.state != State::kFailed || state_.harmless == cell.end) return Why::kNothing;
  why.detail = phrase(cell.failure);
  return Why::kFailedBefore;
}

Decision Schedule::of(const Inputs& inputs, const ScheduledSession& entry,
                      const Window& window) const {
  return {.at = inputs.now, .entry = entry.name, .day = to_string(window.day)};
}

const Decision* Schedule::newest(const std::string& entry, const std::string& day) const {
  const auto found =
      std::find_if(state_.decisions.rbegin(), state_.decisions.rend(),
                   [&](const Decision& d) { return d.entry == entry && d.day == day; });
  return found != state_.decisions.rend() ? &*found : nullptr;
}

void Schedule::decide(const Inputs& inputs, const ScheduledSession& entry, const Window& window) {
  const std::string day = to_string(window.day);
  if (window.ends <= state_.known.at(entry.name)) return;
  if (window.has(inputs.now)) state_.reopen_missed(entry.name, day);
  if (state_.is_closed(entry.name, day)) return;
  Decision decision = of(inputs, entry, window);
  if (!window.exists() || window.ends <= inputs.now) {
    decision.verb = Verb::kMissed;
    decision.why = over(entry, window);
    if (const Decision* last = newest(entry.name, day); last && decision.why == last->why) {
      decision.session = last->session;
      decision.detail = last->detail;
      decision.figure_s = last->figure_s;
    }
    close(entry, window, std::move(decision));
    return;
  }
  decision.why = obstacle(inputs, entry, window, decision);
  if (decision.why == Why::kNoTimeLeft) {
    decision.verb = Verb::kRefused;
    close(entry, window, std::move(decision));
  } else if (decision.why != Why::kNothing) {
    decision.verb = Verb::kWaiting;
    report(std::move(decision));
  } else {
    begin(inputs, entry, window);
  }
}

void Schedule::close(const ScheduledSession& entry, const Window& window, Decision decision) {
  state_.close(entry.name, to_string(window.day), decision.verb == Verb::kMissed);
  dirty_ = true;
  report(std::move(decision));
}

/// Reason why nothing began in a past window.
Why Schedule::over(const ScheduledSession& entry, const Window& window) const {
  if (!window.exists()) return Why::kNoSuchTime;
  const Decision* last = newest(entry.name, to_string(window.day));
  if (last != nullptr && last->verb == Verb::kWaiting) return last->why;
  return clock_set_ || window.begins > started_ ? Why::kClockSet : Why::kDaemonNotRunning;
}

Why Schedule::obstacle(const Inputs& inputs, const ScheduledSession& entry, const Window& window,
                       Decision& why) {
  if (!damaged_.empty()) {
    why.detail = damaged_;
    return Why::kNotOnDisk;
  }
  if (!inputs.config.unattended) return Why::kUnattendedOff;
  if (inputs.cell.busy || own_) return Why::kBusy;
  if (const Why block = held(inputs, why); block != Why::kNothing) return block;
  why.session = 0;
  why.figure_s = entry.minutes ? *entry.minutes * 60.0 : parts_.cell.foreseen_s(entry);
  const auto left = static_cast<double>(window.ends - inputs.now);
  return why.figure_s > left ? Why::kNoTimeLeft : Why::kNothing;
}

std::string Schedule::by(const ScheduleConfig& config, const ScheduledSession& entry) const {
  return printable(
      fmt::format("without a person, by schedule '{}'; responsible for the clear cell: {}",
                  entry.name, config.responsible));
}

/// Recorded first: killed in between, the window is lost instead of repeated.
Decision Schedule::begin(const Inputs& inputs, const ScheduledSession& entry,
                         const Window& window) {
  const ScheduleState before = state_;
  Decision decision = of(inputs, entry, window);
  if (!entry.on_request) state_.close(entry.name, decision.day, false);
  if (!keep()) {
    state_ = before;
    decision.verb = Verb::kWaiting;
    decision.why = Why::kNotOnDisk;
    decision.detail = disk_;
    report(decision);
    return decision;
  }
  try {
    decision.session = parts_.cell.begin(entry, by(inputs.config, entry), inputs.cell.aborts);
    decision.verb = Verb::kBegun;
    own_ = Own{.session = decision.session,
               .entry = entry,
               .window = window,
               .ends = inputs.steady + std::chrono::seconds(window.ends - inputs.now),
               .resume_at = {}};
  } catch (const NotNow& busy) {
    state_.closed = before.closed;
    decision.verb = Verb::kWaiting;
    decision.why = Why::kBusy;
  } catch (const std::exception& wrong) {
    decision.verb = Verb::kRefused;
    decision.why = Why::kCannotBegin;
    decision.detail = wrong.what();
  }
  dirty_ = true;
  report(decision);
  return decision;
}

void Schedule::follow(const Inputs& inputs) {
  if (!own_) return;
  if (inputs.cell.session != own_->session) {
    own_.reset();  // another session was begun by a person
    return;
  }
  if (!inputs.cell.busy) return follow_end(inputs);
  own_->resume_at.reset();
  const bool lasts = inputs.now < own_->window.ends && inputs.steady < own_->ends;
  if (lasts || own_->stopped) return;
  own_->stopped = true;
  Decision decision = of(inputs, own_->entry, own_->window);
  decision.verb = Verb::kStopped;
  decision.why = Why::kWindowOver;
  decision.session = own_->session;
  report(std::move(decision));
  parts_.cell.stop();
}

void Schedule::follow_end(const Inputs& inputs) {
  if (own_->resume_at) return resume(inputs);
  const Standing& cell = inputs.cell;
  Decision decision = of(inputs, own_->entry, own_->window);
  decision.verb = Verb::kEnded;
  decision.session = own_->session;
  const bool failed = cell.state == Standing::State::kFailed;
  if (failed) decision.detail = phrase(cell.failure);
  const bool may = failed && aftermath(cell.failure.kind, cell.failure.by).resume;
  if (own_->stopped && cell.state == Standing::State::kAborted) {
    own_.reset();
    return;
  }
  if (cell.state == Standing::State::kDone) {
    decision.why = Why::kDone;
  } else if (!failed) {
    decision.why = Why::kAbortedBefore;
  } else if (!may || own_->stopped) {
    decision.why = Why::kHarmful;
  } else if (counts(cell.failure) && own_->resumes >= inputs.config.resumes) {
    decision.why = inputs.config.resumes > 0 ? Why::kResumesUsed : Why::kHarmless;
  } else {
    const std::chrono::duration<double> wait(inputs.config.resume_wait_s);
    own_->resume_at = inputs.steady + std::chrono::duration_cast<Steady::duration>(wait);
    decision.verb = Verb::kWaiting;
    decision.why = Why::kHarmless;
    report(std::move(decision));
    return;
  }
  own_.reset();
  report(std::move(decision));
}

/// Resumes as an operator would, where a new session could begin.
void Schedule::resume(const Inputs& inputs) {
  Decision decision = of(inputs, own_->entry, own_->window);
  decision.session = own_->session;
  decision.verb = Verb::kEnded;
  const ScheduledSession& entry = own_->entry;
  const double whole_s = entry.minutes ? *entry.minutes * 60.0 : parts_.cell.foreseen_s(entry);
  decision.figure_s = whole_s * inputs.cell.left_share;
  if (!inputs.config.unattended) {
    decision.why = Why::kUnattendedOff;
  } else if (inputs.config.program_start == ProgramStart::kNone) {
    decision.why = Why::kNoProgramStart;
  } else if (counts(inputs.cell.failure) && own_->resumes >= inputs.config.resumes) {
    decision.why = Why::kResumesUsed;
  } else if (state_.clock_doubt) {
    decision.why = state_.clock_doubt->why;
  } else if (state_.hold) {
    decision.why = state_.hold->why;
  } else if (static_cast<double>(inputs.now) + decision.figure_s >
             static_cast<double>(own_->window.ends)) {
    decision.why = Why::kNoTimeLeft;
  } else if (inputs.steady < *own_->resume_at) {
    return;
  }
  if (decision.why != Why::kNothing) {
    own_.reset();
    report(std::move(decision));
    return;
  }
  try {
    parts_.cell.resume(by(inputs.config, entry), inputs.cell.aborts);
    if (counts(inputs.cell.failure)) ++own_->resumes;
    own_->resume_at.reset();
    decision.verb = Verb::kResumed;
  } catch (const NotNow&) {
    return;  // retried in the next pass
  } catch (const std::exception& wrong) {
    decision.why = Why::kCannotBegin;
    decision.detail = wrong.what();
    own_.reset();
  }
  report(std::move(decision));
}

Decision Schedule::begin(const std::string& name) {
  const std::lock_guard lock(deciding_);
  Inputs inputs = read_inputs();
  notice_clock(inputs);
  notice_ends(inputs);
  follow(inputs);
  const auto entry =
      std::find_if(inputs.config.sessions.begin(), inputs.config.sessions.end(),
                   [&](const ScheduledSession& one) { return one.name == name && one.on_request; });
  Decision decision{.at = inputs.now, .verb = Verb::kRefused};
  if (entry == inputs.config.sessions.end()) {
    decision.why = Why::kCannotBegin;
    decision.detail = "say.schedule.no_such";
    return decision;
  }
  decision.entry = entry->name;
  decision.why = Why::kOutsideWindow;
  for (const Window& window : windows_between(entry->window, inputs.now, inputs.now)) {
    if (!window.has(inputs.now)) continue;
    decision.day = to_string(window.day);
    decision.why = obstacle(inputs, *entry, window, decision);
    if (decision.why == Why::kNothing) {
      decision = begin(inputs, *entry, window);
      keep();
      show(inputs);
      return decision;
    }
  }
  report(decision);
  keep();
  show(inputs);
  return decision;
}

Decision Schedule::release(const std::string& by) {
  const std::lock_guard lock(deciding_);
  const Inputs inputs = read_inputs();
  Decision decision{
      .at = inputs.now, .verb = Verb::kReleased, .detail = {"say.schedule.by", {{"who", by}}}};
  if (inputs.cell.busy) {
    decision.verb = Verb::kRefused;
    decision.why = Why::kBusy;
    return decision;
  }
  state_.hold.reset();
  state_.clock_doubt.reset();
  state_.released = inputs.cell.end;
  aborts_seen_ = inputs.cell.aborts;
  report(decision);
  keep();
  show(inputs);
  return decision;
}

/// Reports each decision once, not in every pass.
void Schedule::report(Decision decision) {
  const Decision* last = newest(decision.entry, decision.day);
  const bool again = last != nullptr && decision.verb == Verb::kWaiting &&
                     last->verb == decision.verb && last->why == decision.why &&
                     last->session == decision.session && last->detail == decision.detail;
  if (again) return;
  spdlog::info("schedule{}{}: {}", decision.entry.empty() ? "" : " ", decision.entry,
               words(decision));
  state_.add(decision);
  dirty_ = true;
  if (parts_.on_decision) parts_.on_decision(decision);
}

/// False: disk_ contains the reason.
bool Schedule::keep() {
  if (!damaged_.empty()) return false;
  try {
    parts_.store.save(to_text(state_));
    kept_ = state_.evaluated_until;
    dirty_ = false;
    disk_.clear();
    return true;
  } catch (const std::exception& failed) {
    if (disk_ != failed.what()) spdlog::error("schedule: {}", failed.what());
    disk_ = failed.what();
    return false;
  }
}

/// A session of the entry may begin in the window that lasts, or be resumed.
bool Schedule::may_begin_in(const ScheduledSession& entry, const Window& window) const {
  const bool resumed = own_ && own_->entry.name == entry.name && own_->window == window;
  return resumed || !state_.is_closed(entry.name, to_string(window.day), true);
}

ScheduleSeen Schedule::seen(const SchedulePicture& picture) const {
  ScheduleSeen seen;
  if (!picture.unattended || picture.entries.empty()) return seen;
  seen.held = picture.held_words;
  const bool by_clock =  // releases itself
      picture.held == Why::kClockStepped || picture.held == Why::kClockNotSynchronised;
  if (picture.held != Why::kNothing && !by_clock) return seen;
  seen.open = own_.has_value();
  for (const SchedulePicture::Entry& entry : picture.entries) {
    if (entry.session.on_request) continue;
    seen.open |= entry.now.exists();
    if (entry.next.exists())
      seen.next_utc_s = std::min(seen.next_utc_s.value_or(entry.next.begins), entry.next.begins);
  }
  return seen;
}

void Schedule::show(const Inputs& inputs) {
  SchedulePicture picture;
  picture.unattended = inputs.config.unattended;
  picture.responsible = inputs.config.responsible;
  picture.resumes = inputs.config.resumes;
  Decision why{.verb = Verb::kHeld};
  if (!inputs.cell.busy) why.why = held(inputs, why);
  picture.held = why.why;
  if (why.why != Why::kNothing) picture.held_words = phrase(why);
  for (const ScheduledSession& session : inputs.config.sessions) {
    SchedulePicture::Entry entry{session, {}, next_window(session.window, inputs.now), 0.0, {}};
    for (const Window& window : windows_between(session.window, inputs.now, inputs.now))
      if (window.has(inputs.now) && may_begin_in(session, window)) entry.now = window;
    entry.foreseen_s = session.minutes ? *session.minutes * 60.0 : parts_.cell.foreseen_s(session);
    const auto last = std::find_if(state_.decisions.rbegin(), state_.decisions.rend(),
                                   [&](const Decision& d) { return d.entry == session.name; });
    if (last != state_.decisions.rend()) entry.last = *last;
    picture.entries.push_back(std::move(entry));
  }
  picture.decisions.assign(state_.decisions.rbegin(), state_.decisions.rend());
  parts_.cell.show(seen(picture));
  const std::lock_guard lock(showing_);
  picture_ = std::move(picture);
}

SchedulePicture Schedule::picture() const {
  const std::lock_guard lock(showing_);
  return picture_;
}

}  // namespace cellcal::daemon
