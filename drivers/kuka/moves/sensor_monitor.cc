#include "drivers/kuka/moves/sensor_monitor.h"

namespace cellcal::drivers {
namespace {

// A contact that opens chatters; only a contact after this time is a new one.
constexpr std::chrono::milliseconds kChatter{50};
// Time within which an edge is confirmed or dismissed, or its arming's configuration refused.
constexpr std::chrono::milliseconds kLongestConfirmation{50};
// The input opens with the contact; after a restart of the board in contact, with the self-test that
// passes only after opening and is requested every second.
constexpr std::chrono::milliseconds kInputOpens{2500};

}  // namespace

void SensorMonitor::listen(TimePoint now, std::optional<std::uint16_t> arm_id,
                           const InputLevel& input) {
  heard_ = Heard{};
  heard_.input = input;
  if (guard_ == nullptr) return;
  while (const std::optional<ContactEvent> event = guard_->pop_event()) {
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
        if (!ours) heard_.foreign_trip = true;  // a touch too short to be visible in the level
        break;
      case ContactEventKind::kRevoked:
        if (ours) heard_.revoked = true;
        break;
      case ContactEventKind::kRelease: break;  // covered by the level in the snapshot
    }
  }
  heard_.snapshot = guard_->snapshot(now);
  heard_.trip_lost =
      arm_id && !heard_.snapshot.armed && heard_.snapshot.last_end == ArmEnd::kTripped;
  // The arming that tripped has ended; its number may be reused.
  if (!heard_.snapshot.armed) tripped_arm_.reset();
}

std::optional<SensorRefusal> SensorMonitor::refusal(const Move& move) const {
  const ContactSnapshot& sensor = heard_.snapshot;
  const auto refused = [](const Cause& cause) {
    return SensorRefusal{MoveOutcome::kRefused, cause};
  };
  if (move.kind == MoveKind::kSearch) {
    if (guard_ == nullptr) return refused(cause::NoSensor{});
    if (sensor.in_contact) return refused(cause::TouchingAtStart{});
    if (heard_.input.contact) return refused(cause::InputAtStart{});
    if (tripped_arm_ == move.arm_id) return refused(cause::TrippedAtStart{});
    const bool over =
        sensor.last_end == ArmEnd::kSilence || sensor.last_end == ArmEnd::kDeliveredLate;
    if (!sensor.armed && over) return refused(loss());  // between the arming and the search
    if (!sensor.armed) return refused(cause::NotArmed{move.arm_id});
    if (sensor.arm_id != move.arm_id) {
      return refused(cause::ArmedOtherwise{move.arm_id, sensor.arm_id});
    }
    if (!sensor.alive) return refused(cause::SensorDead{});
  } else if (guard_ != nullptr) {
    if (!sensor.alive) {
      return SensorRefusal{MoveOutcome::kContactSilent, cause::SensorDead{}};
    }
    if (move.kind == MoveKind::kTransit && heard_.touching()) {
      return SensorRefusal{MoveOutcome::kUnexpectedContact, touch()};
    }
  }
  return std::nullopt;
}

Cause SensorMonitor::loss() const {
  const ContactSnapshot& sensor = heard_.snapshot;
  if (sensor.delivered_late_s > 0.0) {
    return cause::SensorLate{sensor.delivered_late_s, sensor.late_limit_s};
  }
  if (!sensor.alive || sensor.last_end == ArmEnd::kSilence) return cause::SensorDead{};
  if (sensor.last_end == ArmEnd::kSensorDisarmed) return cause::KeepAliveLate{};
  return cause::ArmExpired{};
}

Cause SensorMonitor::touch() const {
  if (heard_.snapshot.in_contact || heard_.foreign_trip) return cause::TouchedOutsideSearch{};
  return cause::InputTouched{};
}

bool SensorMonitor::withheld(TimePoint since, TimePoint now) const {
  return now - since > kVerdictLimit && heard_.snapshot.said >= since + kLongestConfirmation;
}

std::optional<SensorRefusal> SensorMonitor::opening(TimePoint due, TimePoint now) const {
  const ContactSnapshot& sensor = heard_.snapshot;
  if (!sensor.alive) return SensorRefusal{MoveOutcome::kContactSilent, cause::SensorDead{}};
  if (sensor.in_contact && sensor.said > due)
    return SensorRefusal{MoveOutcome::kStillInContact, cause::ContactNotOpen{}};
  if (sensor.in_contact) return std::nullopt;
  if (heard_.input.contact) {
    if (now - due <= kInputOpens) return std::nullopt;
    return SensorRefusal{MoveOutcome::kContactSilent, cause::InputAlone{seconds(now - due)}};
  }
  const double late_s = sensor.said_late_s, limit_s = seconds(kHeartbeatLimit);
  if (late_s > limit_s)
    return SensorRefusal{MoveOutcome::kContactSilent, cause::SensorLate{late_s, limit_s}};
  return SensorRefusal{MoveOutcome::kContactSilent, cause::OpeningUnheard{seconds(now - due)}};
}

void SensorMonitor::explain(CoreResult& done) const {
  const ContactSnapshot& sensor = heard_.snapshot;
  const bool lost = is<cause::SensorDead, cause::SensorLate>(done.cause);
  if (lost && sensor.delivered_late_s > 0.0)
    done.cause = cause::SensorLate{sensor.delivered_late_s, sensor.late_limit_s};
  done.interruption = interruption_by(done.cause);
}

Interruption SensorMonitor::interruption_by(const Cause& cause) const {
  if (is<cause::SensorLate, cause::KeepAliveLate>(cause)) return Interruption::kLateBytes;
  const bool open = is<cause::SensorDead>(cause) && heard_.snapshot.silence_open;
  return open ? Interruption::kUnheard : Interruption::kNone;
}

bool SensorMonitor::touched(MoveKind kind, TimePoint now) {
  const ContactSnapshot& sensor = heard_.snapshot;
  const bool touching = heard_.touching() || heard_.foreign_trip;
  if (kind != MoveKind::kRetreat) return touching;
  const bool open = heard_.input.follows ? !heard_.input.contact : !heard_.touching();
  if (open && !was_open_) {
    was_open_ = true;
    opened_at_ = now;
  }
  // The input is ahead of the sensor's delayed bytes.
  const bool old_word = heard_.input.follows && !heard_.input.contact && !heard_.foreign_trip &&
                        sensor.said <= opened_at_ + kChatter;
  return touching && was_open_ && !old_word && now - opened_at_ > kChatter;
}

}  // namespace cellcal::drivers
