#include "drivers/kuka/moves/sensor_monitor.h"

namespace cellcal::drivers {
namespace {

// A contact that breaks chatters; only one that comes back after this is a new one.
constexpr std::chrono::milliseconds kChatter{50};

}  // namespace

void SensorMonitor::listen(TimePoint now, std::optional<std::uint16_t> arm_id) {
  heard_ = Heard{};
  if (guard_ == nullptr) return;
  while (const std::optional<ContactEvent> event = guard_->take_event()) {
    const bool ours = arm_id && event->arm_id == *arm_id;
    switch (event->kind) {
      case ContactEventKind::kTrip:
        tripped_arm_ = event->arm_id;
        if (ours) heard_.trip = event;
        if (!ours) heard_.foreign_trip = true;
        break;
      case ContactEventKind::kContact:
        tripped_arm_ = event->arm_id;
        if (ours) heard_.contact = event;
        if (!ours) heard_.foreign_trip = true;  // a touch too short for the level to show
        break;
      case ContactEventKind::kRevoked:
        if (ours) heard_.revoked = true;
        break;
      case ContactEventKind::kRelease:
        break;  // the level in the snapshot says it
    }
  }
  heard_.snapshot = guard_->snapshot(now);
  // The arming that tripped is over; its number may be used again.
  if (!heard_.snapshot.armed) tripped_arm_.reset();
}

std::optional<SensorRefusal> SensorMonitor::refusal(const Move& move) const {
  const ContactSnapshot& sensor = heard_.snapshot;
  const auto refused = [](Cause cause, double a = 0.0, double b = 0.0) {
    return SensorRefusal{MoveOutcome::kRefused, cause, a, b};
  };
  if (move.kind == MoveKind::kSearch) {
    if (guard_ == nullptr) return refused(Cause::kNoSensor);
    if (sensor.in_contact) return refused(Cause::kTouchingAtStart);
    if (tripped_arm_ == move.arm_id) return refused(Cause::kTrippedAtStart);
    if (!sensor.armed || sensor.arm_id != move.arm_id) {
      return refused(Cause::kNotArmed, move.arm_id, sensor.armed ? sensor.arm_id : -1.0);
    }
    if (!sensor.alive) return refused(Cause::kSensorDead);
  } else if (guard_ != nullptr) {
    if (!sensor.alive) {
      return SensorRefusal{MoveOutcome::kContactSilent, Cause::kSensorDead, 0.0, 0.0};
    }
    if (move.kind == MoveKind::kTransit && sensor.in_contact) {
      return SensorRefusal{MoveOutcome::kUnexpectedContact, Cause::kTouchedOutsideSearch, 0.0, 0.0};
    }
  }
  return std::nullopt;
}

Cause SensorMonitor::loss() const {
  const ContactSnapshot& sensor = heard_.snapshot;
  if (sensor.delivered_late_s > 0.0) return Cause::kSensorLate;
  if (!sensor.alive || sensor.last_end == ArmEnd::kSilence) return Cause::kSensorDead;
  return sensor.last_end == ArmEnd::kSensorDisarmed ? Cause::kKeepAliveLate : Cause::kArmExpired;
}

void SensorMonitor::explain(CoreResult& done) const {
  const ContactSnapshot& sensor = heard_.snapshot;
  const bool lost = done.cause == Cause::kSensorDead || done.cause == Cause::kSensorLate;
  if (!lost || !(sensor.delivered_late_s > 0.0)) return;
  done.cause = Cause::kSensorLate;
  done.a = sensor.delivered_late_s;
  done.b = sensor.late_limit_s;
}

bool SensorMonitor::touched(MoveKind kind, TimePoint now) {
  const ContactSnapshot& sensor = heard_.snapshot;
  const bool touching = sensor.in_contact || heard_.foreign_trip;
  if (kind != MoveKind::kRetreat) return touching;
  if (!sensor.in_contact && !was_open_) {
    was_open_ = true;
    opened_at_ = now;
  }
  return touching && was_open_ && now - opened_at_ > kChatter;
}

}  // namespace cellcal::drivers
