// Stops of a move over EKI before its arrival: by the controller's own input or flag, or by the telegram that
// EkiCore sends as soon as one is due (wants_stop()).

#include "drivers/kuka/eki/eki_mover.h"
#include "drivers/units.h"

namespace cellcal::drivers {
namespace {

// Grace period of three 12 ms cycles of the controller's input before the search is stopped over
// the network, so that the accurate latch is not lost to a race.
constexpr std::chrono::milliseconds kInputGrace{40};
// Covers a released start key, override 0, and drives switched off without a message.
constexpr std::chrono::milliseconds kStallLimit{2000};
constexpr double kStallRad = 0.002 * kRadPerDeg;

}  // namespace

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
  if (!sensor_.present() || !under_way() || !ends_well()) return;
  if (!sensor_.heard().snapshot.alive) {
    halt(MoveOutcome::kContactSilent, cause::SensorDead{});
  } else if (sensor_.touched(move_.kind, now)) {
    halt(MoveOutcome::kUnexpectedContact, cause::TouchedOutsideSearch{});
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
  if (!under_way() || !ends_well()) return;
  fail(outcome, cause);
  stop_wanted_ = true;
}

void EkiMover::stop_sent(TimePoint now) {
  stop_sent_ = true;
  stop_sent_at_ = now;
}

}  // namespace cellcal::drivers
