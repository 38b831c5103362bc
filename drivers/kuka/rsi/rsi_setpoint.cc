#include "drivers/kuka/rsi/rsi_setpoint.h"

#include <algorithm>
#include <cmath>

#include "drivers/units.h"

namespace cellcal::drivers {

namespace {

// ASPos repeats exactly; allows for one decimal less than is accepted.
constexpr double kSamePoseRad = 0.01 * kRadPerDeg;
// If the arm is this close to the last correction sent, the controller holds it; the difference is
// due to servos or an inexact correction.
constexpr double kSameFrameRad = 0.05 * kRadPerDeg;
// Minimum time before a program that ended is started again.
constexpr double kRestartTakesS = 0.5;

// Tolerance for rounding of sums and the choice of corners on a path within its limits.
constexpr double kMargin = 1.01;
constexpr double kRoundingRad = 1e-9;

double of(const AxisAngles& values, std::size_t i) { return i < values.size() ? values[i] : 0.0; }

// Tolerance for equal corrections, and for none: above servo error and AIPos noise at rest; a jump of this size
// (0.5 mm at 1.4 m) is within vibration.
constexpr double kSameRad = 0.02 * kRadPerDeg;
// Largest difference at rest, from servos or a controller that applies the correction inexactly.
constexpr double kServosLeaveRad = 0.05 * kRadPerDeg;
// Rest: no axis changes by more than this from packet to packet, several times in a row.
constexpr double kStillRad = 0.005 * kRadPerDeg;
constexpr int kStillPackets = 3;
// If several replies could be held by the controller, their distance may be less than the motion of
// an arm that is still settling: two or three more of its time constants.
constexpr int kSettledPackets = 12;
// Tolerance between IPOC and the host's clock for a continuing session: network jitter, two
// quartzes.
constexpr double kContinuityS = 0.05, kContinuityFraction = 0.01;
// Minimum silence on an own port that excludes a running session: five of the longest cycles. No
// program is stopped and started within it.
constexpr double kListenedS = 0.2;
// Delay of a running session may lag by one packet; that of a new one must be clearly below.
constexpr std::uint32_t kDelayLag = 1, kDelayClear = 3;
// Maximum lead, in packets, of a peer that waits for replies.
constexpr std::int32_t kMostAhead = 4;

double distance(const AxisAngles& a, const AxisAngles& b) {
  double most = a.size() == b.size() ? 0.0 : HUGE_VAL;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    most = std::max(most, std::abs(a[i] - b[i]));
  }
  return most;
}

}  // namespace

AxisAngles axes_of(const AxisAngles& axes_deg, const AxisAngles& external_deg,
                   const WireAxes& wire) {
  AxisAngles shown = axes_deg;
  // Fewer than six of the arm's would put an external axis into their place.
  if (shown.size() < std::min(wire.count(), kArmAxes)) return {};
  for (std::size_t i = 0; i < external_deg.size() && shown.size() < wire.count(); ++i)
    shown.push_back(external_deg[i]);
  return shown.size() < wire.count() ? AxisAngles{} : wire.inside(shown);
}

RsiSetpoint::RsiSetpoint(const RsiConfig& config)
    : config_(config),
      wire_(config.limits),
      accumulator_(config.mode, config.decimals, wire_),
      bound_(config.limits),
      base_(config.limits.size(), 0.0),
      commanded_(base_),
      space_(config.space) {
  finder_.begin(memory_);
}

void RsiSetpoint::begin_session(double silence_before_s) {
  silence_before_s_ = silence_before_s;
  start_pose_.clear();
  known_ = setpoint_follows_ = setpoint_apart_ = false;
  finder_.begin(memory_);
}

bool RsiSetpoint::session_starts(double silence_before_s) {
  const AxisAngles zero(axes(), 0.0);
  const bool holds = memory_.known && distance(memory_.sent_rad, zero) > kSameRad;
  session_start_ = !holds || silence_before_s >= kRestartTakesS;
  return session_start_;
}

void RsiSetpoint::remember(const OffsetMemory& link) {
  if (known_) {
    memory_ = link;
    memory_.known = true;
    memory_.sent_rad = accumulator_.held_rad();
    memory_.earlier_rad = earlier_;
    memory_.setpoint_follows = setpoint_follows_;
  }
  known_ = false;
}

