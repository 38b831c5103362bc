#pragma once
// Watches the contact sensor while the arm moves, whatever drives the arm: events of the arming that
// guards the move, touches that nobody asked for, silence.

#include <cstdint>
#include <optional>

#include "drivers/contact.h"
#include "drivers/kuka/moves/core_result.h"
#include "drivers/robot.h"

namespace cellcal::drivers {

/// A trip is confirmed or revoked within this time, or the sensor counts as silent.
inline constexpr std::chrono::milliseconds kVerdictLimit{100};

/// Why a move must not begin.
struct SensorRefusal {
  MoveOutcome outcome = MoveOutcome::kRefused;
  Cause cause;
};

/// What the controller's contact input says, where there is one: it is believed at once that something
/// is touched, and that nothing is only where it follows.
struct InputLevel {
  bool contact = false, follows = false;
};

class SensorMonitor {
 public:
  /// `guard` may be null: nothing is heard, and searches are refused. It must outlive this.
  explicit SensorMonitor(ContactGuard* guard) : guard_(guard) {}

  struct Heard {
    ContactSnapshot snapshot;
    std::optional<ContactEvent> trip, contact;
    bool revoked = false;
    bool trip_lost = false;     ///< the arming of ours is used up by a trip, which is not here
    bool foreign_trip = false;  ///< trip or contact of no arming of ours
    InputLevel input;
    /// Something is touched, by the sensor's newest word or by the input.
    bool touching() const { return snapshot.in_contact || input.contact; }
  };

  /// Takes the sensor's events and level. `arm_id`: the arming of the search under way, if one is.
  void listen(TimePoint now, std::optional<std::uint16_t> arm_id, const InputLevel& input = {});
  const Heard& heard() const { return heard_; }
  bool present() const { return guard_ != nullptr; }

  /// After listen().
  std::optional<SensorRefusal> refusal(const Move& move) const;
  /// After listen(): why a sensor that is not alive, or whose arming is over, is to be blamed.
  Cause loss() const;
  /// It did not hear this computer in time: what it met since is of no arming.
  bool disarmed_itself() const {
    return heard_.snapshot.alive && !heard_.snapshot.armed &&
           heard_.snapshot.last_end == ArmEnd::kSensorDisarmed;
  }
  /// Whose silence it was is known only when the sensor is heard again: says so in the result.
  void explain(CoreResult& done) const;
  /// This computer's lateness, or a silence that nothing explains yet; kNone for all other causes.
  Interruption interruption_by(const Cause& cause) const;
  /// The verdict of a trip heard at `since` is over its time, and the sensor has been heard well
  /// behind it: a verdict that is not there while nothing is heard may be under way.
  bool withheld(TimePoint since, TimePoint now) const;
  /// What a move that is no search met: by the sensor's word, or by the input alone.
  Cause touch() const;
  /// A retreat's contact was not heard to be open at `due`. What can be said of it: 'closed' only by
  /// words that the sensor said later. None: nothing yet.
  std::optional<SensorRefusal> opening(TimePoint due, TimePoint now) const;
  /// A move that is no search begins.
  void begin() { was_open_ = false; }
  /// After listen(), during a transit or a retreat: contact where none may be. A retreat begins in
  /// contact, and a contact that breaks chatters.
  bool touched(MoveKind kind, TimePoint now);
  /// A retreat, after touched(): its contact was seen open.
  bool opened() const { return was_open_; }

 private:
  ContactGuard* guard_;
  Heard heard_;
  std::optional<std::uint16_t> tripped_arm_;  ///< arming whose trip was heard last
  bool was_open_ = false;                     ///< retreat: contact was open at least once
  TimePoint opened_at_{};
};

}  // namespace cellcal::drivers
