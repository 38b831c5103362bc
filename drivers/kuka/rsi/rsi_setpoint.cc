#include "drivers/kuka/rsi/rsi_setpoint.h"

#include <algorithm>
#include <cmath>

#include "drivers/units.h"

namespace cellcal::drivers {

namespace {

// ASPos repeats exactly; allows for one decimal less than is accepted.
constexpr double kSamePoseRad = 0.01 * kRadPerDeg;
// A smaller correction is zero, as in rsi_offset.
constexpr double kNoCorrectionRad = 0.02 * kRadPerDeg;
// If the arm is this close to the last correction sent, the controller holds it; the difference is
// due to servos or an inexact correction.
constexpr double kSameFrameRad = 0.05 * kRadPerDeg;
// Minimum time before a program that ended is started again.
constexpr double kRestartTakesS = 0.5;

double most_difference(const AxisAngles& a, const AxisAngles& b) {
  double most = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most;
}

}  // namespace

AxisAngles axes_of(const AxisAngles& axes_deg, const AxisAngles& external_deg, std::size_t count) {
  AxisAngles rad;
  for (std::size_t i = 0; i < axes_deg.size() && rad.size() < count; ++i) {
    rad.push_back(axes_deg[i] * kRadPerDeg);
  }
  for (std::size_t i = 0; i < external_deg.size() && rad.size() < count; ++i) {
    rad.push_back(external_deg[i] * kRadPerDeg);
  }
  return rad;
}

RsiSetpoint::RsiSetpoint(const RsiConfig& config)
    : config_(config),
      accumulator_(config.mode, config.decimals, config.limits.size()),
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
  const bool holds = memory_.known && most_difference(memory_.sent_rad, zero) > kNoCorrectionRad;
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
  const AxisAngles setpoint = axes_of(frame.setpoint_axes_deg, frame.setpoint_external_deg, axes());
  if (setpoint.size() != axes()) return std::nullopt;
  if (start_pose_.empty()) start_pose_ = setpoint;
  if (setpoint_follows_) return std::nullopt;
  if (most_difference(setpoint, start_pose_) <= kSamePoseRad) {
    // The arm has left ASPos while that stayed: it does not include the correction, and if it jumps
    // to the arm's position a new session began there.
    const double apart = most_difference(setpoint, actual_rad);
    setpoint_apart_ = setpoint_apart_ || apart > kNoCorrectionRad;
    return std::nullopt;
  }
  setpoint_follows_ = known_ && moving && !setpoint_apart_ &&
                      most_difference(setpoint, commanded_) <= kSamePoseRad &&
                      most_difference(setpoint, actual_rad) <= kSamePoseRad;
  if (setpoint_follows_) return std::nullopt;
  const std::uint8_t axis = farthest_axis(setpoint, start_pose_).axis;
  return cause::SessionRestarted{cause::SessionRestarted::Sign::kSetpoint,
                                 start_pose_[axis] * kDegPerRad, setpoint[axis] * kDegPerRad, axis};
}

double RsiSetpoint::start_distance_rad(const RobFrame& frame, const AxisAngles& actual_rad) const {
  return most_difference(actual_rad,
                         axes_of(frame.setpoint_axes_deg, frame.setpoint_external_deg, axes()));
}

bool RsiSetpoint::find(const RobFrame& frame, const AxisAngles& actual_rad, TimePoint t_rx,
                       bool waits) {
  OffsetEvidence evidence;
  evidence.t_rx = t_rx;
  evidence.ipoc = frame.ipoc.value;
  evidence.actual_rad = actual_rad;
  const AxisAngles setpoint = axes_of(frame.setpoint_axes_deg, frame.setpoint_external_deg, axes());
  if (setpoint.size() == axes() && !memory_.setpoint_follows) {
    evidence.setpoint_rad = setpoint;
    if (start_pose_.empty()) start_pose_ = setpoint;
  }
  evidence.delay = frame.delay;
  evidence.silence_before_s = silence_before_s_;
  evidence.session_start = session_start_;
  evidence.waits = waits;
  evidence.answered = can_hold_unknown();
  verdict_ = finder_.look(evidence);
  if (verdict_ != OffsetVerdict::kKnown) return false;
  if (config_.mode == CorrectionMode::kRelative && evidence.setpoint_rad.empty()) {
    // A running session holds the sum of the accepted increments, some of which may have been lost:
    // only ASPos reveals it. A new session holds nothing.
    for (const double offset : finder_.offset_rad()) {
      if (std::abs(offset) > kNoCorrectionRad) verdict_ = OffsetVerdict::kUnknown;
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
  if (most_difference(held_rad, zero) <= kNoCorrectionRad) return true;
  const bool same_session = memory_.known && !start_.empty() &&
                            (start_pose_.empty() || memory_.setpoint_follows ||
                             most_difference(start_pose_, start_) <= kSamePoseRad);
  if (!same_session || most_difference(held_rad, memory_.sent_rad) > kSameFrameRad) return false;
  held_rad = memory_.sent_rad;
  return true;
}

void RsiSetpoint::find_start(const AxisAngles& actual_rad) {
  if (!start_pose_.empty() && !memory_.setpoint_follows) {
    start_ = start_pose_;
  } else if (start_.empty() || most_difference(base_, actual_rad) <= kNoCorrectionRad) {
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

namespace {

// Tolerance for rounding of sums and the choice of corners on a path within its limits.
constexpr double kMargin = 1.01;
constexpr double kRoundingRad = 1e-9;

double of(const AxisAngles& values, std::size_t i) { return i < values.size() ? values[i] : 0.0; }

}  // namespace

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
      return cause::ReplyBeyondLimit{of, static_cast<std::uint8_t>(i), value * kDegPerRad,
                                     most * kDegPerRad};
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

}  // namespace cellcal::drivers