std::optional<cause::SessionRestarted> RsiSetpoint::start_pose_moved(const RobFrame& frame,
                                                                     const AxisAngles& actual_rad,
                                                                     bool moving) {
  const AxisAngles setpoint = axes_of(frame.setpoint_axes_deg, frame.setpoint_external_deg, wire_);
  if (setpoint.size() != axes()) return std::nullopt;
  if (start_pose_.empty()) start_pose_ = setpoint;
  if (setpoint_follows_) return std::nullopt;
  if (distance(setpoint, start_pose_) <= kSamePoseRad) {
    // The arm has left ASPos while that stayed: it does not include the correction, and if it jumps
    // to the arm's position a new session began there.
    const double apart = distance(setpoint, actual_rad);
    setpoint_apart_ = setpoint_apart_ || apart > kSameRad;
    return std::nullopt;
  }
  setpoint_follows_ = known_ && moving && !setpoint_apart_ &&
                      distance(setpoint, commanded_) <= kSamePoseRad &&
                      distance(setpoint, actual_rad) <= kSamePoseRad;
  if (setpoint_follows_) return std::nullopt;
  const std::uint8_t axis = farthest_axis(setpoint, start_pose_).axis;
  return cause::SessionRestarted{cause::SessionRestarted::Sign::kSetpoint,
                                 wire_.shown(axis, start_pose_[axis]),
                                 wire_.shown(axis, setpoint[axis]), wire_.name(axis)};
}

double RsiSetpoint::start_distance_rad(const RobFrame& frame, const AxisAngles& actual_rad) const {
  return distance(actual_rad, axes_of(frame.setpoint_axes_deg, frame.setpoint_external_deg, wire_));
}

bool RsiSetpoint::find(const RobFrame& frame, const AxisAngles& actual_rad, TimePoint t_rx,
                       bool waits) {
  OffsetEvidence evidence;
  evidence.t_rx = t_rx;
  evidence.ipoc = frame.ipoc.value;
  evidence.actual_rad = actual_rad;
  const AxisAngles setpoint = axes_of(frame.setpoint_axes_deg, frame.setpoint_external_deg, wire_);
  if (setpoint.size() == axes() && !memory_.setpoint_follows) {
    evidence.setpoint_rad = setpoint;
    if (start_pose_.empty()) start_pose_ = setpoint;
  }
  evidence.delay = frame.delay;
  evidence.silence_before_s = silence_before_s_;
  evidence.session_start = session_start_;
  evidence.waits = waits;
  evidence.answered = can_hold_unknown();
  verdict_ = finder_.update(evidence);
  if (verdict_ != OffsetVerdict::kKnown) return false;
  if (config_.mode == CorrectionMode::kRelative && evidence.setpoint_rad.empty()) {
    // A running session holds the sum of the accepted increments, some of which may have been lost:
    // only ASPos reveals it. A new session holds nothing.
    for (const double offset : finder_.offset_rad()) {
      if (std::abs(offset) > kSameRad) verdict_ = OffsetVerdict::kUnknown;
    }
    if (verdict_ != OffsetVerdict::kKnown) return false;
  }
  AxisAngles held = finder_.offset_rad();
  if (config_.space.on && !hold_in_space(held)) {
    verdict_ = OffsetVerdict::kUnknown;
    return false;
  }
  session_start_ = false;
  known_ = true;
  accumulator_.set(held);
  base_ = actual_rad;
  for (std::size_t i = 0; i < axes(); ++i) base_[i] -= accumulator_.held_rad()[i];
  if (config_.mode == CorrectionMode::kRelative && !start_pose_.empty()) base_ = start_pose_;
  find_start(actual_rad);
  hold_at(actual_rad);
  bound_.rest_at(correction_rad(commanded_));
  earlier_.clear();
  return true;
}

bool RsiSetpoint::hold_in_space(AxisAngles& held_rad) const {
  const AxisAngles zero(axes(), 0.0);
  if (distance(held_rad, zero) <= kSameRad) return true;
  const bool same_session = memory_.known && !start_.empty() &&
                            (start_pose_.empty() || memory_.setpoint_follows ||
                             distance(start_pose_, start_) <= kSamePoseRad);
  if (!same_session || distance(held_rad, memory_.sent_rad) > kSameFrameRad) return false;
  held_rad = memory_.sent_rad;
  return true;
}

void RsiSetpoint::find_start(const AxisAngles& actual_rad) {
  if (!start_pose_.empty() && !memory_.setpoint_follows) {
    start_ = start_pose_;
  } else if (start_.empty() || distance(base_, actual_rad) <= kSameRad) {
    start_ = base_;
  }  // otherwise a continuing session without information from ASPos: the start is unchanged
  space_.begin(start_);
}

