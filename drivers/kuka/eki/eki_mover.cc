#include "drivers/kuka/eki/eki_mover.h"

#include <algorithm>
#include <cmath>

#include "drivers/units.h"

namespace cellcal::drivers {
namespace {

// A telegram and its confirming state take two of the controller's loops, 40 ms.
constexpr std::chrono::milliseconds kAckLimit{500};
// From the stop telegram to the end of the BRAKE ramp; a KR 5 at full speed takes 0.5 s.
constexpr std::chrono::milliseconds kStopLimit{2000};
// Longer retreats use PTP: LIN deviates from the straight line in joint space that was checked.
constexpr double kLongestLinRad = 10.0 * kRadPerDeg;

// Rest: the means of two successive windows of states agree; 0.1 s each at 50 Hz.
constexpr std::size_t kSettleWindow = 5;
constexpr double kSettledRad = 0.001 * kRadPerDeg;
constexpr std::chrono::milliseconds kSettleLimit{2000};
/// The controller comes to rest at a way-point; its states lag by less.
constexpr double kAtWayPointRad = 2.0 * kRadPerDeg;
constexpr int kAgreeingLatches = 2;

// Grace period of three 12 ms cycles of the controller's input before the search is stopped over
// the network, so that the accurate latch is not lost to a race.
constexpr std::chrono::milliseconds kInputGrace{40};
// Covers a released start key, override 0, and drives switched off without a message.
constexpr std::chrono::milliseconds kStallLimit{2000};
constexpr double kStallRad = 0.002 * kRadPerDeg;

// Plausibility window of a latch around the sensor's time stamp on the measured path: states are
// interpolated over 20 ms of motion and of braking, and stamps are up to 12 ms old.
constexpr double kLatchWindowS = 0.06;
constexpr double kLatchSlackRad = 0.02 * kRadPerDeg;
// Interval over which the search speed is taken from the record.
constexpr double kSpeedSpanS = 0.1;
constexpr double kSecondsPerMs = 1e-3;

}  // namespace

EkiMover::EkiMover(const EkiConfig& config, ContactGuard* guard, const PositionRecord& record)
    : config_(config), record_(record), sensor_(guard) {}

void EkiMover::listen(TimePoint now) {
  const bool guarded = busy() && searching();
  sensor_.listen(now, guarded ? std::optional(move_.arm_id) : std::nullopt);
}

std::optional<Cause> EkiMover::too_fast(const Move& move, const AxisAngles& at_rad) const {
  if (move.kind != MoveKind::kSearch || config_.stop != EkiStop::kFlag) return std::nullopt;
  for (std::size_t i = 0; i < at_rad.size(); ++i) {
    if (axes().linear(i)) continue;  // at rest in a search
    const double speed = move.cruise_s > 0.0
                             ? std::abs(move.target_rad[i] - at_rad[i]) / move.cruise_s * kDegPerRad
                             : config_.limits[i].max_speed_rad_s * kDegPerRad;
    if (speed <= config_.flag_search_limit_deg_s) continue;
    return cause::TooFastForFlag{axes().name(i), speed, config_.flag_search_limit_deg_s};
  }
  return std::nullopt;
}

std::optional<CoreResult> EkiMover::start(const Move& move, const AxisAngles& at_rad,
                                          TimePoint now) {
  if (const auto why = sensor_.refusal(move)) {
    CoreResult refusal = refusal_of(move, why->cause, at_rad, why->outcome);
    sensor_.explain(refusal);
    return refusal;
  }
  if (const auto why = too_fast(move, at_rad)) return refusal_of(move, *why, at_rad);
  const double tolerance_rad = config_.follow_tolerance_deg * kRadPerDeg;
  if (const auto why = object_to_travel(move, config_.limits, at_rad, tolerance_rad))
    return refusal_of(move, *why, at_rad);
  sensor_.begin();
  move_ = move;
  outcome_ = MoveOutcome::kArrived;
  cause_ = cause::None{};
  stop_wanted_ = stop_sent_ = by_input_ = false;
  touched_at_.reset();
  verdict_ = Verdict::kNone;
  contact_.reset();
  open_due_.reset();
  latched_rad_.reset();
  agreeing_latches_ = 0;
  latch_.reset();
  ask(0, at_rad, now);
  return std::nullopt;
}

void EkiMover::ask(std::size_t leg, const AxisAngles& from_rad, TimePoint now) {
  leg_ = leg;
  phase_ = Phase::kAsked;
  asked_at_ = now;
  // At a way-point the arm lags, and may still be on its way to it.
  low_rad_ = high_rad_ = from_rad;
  if (leg > 0) widen(record_.newest().actual_rad);
  widen(leg_target(move_, leg));
  choose_path(from_rad);
}

void EkiMover::widen(const AxisAngles& by_rad) {
  for (std::size_t i = 0; i < by_rad.size(); ++i) {
    low_rad_[i] = std::min(low_rad_[i], by_rad[i]);
    high_rad_[i] = std::max(high_rad_[i], by_rad[i]);
  }
}

/// Never exceeds the requested speed or the limits.
void EkiMover::choose_path(const AxisAngles& at_rad) {
  command_ = EkiCommand{};
  command_.type = EkiType::kMove;
  const AxisAngles& target_rad = leg_target(move_, leg_);
  const WireAxes wire = axes();
  command_.target_deg.resize(target_rad.size());
  for (std::size_t i = 0; i < target_rad.size(); ++i)
    command_.target_deg[wire.place(i)] = wire.shown(i, target_rad[i]);
  for (const double held : unused_) command_.target_deg.push_back(held);
  // A retreat begins in contact; its later legs begin with the contact proven open.
  const bool at_input =
      config_.stop == EkiStop::kInput && (move_.kind != MoveKind::kRetreat || leg_ > 0);
  command_.guard = at_input ? EkiGuard::kInput : EkiGuard::kNone;
  // Rounds down, except for a share that is a whole percentage up to the last bit.
  constexpr double kLastBit = 1e-9;
  const double percent = config_.transit_percent(at_rad, target_rad) * move_.speed_share;
  command_.percent = std::max(1, static_cast<int>(std::floor(percent + kLastBit)));
  if (move_.cruise_s <= 0.0) return;
  const bool straight = searching() || farthest_axis(at_rad, target_rad).rad <= kLongestLinRad;
  double shortest_s = move_.cruise_s, share = 0.0;
  for (std::size_t i = 0; i < at_rad.size(); ++i) {
    const double travel = std::abs(target_rad[i] - at_rad[i]);
    shortest_s = std::max(shortest_s, travel / config_.limits[i].max_speed_rad_s);
    share = std::max(share, travel / (move_.cruise_s * config_.full_speed_rad_s[i]));
  }
  if (straight && move_.kind != MoveKind::kTransit) {
    command_.path = EkiPath::kLin;
    command_.duration_s = shortest_s;
  } else {
    command_.percent = std::clamp(static_cast<int>(std::floor(100.0 * share)), 1, command_.percent);
  }
}

void EkiMover::fail(MoveOutcome outcome, const Cause& cause) {
  outcome_ = outcome;
  cause_ = cause;
}

std::optional<CoreResult> EkiMover::cancel(TimePoint now) {
  // A touch requests the stop without setting the outcome, which the verdict would set after the
  // start.
  if (ends_well()) fail(MoveOutcome::kRefused, cause::TrippedAtStart{});
  if (leg_ == 0) return result(record_.newest().actual_rad);
  begin_settling(now);
  return std::nullopt;
}

CoreResult EkiMover::abandon(const Cause& cause) {
  fail(MoveOutcome::kRobotSilent, cause);
  latch_.reset();
  return result(record_.size() > 0 ? record_.newest().actual_rad : AxisAngles{});
}

CoreResult EkiMover::result(const AxisAngles& at_rad) {
  phase_ = Phase::kIdle;
  CoreResult done;
  done.id = move_.id;
  done.outcome = outcome_;
  done.cause = cause_;
  done.at_rad = at_rad;
  if (outcome_ == MoveOutcome::kContact) done.latch = latch_;
  sensor_.explain(done);
  return done;
}

// ---- during motion -----------------------------------------------------------------------------

std::optional<CoreResult> EkiMover::on_tick(TimePoint now) {
  if (!busy()) return std::nullopt;
  if (searching()) {
    watch_search(now);
  } else {
    watch_other(now);
  }
  if (phase_ == Phase::kAsked && now - asked_at_ > kAckLimit) {
    return abandon(cause::CommandNotTaken{seconds(now - asked_at_)});
  }
  if (under_way() && stop_sent_ && now - stop_sent_at_ > kStopLimit) {
    return abandon(cause::CommandNotTaken{seconds(now - stop_sent_at_)});
  }
  if (phase_ == Phase::kVerdict) await_verdict(now);
  return std::nullopt;
}

std::optional<CoreResult> EkiMover::on_state(const EkiState& state, TimePoint now) {
  if (!busy()) return std::nullopt;
  const bool ours = command_.id != 0 && state.move_id == command_.id;
  if (phase_ == Phase::kAsked && ours) {
    phase_ = Phase::kMoving;
    still_rad_.clear();
  }
  const bool ended = phase_ == Phase::kVerdict || phase_ == Phase::kSettling;
  if (ended && ours && state.progress == EkiProgress::kMoving) withdraw_end();
  if (phase_ == Phase::kMoving) {
    if (state.progress == EkiProgress::kDone && ours) {
      apply_progress_report(state, now);
    } else if (!ours || state.progress == EkiProgress::kIdle) {
      // The program no longer knows the move: it was reset.
      fail(MoveOutcome::kNotFollowing, cause::ProgramAborted{state.fault});
      stop_wanted_ = true;
      begin_settling(now);
    } else {
      watch_motion(state, now);
    }
  }
  if (ours && (phase_ == Phase::kVerdict || phase_ == Phase::kSettling)) note_latch(state);
  if (phase_ == Phase::kSettling) {
    ++settling_states_;
    return settle(now);
  }
  return std::nullopt;
}

// ---- end of motion -----------------------------------------------------------------------------

/// The end was that of a damaged state: the arm is stopped, and its next end counts.
void EkiMover::withdraw_end() {
  phase_ = Phase::kMoving;
  latched_rad_.reset();
  open_due_.reset();
  if (stop_sent_) return;
  fail(MoveOutcome::kNotFollowing, cause::EndWithdrawn{});
  stop_wanted_ = true;
}

/// The states after the end repeat the latch: one that differs is damaged, and the next ones decide.
void EkiMover::note_latch(const EkiState& state) {
  if (state.latch_id != command_.id || state.latch_deg.size() < command_.target_deg.size()) return;
  const AxisAngles latched = axes().inside(state.latch_deg);
  agreeing_latches_ = latched_rad_ && *latched_rad_ == latched ? agreeing_latches_ + 1 : 1;
  latched_rad_ = latched;
}

void EkiMover::apply_progress_report(const EkiState& state, TimePoint now) {
  done_at_ = now;
  begin_settling(now);
  if (!ends_well()) return;
  // A stop that arrived unreadable stops the arm, too: as a missing telegram.
  const bool stopped = state.outcome == EkiOutcome::kDeadMan && stop_sent_;
  const EkiOutcome outcome = stopped ? EkiOutcome::kStop : state.outcome;
  switch (outcome) {
    case EkiOutcome::kSoftLimit: return fail(MoveOutcome::kRefused, cause::OutsideSoftLimits{});
    case EkiOutcome::kNotFeasible:
    case EkiOutcome::kNone: return fail(MoveOutcome::kRefused, cause::NotFeasible{});
    case EkiOutcome::kDeadMan: return fail(MoveOutcome::kRobotSilent, cause::DeadMan{});
    case EkiOutcome::kAborted:
      return fail(MoveOutcome::kNotFollowing, cause::ProgramAborted{state.fault});
    case EkiOutcome::kInputAtStart:
      return searching() ? fail(MoveOutcome::kRefused, cause::InputAtStart{})
                         : fail(MoveOutcome::kUnexpectedContact, cause::TouchedOutsideSearch{});
    case EkiOutcome::kArrived:
    case EkiOutcome::kInput:
    case EkiOutcome::kStop: break;
  }
  if (outcome == EkiOutcome::kArrived && !last_leg()) return on_leg_done(now);
  if (searching()) return on_search_done(outcome, now);
  if (outcome == EkiOutcome::kInput) {
    fail(MoveOutcome::kUnexpectedContact, cause::TouchedOutsideSearch{});
  } else if (outcome == EkiOutcome::kStop) {
    fail(MoveOutcome::kStopped, cause::StopAsked{});
  }
}

/// At a way-point: continues immediately, unless the arm is not there, or a retreat has not opened its contact on its
/// first leg.
void EkiMover::on_leg_done(TimePoint now) {
  const AxisDistance off = farthest_axis(record_.newest().actual_rad, leg_target(move_, leg_));
  if (off.rad > kAtWayPointRad) {
    stop_wanted_ = true;
    return fail(MoveOutcome::kNotFollowing, cause::EndWithdrawn{});
  }
  if (leg_ == 0 && move_.kind == MoveKind::kRetreat && sensor_.present() && !sensor_.opened()) {
    open_due_ = now;  // the sensor's next messages decide whether it is closed
    return fail(MoveOutcome::kContactSilent, cause::OpeningUnheard{});
  }
  ask(leg_ + 1, leg_target(move_, leg_), now);
}

void EkiMover::on_search_done(EkiOutcome outcome, TimePoint now) {
  by_input_ = outcome == EkiOutcome::kInput;
  if (by_input_ || touched_at_) {
    phase_ = Phase::kVerdict;
    await_verdict(now);
  } else if (outcome == EkiOutcome::kStop) {
    fail(MoveOutcome::kStopped, cause::StopAsked{});
  }
}

/// The arm is stopped; the sensor determines the reason.
void EkiMover::await_verdict(TimePoint now) {
  if (verdict_ == Verdict::kContact && contact_->denied_s > 0.0) {
    fail(MoveOutcome::kContactSilent, cause::StampDenied{contact_->denied_s});
  } else if (verdict_ == Verdict::kContact) {
    if (config_.stop == EkiStop::kInput && !by_input_) {
      fail(MoveOutcome::kContactSilent, cause::InputMissed{});
    } else {
      fail(MoveOutcome::kContact, cause::None{});
    }
  } else if (verdict_ == Verdict::kRevoked) {
    fail(MoveOutcome::kRevoked, cause::None{});
  } else if (!sensor_.heard().snapshot.alive) {
    fail(MoveOutcome::kContactSilent, cause::SensorDead{});
  } else if (sensor_.withheld(done_at_, now)) {
    const double waited_s = seconds(now - touched_at_.value_or(done_at_));
    fail(MoveOutcome::kContactSilent,
         touched_at_ ? Cause(cause::TripUnconfirmed{waited_s}) : cause::InputAlone{waited_s});
  } else {
    return;
  }
  begin_settling(now);
}

void EkiMover::begin_settling(TimePoint now) {
  phase_ = Phase::kSettling;
  settling_states_ = 0;
  settling_since_ = now;
}

std::optional<CoreResult> EkiMover::settle(TimePoint now) {
  if (settling_states_ < 2 * kSettleWindow) return std::nullopt;
  const AxisAngles late = record_.mean_actual_rad(0, kSettleWindow);
  const AxisAngles early = record_.mean_actual_rad(kSettleWindow, kSettleWindow);
  const AxisDistance moved = farthest_axis(late, early);
  const AxisDistance largest_deviation = farthest_axis(late, move_.target_rad);
  const std::uint8_t far = largest_deviation.axis;
  const bool at_rest = moved.rad <= kSettledRad;
  const bool latch_open =
      outcome_ == MoveOutcome::kContact && latched_rad_ && agreeing_latches_ < kAgreeingLatches;
  if ((!at_rest || latch_open) && now - settling_since_ < kSettleLimit) return std::nullopt;
  if (ends_well() && largest_deviation.rad > config_.follow_tolerance_deg * kRadPerDeg) {
    fail(MoveOutcome::kNotFollowing,
         cause::NotAtTarget{axes().name(far), axes().shown(far, move_.target_rad[far]),
                            axes().shown(far, late[far])});
  } else if (!at_rest && is<cause::None>(cause_)) {
    fail(outcome_, cause::NotSettled{axes().name(moved.axis), axes().shown(moved.axis, moved.rad),
                                     seconds(now - settling_since_)});
  }
  if (outcome_ == MoveOutcome::kContact)
    if (const auto why = fill_latch(late, now)) fail(MoveOutcome::kContactSilent, *why);
  const bool closed =
      ends_well() && move_.kind == MoveKind::kRetreat && sensor_.heard().snapshot.in_contact;
  if (closed && !open_due_) open_due_ = now;
  if (open_due_ && (closed || !ends_well())) {
    const auto found = sensor_.opening(*open_due_, now);
    if (!found) return std::nullopt;
    fail(found->outcome, found->cause);
  }
  return result(late);
}

/// `now` is the time reference of errors. A latch must match the measured path at the sensor's time
/// stamp; its delay is compensated with the speed before the contact.
std::optional<Cause> EkiMover::fill_latch(const AxisAngles& settled_rad, TimePoint now) {
  if (agreeing_latches_ < kAgreeingLatches) latched_rad_.reset();
  latch_.reset();
  const TimePoint edge = contact_->first_edge;
  const auto path = record_.actual_at(edge, kSecondsPerMs);
  // A time stamp outside the record cannot belong to this contact.
  if (!path) return cause::StampOutside{seconds(now - edge)};
  Latch latch;
  latch.contact_rad = *path;
  latch.settled_rad = settled_rad;
  latch.contact_time = edge;
  latch.time_sigma_s = std::hypot(contact_->time_sigma_s, config_.flag_sigma_s);
  latch.reaction_s = seconds(done_at_ - edge);
  latch.bounces = contact_->bounces;
  if (config_.stop == EkiStop::kFlag) {
    latch_ = latch;
    return std::nullopt;
  }

  if (!latched_rad_) return cause::LatchMissing{};
  const auto before = record_.actual_at(edge - from_seconds(kSpeedSpanS), kSecondsPerMs);
  for (std::size_t i = 0; i < path->size(); ++i) {
    const double latched = (*latched_rad_)[i];
    const double speed = before ? ((*path)[i] - (*before)[i]) / kSpeedSpanS : 0.0;
    const double allowed =
        kLatchSlackRad + std::abs(speed) * (kLatchWindowS + std::abs(config_.latch_delay_s));
    if (std::abs(latched - (*path)[i]) > allowed) {
      return cause::LatchOutOfRange{axes().name(i), axes().shown(i, latched),
                                    axes().shown(i, (*path)[i])};
    }
    latch.contact_rad[i] = latched - speed * config_.latch_delay_s;
  }
  latch.time_sigma_s = config_.latch_jitter_s;
  latch_ = latch;
  return std::nullopt;
}

void EkiMover::watch_search(TimePoint now) {
  const SensorMonitor::Heard& heard = sensor_.heard();
  if (heard.contact) {
    contact_ = heard.contact;
    verdict_ = Verdict::kContact;
  } else if (heard.revoked && verdict_ == Verdict::kNone) {
    verdict_ = Verdict::kRevoked;
  }
  const bool touched =
      heard.trip || heard.trip_lost || heard.contact || heard.revoked || heard.snapshot.in_contact;
  if (touched && !touched_at_) touched_at_ = now;
  if (phase_ == Phase::kSettling && ends_well()) return watch_arrived(now);
  if (!under_way() || !ends_well()) return;
  if (!heard.snapshot.alive) {
    halt(MoveOutcome::kContactSilent, cause::SensorDead{});
  } else if (touched_at_) {
    // Immediately over the network if nothing else stops the arm, or if the trip was noise.
    const bool at_once = config_.stop == EkiStop::kFlag || verdict_ == Verdict::kRevoked;
    if (at_once || now - *touched_at_ > kInputGrace) stop_wanted_ = true;
  } else if (!heard.snapshot.armed || heard.snapshot.arm_id != move_.arm_id) {
    halt(MoveOutcome::kContactSilent, sensor_.loss());
  }
}

/// The controller has arrived; the sensor's message may arrive later.
void EkiMover::watch_arrived(TimePoint now) {
  const ContactSnapshot& sensor = sensor_.heard().snapshot;
  if (touched_at_) {
    done_at_ = now;
    phase_ = Phase::kVerdict;
  } else if (!sensor.alive) {
    fail(MoveOutcome::kContactSilent, cause::SensorDead{});
  } else if (!sensor.armed || sensor.arm_id != move_.arm_id) {
    fail(MoveOutcome::kContactSilent, sensor_.loss());
  }
}

void EkiMover::watch_other(TimePoint now) {
  if (!sensor_.present() || !busy() || !ends_well()) return;
  // Also at rest: without the sensor it is not known whether the contact is open.
  if (!sensor_.heard().snapshot.alive) {
    condemn(MoveOutcome::kContactSilent, cause::SensorDead{}, now);
  } else if ((under_way() || move_.kind == MoveKind::kTransit) &&
             sensor_.touched(move_.kind, now)) {
    condemn(MoveOutcome::kUnexpectedContact, cause::TouchedOutsideSearch{}, now);
  }
}

void EkiMover::watch_motion(const EkiState& state, TimePoint now) {
  const AxisAngles& actual = record_.newest().actual_rad;
  if (still_rad_.size() != actual.size() || farthest_axis(still_rad_, actual).rad > kStallRad) {
    still_rad_ = actual;
    still_since_ = now;
  } else if (now - still_since_ > kStallLimit && ends_well()) {
    halt(MoveOutcome::kNotFollowing,
         cause::NotMoving{seconds(now - still_since_), state.override_percent});
  }
}

void EkiMover::halt(MoveOutcome outcome, const Cause& cause) {
  // Also where the controller has reported the end: one damaged state may have said so.
  if (busy()) stop_wanted_ = true;
  if (under_way() && ends_well()) fail(outcome, cause);
}

void EkiMover::condemn(MoveOutcome outcome, const Cause& cause, TimePoint now) {
  halt(outcome, cause);
  if (under_way() || !busy() || !is<cause::None>(cause_)) return;
  fail(outcome, cause);
  if (phase_ == Phase::kVerdict) begin_settling(now);
}

void EkiMover::stop_sent(TimePoint now) {
  stop_sent_ = true;
  stop_sent_at_ = now;
}

}  // namespace cellcal::drivers
