// Stops of a move over RSI before its arrival. The brake begins with the next reply.

#include "drivers/kuka/rsi/rsi_stops.h"

#include <algorithm>
#include <cmath>

#include "drivers/kuka/rsi/rsi_mover.h"
#include "drivers/units.h"

namespace cellcal::drivers {

void Mover::watch_search(TimePoint now) {
  const ContactSnapshot& sensor = sensor_.heard().snapshot;
  // Covers a trip whose single message was lost: the contact follows, and is repeated.
  const bool said = sensor_.heard().trip || sensor_.heard().trip_lost || sensor_.heard().contact ||
                    sensor_.heard().revoked || sensor.in_contact;
  if (said || sensor_.heard().input.contact) {
    by_input_ = !said;
    stops_by_input_ += by_input_ ? 1 : 0;
    end_travel(Phase::kVerdict, MoveOutcome::kContact, cause::None{});
    stopped_at_ = now;
  } else if (!sensor.alive) {
    end_travel(Phase::kSettling, MoveOutcome::kContactSilent, cause::SensorDead{});
  } else if (!sensor.armed || sensor.arm_id != move_.arm_id) {
    Cause why = sensor_.loss();
    if (is<cause::ArmExpired>(why)) why = cause::ArmExpired{true};
    end_travel(Phase::kSettling, MoveOutcome::kContactSilent, why);
  }
}

void Mover::await_verdict(TimePoint now) {
  by_input_ = by_input_ && !sensor_.heard().trip && !sensor_.heard().trip_lost;
  if (sensor_.heard().contact) {
    contact_ = sensor_.heard().contact;
    const double denied_s = contact_->denied_s;
    if (denied_s > 0.0) {
      end_travel(Phase::kSettling, MoveOutcome::kContactSilent, cause::StampDenied{denied_s});
    } else {
      end_travel(Phase::kSettling, MoveOutcome::kContact, cause::None{});
    }
  } else if (sensor_.heard().revoked) {
    end_travel(Phase::kSettling, MoveOutcome::kRevoked, cause::None{});
  } else if (!sensor_.heard().snapshot.alive) {
    end_travel(Phase::kSettling, MoveOutcome::kContactSilent, cause::SensorDead{});
  } else if (sensor_.withheld(stopped_at_, now)) {
    const double waited_s = seconds(now - stopped_at_);
    end_travel(Phase::kSettling, MoveOutcome::kContactSilent,
               sensor_.disarmed_itself() ? sensor_.loss()
               : by_input_               ? Cause(cause::InputAlone{waited_s})
                                         : cause::TripUnconfirmed{waited_s});
  }
}

void Mover::watch_other(const MoverCycle& cycle) {
  if (!sensor_.present()) return;
  if (!sensor_.heard().snapshot.alive) {
    halt(MoveOutcome::kContactSilent, cause::SensorDead{});
  } else if (sensor_.touched(move_.kind, cycle.now)) {
    if (is<cause::InputTouched>(sensor_.touch()) && ends_well()) ++stops_by_input_;
    halt(MoveOutcome::kUnexpectedContact, sensor_.touch());
  } else if (!sensor_.opened() && t_s_ + cycle.cycle_s > open_by_s_) {
    // The sensor's next messages decide whether it is open.
    halt(MoveOutcome::kContactSilent, cause::OpeningUnheard{});
    open_due_ = cycle.now;
  }
}

void Mover::watch_following(const MoverCycle& cycle) {
  // After a contact the arm is obstructed, and not following is expected.
  if (phase_ == Phase::kVerdict || outcome_ == MoveOutcome::kContact ||
      outcome_ == MoveOutcome::kNotFollowing) {
    return;
  }
  if (const auto fault = following_fault(record_, config_, cycle.cycle_s)) {
    // Late replies look the same; the original cause of the stop is kept.
    if (!ends_well()) return end_travel(Phase::kSettling, outcome_, cause_);
    // Advancing the same command does not help.
    end_travel(Phase::kSettling, MoveOutcome::kNotFollowing, *fault);
  }
}

void Mover::halt(MoveOutcome outcome, const Cause& cause) {
  if (phase_ == Phase::kIdle || phase_ == Phase::kVerdict || !ends_well()) return;
  end_travel(Phase::kSettling, outcome, cause);
}

void Mover::condemn(MoveOutcome outcome, const Cause& cause) {
  if (busy() && is<cause::None>(cause_)) end_travel(Phase::kSettling, outcome, cause);
}

void Mover::end_travel(Phase next, MoveOutcome outcome, const Cause& cause) {
  phase_ = next;
  outcome_ = outcome;
  cause_ = cause;
  settling_s_ = 0.0;
  settling_cycles_ = 0;
  brake();
}

void Mover::brake() {
  if (!in_motion_ || braking_) return;
  if (path_.fastest_axis_rad_s(t_s_) <= kProbingSpeedRadS) {
    in_motion_ = false;
    return;
  }
  // In space the cause is a controller that composes rotations differently: each further commanded
  // degree increases the deviation.
  const bool largest_deviation = config_.space.on && outcome_ == MoveOutcome::kNotFollowing;
  if (searching() || largest_deviation) {
    path_.brake_within(t_s_, std::max(kSearchRampS, 3 * cycle_s_));
  } else {
    path_.brake_at(t_s_);
  }
  braking_ = true;
  t_s_ = 0.0;
}

namespace {

// Windows of increasing length; the shortest one is used in which the command exceeds encoder noise
// (0.001 deg, 1 sigma: six sigmas of the difference of two means of four) and the coarsest
// transmitted rounding (0.001 deg); slow axes need a longer one.
constexpr double kWindowsS[] = {0.06, 0.12, 0.24};
constexpr double kLeastTravelRad = 0.006 * kRadPerDeg;
// Number of packets for a mean with that noise; fewer packets of a longer cycle need more travel.
constexpr double kQuietPackets = 3.0;
constexpr double kStandsShare = 0.25;

std::size_t packets(double duration_s, double cycle_s) {
  return static_cast<std::size_t>(std::ceil(duration_s / cycle_s));
}

bool far_off(const PositionRecord& record, const RsiConfig& config, std::size_t axis,
             double cycle_s) {
  const std::size_t window = packets(config.follow_window_s, cycle_s) + 1;
  const double tolerance_rad = config.follow_tolerance_deg * kRadPerDeg;
  const PositionRecord::Range range = record.commanded_range_rad(axis, window);
  const double actual = record.newest().actual_rad[axis];
  return actual < range.min - tolerance_rad || actual > range.max + tolerance_rad;
}

// Smallest commanded travel of one axis within `window` packets, over windows that end up to `lag`
// packets ago; 0 if not in one direction.
double least_commanded(const PositionRecord& record, std::size_t axis, std::size_t window,
                       std::size_t lag) {
  const auto travel = [&](std::size_t back) {
    return record.newest(back).commanded_rad[axis] -
           record.newest(back + window).commanded_rad[axis];
  };
  const double newest = travel(0);
  double least = std::abs(newest);
  for (std::size_t back = 1; back <= lag; ++back) {
    least = std::min(least, std::copysign(1.0, newest) * travel(back));
  }
  return newest < 0.0 ? std::min(0.0, -least) : std::max(0.0, least);
}

double mean_actual(const PositionRecord& record, std::size_t axis, std::size_t back,
                   std::size_t count) {
  double sum = 0.0;
  for (std::size_t i = 0; i < count; ++i) sum += record.newest(back + i).actual_rad[axis];
  return sum / static_cast<double>(count);
}

bool stands(const PositionRecord& record, const RsiConfig& config, std::size_t axis,
            double cycle_s) {
  const std::size_t lag = packets(config.longest_lag_s, cycle_s);
  for (const double window_s : kWindowsS) {
    const std::size_t window = packets(window_s, cycle_s);
    const std::size_t count = std::max<std::size_t>(1, window / 4);
    // The means extend back by `count` more packets.
    if (record.size() <= window + lag + count) return false;
    const double commanded = least_commanded(record, axis, window, lag + count);
    const double louder = std::sqrt(std::max(1.0, kQuietPackets / static_cast<double>(count)));
    if (std::abs(commanded) < louder * kLeastTravelRad) continue;
    const double moved =
        mean_actual(record, axis, 0, count) - mean_actual(record, axis, window, count);
    return moved / commanded < kStandsShare;
  }
  return false;
}

}  // namespace

std::optional<Cause> following_fault(const PositionRecord& record, const RsiConfig& config,
                                     double cycle_s) {
  const PositionRecord::Sample& newest = record.newest();
  const WireAxes axes(config.limits);
  for (std::size_t i = 0; i < newest.actual_rad.size(); ++i) {
    const WireAxis axis = axes.name(i);
    const double commanded_deg = axes.shown(i, newest.commanded_rad[i]);
    const double actual_deg = axes.shown(i, newest.actual_rad[i]);
    if (far_off(record, config, i, cycle_s)) {
      return cause::AxisNotFollowing{axis, commanded_deg, actual_deg};
    }
    if (stands(record, config, i, cycle_s)) {
      return cause::AxisStands{axis, commanded_deg, actual_deg};
    }
  }
  return std::nullopt;
}

}  // namespace cellcal::drivers