void RsiSetpoint::hold_at(const AxisAngles& at_rad) {
  commanded_ = at_rad;
  if (config_.mode == CorrectionMode::kAbsolute) {
    // The correction sent last is held; the rest position shifts the zero.
    base_ = at_rad;
    for (std::size_t i = 0; i < axes(); ++i) base_[i] -= accumulator_.held_rad()[i];
    return;
  }
  // An increment may have been lost: the correction is derived from the measured position, with the
  // zero unchanged.
  accumulator_.set(correction_rad(at_rad));
  bound_.rest_at(correction_rad(at_rad));
}

AxisAngles RsiSetpoint::correction_rad(const AxisAngles& axes_rad) const {
  AxisAngles correction = axes_rad;
  for (std::size_t i = 0; i < axes(); ++i) correction[i] -= base_[i];
  return correction;
}

std::optional<Cause> RsiSetpoint::object_to(const Move& move) const {
  if (const auto objection =
          drivers::object_to(move, config_.limits, config_.correction_limit_deg, base_))
    return objection;
  AxisAngles from = correction_rad(commanded_);
  for (std::size_t leg = 0; leg < leg_count(move); ++leg) {
    const AxisAngles to = correction_rad(leg_target(move, leg));
    if (const auto objection = space_.object_to(from, to)) return of_leg(*objection, move, leg);
    from = to;
  }
  return std::nullopt;
}

std::span<const double> RsiSetpoint::on_wire(std::span<const double> axes_deg) {
  if (!config_.space.on) return axes_deg;
  const auto rkorr = space_.rkorr(axes_deg);
  if (!rkorr) return {};
  rkorr_ = *rkorr;
  return rkorr_;
}

std::span<const double> RsiSetpoint::next(double cycle_s, bool stops) {
  const AxisAngles wanted_rad = correction_rad(commanded_);
  beyond_ = bound_.admit(wanted_rad, cycle_s, stops);
  if (beyond_) {
    commanded_ = base_;
    for (std::size_t i = 0; i < axes(); ++i) commanded_[i] += accumulator_.held_rad()[i];
    bound_.rest_at(correction_rad(commanded_));
    return hold();
  }
  if (earlier_.size() == earlier_.capacity()) earlier_.erase(earlier_.begin());
  earlier_.push_back(accumulator_.held_rad());
  AxisAngles step = commanded_;
  for (std::size_t i = 0; i < axes(); ++i) step[i] = config_.limits[i].max_speed_rad_s * cycle_s;
  return on_wire(accumulator_.next_deg(wanted_rad, step));
}

std::optional<cause::ReplyBeyondLimit> ReplyBound::admit(const AxisAngles& next_rad, double cycle_s,
                                                         bool stops) {
  using Of = cause::ReplyBeyondLimit::Of;
  Said next{next_rad, next_rad, next_rad, cycle_s, last_.cycle_s};
  const double two_s = cycle_s + (last_.cycle_s > 0.0 ? last_.cycle_s : cycle_s);
  const double three_s = two_s + (last_.before_s > 0.0 ? last_.before_s : cycle_s);
  for (std::size_t i = 0; i < next_rad.size(); ++i) {
    const AxisLimit& limit = limits_[i];
    const double step = next_rad[i] - last_.at_rad[i];
    if (std::abs(step) <= kRoundingRad && of(last_.speed, i) == 0.0) {
      next.speed[i] = next.acceleration[i] = 0.0;
      continue;
    }
    const auto beyond = [&](Of of, double value, double most) {
      return cause::ReplyBeyondLimit{of, axes_.name(i), axes_.shown(i, value),
                                     axes_.shown(i, most)};
    };
    // No motion before the cycle is known.
    if (!(cycle_s > 0.0)) return beyond(Of::kSpeed, HUGE_VAL, limit.max_speed_rad_s);
    const double was = of(last_.speed, i);
    const double speed = next.speed[i] = step / cycle_s;
    const double change = next.acceleration[i] = 2.0 * (speed - was) / two_s;
    const double jerk = 3.0 * (change - of(last_.acceleration, i)) / three_s;
    const double least = kRoundingRad / cycle_s;
    if (!(std::abs(speed) <= kMargin * limit.max_speed_rad_s + least))
      return beyond(Of::kSpeed, std::abs(speed), limit.max_speed_rad_s);
    if (stops && speed * was >= 0.0 && std::abs(speed) <= std::abs(was) + least) continue;
    if (!(std::abs(change) <= kMargin * limit.max_acceleration_rad_s2 + least / cycle_s))
      return beyond(Of::kAcceleration, std::abs(change), limit.max_acceleration_rad_s2);
    if (!stops &&
        !(std::abs(jerk) <= kMargin * limit.max_jerk_rad_s3 + 4 * least / (cycle_s * cycle_s)))
      return beyond(Of::kJerk, std::abs(jerk), limit.max_jerk_rad_s3);
  }
  before_ = last_;
  last_ = next;
  return std::nullopt;
}

