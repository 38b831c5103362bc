#include "drivers/kuka/rsi/rsi_mover.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "drivers/kuka/moves/move_queue.h"
#include "drivers/units.h"

namespace cellcal::drivers {
namespace {

// Rest: the means of two successive windows of AIPos agree. Means, so that encoder noise of 0.0005
// deg does not prevent detection; 48 ms, longer than the lag of a KRC4.
constexpr double kSettleWindowS = 0.048;
constexpr int kSettleFewest = 4;
constexpr double kSettledRad = 0.0005 * kRadPerDeg;
constexpr double kSettleLimitS = 1.0;

void rest_at_way_points(Move& move) {
  for (Via& via : move.via) via.in_share = via.out_share = 0.0;
}

int settle_window(double cycle_s) {
  const int cycles = static_cast<int>(std::ceil(kSettleWindowS / cycle_s));
  return std::clamp(cycles, kSettleFewest, static_cast<int>(PositionRecord::kDepth / 4));
}

using Limits = boost::container::static_vector<AxisLimit, kMaxAxes>;

Limits slowed(std::span<const AxisLimit> limits, double speed_share) {
  Limits slow(limits.begin(), limits.end());
  for (AxisLimit& limit : slow) limit.max_speed_rad_s *= speed_share;
  return slow;
}

/// Axes that a leg of the move leads elsewhere; a smaller difference is the rest of the preceding move.
std::bitset<kMaxAxes> driven_by(const Move& move, const AxisAngles& from_rad,
                                double tolerance_rad) {
  std::bitset<kMaxAxes> driven;
  for (std::size_t leg = 0; leg < leg_count(move); ++leg)
    for (std::size_t i = 0; i < from_rad.size(); ++i)
      if (std::abs(leg_target(move, leg)[i] - from_rad[i]) > tolerance_rad) driven.set(i);
  return driven;
}

constexpr std::size_t kParts = 4;
// Between quarters of half a second each: programs that sleep lose 1 % and more, 5 ms; two quartzes
// 0.1 ms.
constexpr double kKeepsTimeS = 0.002;

/// Earliest arrival relative to the counter in each quarter of the record [s], the newest first.
std::array<double, kParts> earliest_s(const PositionRecord& record, double seconds_per_count) {
  const PositionRecord::Sample& last = record.newest();
  std::array<double, kParts> earliest;
  earliest.fill(std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < record.size(); ++i) {
    const PositionRecord::Sample& sample = record.newest(i);
    // IPOC wraps: only differences are meaningful.
    const auto counts = static_cast<std::int32_t>(sample.ipoc - last.ipoc);
    double& least_s = earliest[i * kParts / record.size()];
    least_s = std::min(least_s, seconds(sample.t_rx - last.t_rx) - counts * seconds_per_count);
  }
  return earliest;
}

/// A single step between quarters is caused by the network; a peer that lags in most of them has no
/// clock.
bool keeps_time(const std::array<double, kParts>& earliest) {
  std::array<double, kParts - 1> steps{};
  for (std::size_t i = 0; i < steps.size(); ++i) steps[i] = std::abs(earliest[i] - earliest[i + 1]);
  std::sort(steps.begin(), steps.end());
  return steps[steps.size() / 2] <= kKeepsTimeS;
}

std::optional<AnglesAt> by_arrival(const PositionRecord& record, TimePoint t) {
  if (record.size() < 2 || t > record.newest().t_rx) return std::nullopt;
  std::size_t before = 1;
  while (before < record.size() && record.newest(before).t_rx > t) ++before;
  if (before == record.size()) return std::nullopt;
  const auto interval_s = [&](std::size_t i) {  // from the preceding packet to packet i
    if (i + 1 >= record.size()) return 0.0;
    return seconds(record.newest(i).t_rx - record.newest(i + 1).t_rx);
  };
  const std::size_t after = before - 1;
  const double between_s = interval_s(after);
  const double u = between_s > 0.0 ? seconds(t - record.newest(before).t_rx) / between_s : 0.0;
  AnglesAt found{record.newest(before).actual_rad, 0.0};
  for (std::size_t i = 0; i < found.actual_rad.size(); ++i) {
    found.actual_rad[i] += u * (record.newest(after).actual_rad[i] - found.actual_rad[i]);
  }
  // Late processing of a packet lengthens the interval before it, or the one after it.
  const double longest_s =
      std::max({between_s, interval_s(before), after > 0 ? interval_s(after - 1) : 0.0});
  found.time_sigma_s = longest_s / std::sqrt(3.0);
  return found;
}

}  // namespace

Mover::Mover(const RsiConfig& config, ContactGuard* guard, const PositionRecord& record)
    : config_(config),
      record_(record),
      guard_(guard),
      sensor_(guard),
      input_(!config.contact_tag.empty()) {}

void Mover::listen(TimePoint now, std::optional<bool> input_on) {
  const bool guarded = busy() && searching();
  input_.note(input_on, now);
  if (guard_ != nullptr)
    guard_->set_silence_limit(input_.follows() ? Duration(kInputWatchLimit) : kHeartbeatLimit);
  sensor_.listen(now, guarded ? std::optional(move_.arm_id) : std::nullopt,
                 {input_.contact(), input_.follows()});
}

std::optional<CoreResult> Mover::start(const Move& move, const AxisAngles& commanded_rad) {
  if (const auto why = sensor_.refusal(move)) {
    CoreResult refusal = refusal_of(move, why->cause, commanded_rad, why->outcome);
    sensor_.explain(refusal);
    return refusal;
  }
  const double tolerance_rad = config_.follow_tolerance_deg * kRadPerDeg;
  if (const auto why = object_to_travel(move, config_.limits, commanded_rad, tolerance_rad))
    return refusal_of(move, *why, commanded_rad);
  sensor_.begin();
  move_ = move;
  driven_ = driven_by(move, commanded_rad, tolerance_rad);
  if (config_.space.on) rest_at_way_points(move_);
  const Limits limits = slowed(config_.limits, move.speed_share);
  path_ = PathMove(commanded_rad, move.target_rad, {limits.data(), limits.size()}, move.cruise_s,
                   move_.via);
  const bool on_a_first_leg = move.kind == MoveKind::kRetreat && !move.via.empty();
  open_by_s_ = on_a_first_leg ? path_.first_leg_s() : HUGE_VAL;
  open_due_.reset();
  t_s_ = 0.0;
  in_motion_ = true;
  braking_ = false;
  phase_ = Phase::kTravelling;
  outcome_ = MoveOutcome::kArrived;
  cause_ = cause::None{};
  contact_.reset();
  latch_.reset();
  settling_s_ = 0.0;
  settling_cycles_ = 0;
  before_rad_ = commanded_rad;
  taken_ = true;
  by_input_ = false;
  return std::nullopt;
}

CoreResult Mover::abandon(const Cause& cause, MoveOutcome outcome) {
  if (outcome_ != MoveOutcome::kRobotSilent) {  // otherwise already stopped for a similar reason
    outcome_ = outcome;
    cause_ = cause;
  }
  contact_.reset();
  return result(record_.size() > 0 ? record_.newest().commanded_rad : AxisAngles{});
}

CoreResult Mover::result(const AxisAngles& commanded_rad) {
  phase_ = Phase::kIdle;
  CoreResult done;
  done.id = move_.id;
  done.outcome = outcome_;
  done.cause = cause_;
  done.ipoc = record_.size() > 0 ? record_.newest().ipoc : 0;
  done.at_rad = commanded_rad;
  done.latch = latch_;
  sensor_.explain(done);
  return done;
}

std::optional<CoreResult> Mover::step(const MoverCycle& cycle, AxisAngles& commanded_rad) {
  cycle_s_ = cycle.cycle_s;
  if (!busy()) return std::nullopt;
  if (searching()) {
    if (ends_well() && phase_ != Phase::kVerdict) watch_search(cycle.now);
    if (phase_ == Phase::kVerdict) await_verdict(cycle.now);
  } else if (ends_well()) {
    watch_other(cycle);
  }
  if (!cycle.advance) return std::nullopt;
  taken_ = taken_ || cycle.taken;
  if (in_motion_ && cycle.sound) watch_following(cycle);
  if (in_motion_ && !cycle.heard) {  // the arm rests
    const double at_s = taken_ ? t_s_ : before_s_;
    hold(commanded_rad);
    in_motion_ = !braking_;
    if (braking_) return std::nullopt;
    path_.start_at(at_s);
    t_s_ = before_s_ = 0.0;
    if (std::isfinite(open_by_s_)) open_by_s_ = path_.first_leg_s();
    return std::nullopt;
  }
  if (!in_motion_ && !ends_well()) hold(commanded_rad);
  if (in_motion_) {
    before_rad_ = commanded_rad;
    before_s_ = t_s_;
    taken_ = false;
    t_s_ += cycle.cycle_s;
    commanded_rad = path_.at(t_s_);
    in_motion_ = t_s_ < path_.duration_s();
    if (!in_motion_ && phase_ == Phase::kTravelling) phase_ = Phase::kSettling;
    return std::nullopt;
  }
  if (phase_ == Phase::kSettling && cycle.sound) return settle(cycle, commanded_rad);
  return std::nullopt;
}

void Mover::hold(AxisAngles& commanded_rad) {
  if (!taken_) commanded_rad = before_rad_;
  taken_ = true;
}

bool Mover::needs_rest() const {
  if (!ends_well() || move_.kind == MoveKind::kSearch) return true;
  return move_.kind == MoveKind::kRetreat && sensor_.heard().touching();
}

std::optional<CoreResult> Mover::settle(const MoverCycle& cycle, const AxisAngles& commanded_rad) {
  settling_s_ += cycle.cycle_s;
  ++settling_cycles_;
  const int window = settle_window(cycle.cycle_s);
  if (settling_cycles_ < (needs_rest() ? 2 : 1) * window) return std::nullopt;
  const auto count = static_cast<std::size_t>(window);
  const AxisAngles late = record_.mean_actual_rad(0, count);
  const AxisAngles early = record_.mean_actual_rad(count, count);
  const AxisDistance moved = farthest_axis(late, early);
  const AxisDistance largest_deviation = farthest_axis(late, commanded_rad);
  const bool at_rest = !needs_rest() || moved.rad <= kSettledRad;
  const bool followed = largest_deviation.rad <= config_.follow_tolerance_deg * kRadPerDeg;
  const bool time_is_up = settling_s_ >= kSettleLimitS;
  // After an arrival the position must match the command; after a stop rest is sufficient.
  if (!time_is_up && !(at_rest && (followed || !ends_well()))) return std::nullopt;
  if (ends_well() && !followed) {
    outcome_ = MoveOutcome::kNotFollowing;
    const std::uint8_t far = largest_deviation.axis;
    cause_ = cause::AxisNotFollowing{axes().name(far), axes().shown(far, commanded_rad[far]),
                                     axes().shown(far, late[far])};
  } else if (!at_rest && is<cause::None>(cause_)) {
    cause_ = cause::NotSettled{axes().name(moved.axis), axes().shown(moved.axis, moved.rad),
                               settling_s_};
  }
  if (outcome_ == MoveOutcome::kContact) fill_latch(cycle, late);
  if (!opening_known(cycle)) return std::nullopt;
  judge_input();
  return result(commanded_rad);
}

void Mover::judge_input() {
  if (outcome_ == MoveOutcome::kContact) input_.judge_contact(contact_->first_edge);
  if (ends_well() && move_.kind == MoveKind::kRetreat) input_.judge_opening();
}

bool Mover::opening_known(const MoverCycle& cycle) {
  const bool closed = ends_well() && move_.kind == MoveKind::kRetreat && sensor_.heard().touching();
  if (!open_due_ && !closed) return true;
  if (!open_due_) open_due_ = cycle.now;
  if (ends_well() && !closed) return true;  // the sensor's message arrived after the arm
  const auto found = sensor_.opening(*open_due_, cycle.now);
  if (!found) return false;
  outcome_ = found->outcome;
  cause_ = found->cause;
  return true;
}

void Mover::fill_latch(const MoverCycle& cycle, const AxisAngles& settled_rad) {
  const auto at_contact = angles_at(record_, contact_->first_edge, cycle.clock);
  if (!at_contact) {
    // A time stamp outside the record cannot belong to this contact.
    outcome_ = MoveOutcome::kContactSilent;
    cause_ = cause::StampOutside{seconds(cycle.now - contact_->first_edge)};
    return;
  }
  // Angles far from everything commanded around the contact are wrong, and the retreat would be
  // computed from them.
  const double span_s = config_.follow_window_s + seconds(cycle.now - contact_->first_edge);
  const auto window = static_cast<std::size_t>(std::ceil(span_s / cycle.cycle_s)) + 1;
  const double tolerance_rad = config_.follow_tolerance_deg * kRadPerDeg;
  for (std::size_t i = 0; i < at_contact->actual_rad.size(); ++i) {
    const PositionRecord::Range range = record_.commanded_range_rad(i, window);
    const double actual = at_contact->actual_rad[i];
    if (actual >= range.min - tolerance_rad && actual <= range.max + tolerance_rad) continue;
    outcome_ = MoveOutcome::kNotFollowing;
    cause_ = cause::AxisNotFollowing{axes().name(i),
                                     axes().shown(i, std::clamp(actual, range.min, range.max)),
                                     axes().shown(i, actual)};
    return;
  }
  Latch latch;
  latch.contact_rad = at_contact->actual_rad;
  latch.settled_rad = settled_rad;
  latch.contact_time = contact_->first_edge;
  latch.time_sigma_s = std::hypot(contact_->time_sigma_s, at_contact->time_sigma_s);
  latch.reaction_s = seconds(stopped_at_ - contact_->first_edge);
  latch.bounces = contact_->bounces;
  latch_ = latch;
}

std::optional<AnglesAt> angles_at(const PositionRecord& record, TimePoint t,
                                  const IpocClock& clock) {
  if (!clock.milliseconds || record.size() < kParts) return by_arrival(record, t);
  const auto earliest = earliest_s(record, clock.seconds_per_count);
  if (!keeps_time(earliest)) return by_arrival(record, t);
  const auto at = record.actual_at(t, clock.seconds_per_count);
  if (!at) return std::nullopt;
  const auto [least, most] = std::minmax_element(earliest.begin(), earliest.end());
  return AnglesAt{*at, *most - *least};
}

}  // namespace cellcal::drivers
