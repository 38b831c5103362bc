// Stops of a move over RSI before its arrival. The brake begins with the next reply.

#include "drivers/kuka/rsi/rsi_stops.h"

#include <algorithm>

#include "drivers/kuka/rsi/following_error.h"
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
  const bool astray = config_.space.on && outcome_ == MoveOutcome::kNotFollowing;
  if (searching() || astray) {
    path_.brake_within(t_s_, std::max(kSearchRampS, 3 * cycle_s_));
  } else {
    path_.brake_at(t_s_);
  }
  braking_ = true;
  t_s_ = 0.0;
}

}  // namespace cellcal::drivers