void OffsetFinder::begin(const OffsetMemory& memory) {
  *this = OffsetFinder();
  memory_ = memory;
}

OffsetVerdict OffsetFinder::decide(const AxisAngles& offset_rad) {
  offset_rad_ = offset_rad;
  return OffsetVerdict::kKnown;
}

OffsetVerdict OffsetFinder::update(const OffsetEvidence& evidence) {
  zero_.assign(evidence.actual_rad.size(), 0.0);
  return evidence.setpoint_rad.empty() ? by_counters(evidence) : by_setpoint(evidence);
}

OffsetVerdict OffsetFinder::by_setpoint(const OffsetEvidence& evidence) {
  AxisAngles measured = evidence.actual_rad;
  for (std::size_t i = 0; i < measured.size(); ++i) measured[i] -= evidence.setpoint_rad[i];
  const double from_zero = distance(measured, zero_);
  // For a moving arm the controller may hold one of the preceding replies, too.
  const bool only_one = only_one_sent();
  if (memory_.known) {
    const double from_sent = distance(measured, memory_.sent_rad);
    if (only_one && from_sent <= kSameRad && from_sent <= from_zero)
      return decide(memory_.sent_rad);
  }
  // Without a previous correction, or with a negligible one, a small difference is zero.
  if (from_zero <= kSameRad && (!memory_.known || distance(memory_.sent_rad, zero_) <= kSameRad)) {
    return decide(zero_);
  }
  // Otherwise the arm may be moving between two corrections: the difference identifies the active
  // one only at rest.
  const bool still = distance(measured, last_measured_) <= kStillRad;
  still_packets_ = still ? still_packets_ + 1 : 0;
  last_measured_ = measured;
  const int enough = memory_.known && !only_one ? kSettledPackets : kStillPackets;
  if (still_packets_ < enough && !evidence.waits) return OffsetVerdict::kWaitForRest;
  if (memory_.known) return behind_replies(evidence, measured);
  return decide(from_zero <= kSameRad ? zero_ : measured);
}

bool OffsetFinder::only_one_sent() const {
  return std::all_of(
      memory_.earlier_rad.begin(), memory_.earlier_rad.end(),
      [&](const AxisAngles& earlier) { return distance(earlier, memory_.sent_rad) <= kStillRad; });
}

const AxisAngles& OffsetFinder::nearest_sent(const AxisAngles& measured) const {
  const AxisAngles* nearest = &memory_.sent_rad;
  for (const AxisAngles& earlier : memory_.earlier_rad) {
    if (distance(measured, earlier) < distance(measured, *nearest)) nearest = &earlier;
  }
  return *nearest;
}

OffsetVerdict OffsetFinder::behind_replies(const OffsetEvidence& evidence,
                                           const AxisAngles& measured) {
  const AxisAngles& sent = nearest_sent(measured);
  if (distance(measured, sent) <= kServosLeaveRad) return decide(sent);
  if (distance(measured, zero_) > kSameRad) return OffsetVerdict::kDenied;
  if (evidence.silence_before_s < kListenedS) return OffsetVerdict::kDenied;
  // For a session without a correction only the counters, if present, show whether it is a new one.
  if (!evidence.delay || !memory_.delay) return decide(zero_);
  const OffsetVerdict counted = by_counters(evidence);
  if (counted != OffsetVerdict::kKnown) return counted;
  return distance(offset_rad_, zero_) <= kSameRad ? OffsetVerdict::kKnown : OffsetVerdict::kDenied;
}

/// No late replies yet, although no other process can have answered for many cycles. Without the
/// silence it may be a session that another process has answered until now; and the silence is
/// significant only for a peer that does not wait for replies: the packets after the first one
/// arrive unanswered, and each is counted. While zeros are sent (relative) this is not observable,
/// and no jump is possible.
bool OffsetFinder::just_begun(const OffsetEvidence& evidence) {
  if (!evidence.delay || evidence.waits || evidence.silence_before_s < kListenedS) return false;
  if (evidence.answered) return *evidence.delay == 0;
  if (!first_delay_) {
    first_delay_ = evidence.delay;
    first_rx_ = evidence.t_rx;
    return false;
  }
  const double since_s = std::chrono::duration<double>(evidence.t_rx - first_rx_).count();
  return *first_delay_ == 0 && *evidence.delay > 0 && since_s < kListenedS;
}

OffsetVerdict OffsetFinder::by_counters(const OffsetEvidence& evidence) {
  const bool may_be_other_session = !memory_.known || evidence.silence_before_s >= kListenedS;
  if (evidence.session_start) return decide(zero_);
  // A peer that counts packets from 0 waits for the answer to its first one.
  const bool first_packet = evidence.ipoc == 0 && evidence.delay.value_or(0) == 0;
  if (first_packet && may_be_other_session) return decide(zero_);
  if (!memory_.known) {
    return just_begun(evidence) ? decide(zero_) : OffsetVerdict::kUnknown;
  }
  if (distance(memory_.sent_rad, zero_) <= kSameRad) return decide(memory_.sent_rad);
  if (memory_.step == 0 || memory_.seconds_per_ipoc <= 0.0) return OffsetVerdict::kUnknown;

  const auto passed = static_cast<std::int32_t>(evidence.ipoc - memory_.ipoc);
  // After any time: if position and counter are unchanged, the session continues.
  if (memory_.counts_packets && passed >= 0 && passed <= kMostAhead &&
      distance(evidence.actual_rad, memory_.actual_rad) <= kSameRad) {
    return decide(memory_.sent_rad);
  }
  const double elapsed_s = std::chrono::duration<double>(evidence.t_rx - memory_.t_rx).count();
  const double by_ipoc_s = passed * memory_.seconds_per_ipoc;
  if (std::abs(by_ipoc_s - elapsed_s) > kContinuityS + kContinuityFraction * elapsed_s) {
    return may_be_other_session ? decide(zero_) : OffsetVerdict::kUnknown;
  }
  if (!evidence.delay || !memory_.delay) return OffsetVerdict::kUnknown;
  // It never decreases within a session.
  if (*evidence.delay < *memory_.delay)
    return may_be_other_session ? decide(zero_) : OffsetVerdict::kUnknown;
  if (!first_delay_) first_delay_ = evidence.delay;
  const bool counts = memory_.delay_counts || *evidence.delay > *first_delay_;
  const std::uint32_t missed = std::max(static_cast<std::uint32_t>(passed) / memory_.step, 1U) - 1;
  const std::uint32_t expected = *memory_.delay + missed - std::min(missed, memory_.answered_since);
  if (*evidence.delay + kDelayLag >= expected) {
    // Replies counted as late are not in the correction that the controller holds.
    const bool taken =
        *evidence.delay <= expected + kDelayLag || (memory_.answered_since == 0 && only_one_sent());
    return taken ? decide(memory_.sent_rad) : OffsetVerdict::kUnknown;
  }
  if (counts && may_be_other_session && *evidence.delay + kDelayClear <= expected)
    return decide(zero_);
  return OffsetVerdict::kUnknown;
}

CorrectionAccumulator::CorrectionAccumulator(CorrectionMode mode, int decimals,
                                             const WireAxes& axes)
    : mode_(mode), axes_(axes), per_deg_(std::pow(10.0, decimals)), held_rad_(axes.count(), 0.0) {}

void CorrectionAccumulator::set(const AxisAngles& held_rad) {
  held_rad_ = held_rad;
  for (std::size_t i = 0; i < held_rad.size(); ++i) {
    held_[i] = std::llround(axes_.shown(i, held_rad[i]) * per_deg_);
  }
}

std::span<const double> CorrectionAccumulator::next_deg(const AxisAngles& wanted_rad,
                                                        const AxisAngles& step_rad) {
  for (std::size_t i = 0; i < held_rad_.size(); ++i) {
    const double wanted_deg = axes_.shown(i, wanted_rad[i]);
    double& sent_deg = sent_deg_[axes_.place(i)];
    if (mode_ == CorrectionMode::kAbsolute) {
      sent_deg = wanted_deg;
      held_rad_[i] = wanted_rad[i];
      continue;
    }
    // One unit more than the step: the rounding of the last reply.
    const std::int64_t most =
        static_cast<std::int64_t>(std::floor(axes_.shown(i, step_rad[i]) * per_deg_)) + 1;
    const std::int64_t wanted = std::llround(wanted_deg * per_deg_);
    const std::int64_t step = std::clamp(wanted - held_[i], -most, most);
    held_[i] += step;
    sent_deg = static_cast<double>(step) / per_deg_;
    held_rad_[i] = static_cast<double>(held_[i]) / per_deg_ / axes_.shown(i, 1.0);
  }
  return again_deg();
}

std::span<const double> CorrectionAccumulator::hold_deg() {
  for (std::size_t i = 0; i < held_rad_.size(); ++i) {
    sent_deg_[axes_.place(i)] =
        mode_ == CorrectionMode::kAbsolute ? axes_.shown(i, held_rad_[i]) : 0.0;
  }
  return again_deg();
}

}  // namespace cellcal::drivers
