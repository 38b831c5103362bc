#pragma once
// Monitors the contact sensor during motion, independent of the robot's interface: events of the
// arming that guards the move, unexpected touches, silence.

#include <cstdint>
#include <optional>

#include "drivers/contact.h"
#include "drivers/kuka/moves/move_queue.h"
#include "drivers/robot.h"

namespace cellcal::drivers {

/// A trip is confirmed or revoked within this time; otherwise the sensor counts as silent.
inline constexpr std::chrono::milliseconds kVerdictLimit{100};

/// Reason for refusing a move.
struct SensorRefusal {
  MoveOutcome outcome = MoveOutcome::kRefused;
  Cause cause;
};

/// State of the controller's contact input, if there is one: contact is trusted immediately, absence
/// of contact only while the input follows the sensor.
struct InputLevel {
  bool contact = false, follows = false;
};

class SensorMonitor {
 public:
  /// `guard` may be null: no events, and searches are refused. It must outlive this object.
  explicit SensorMonitor(ContactGuard* guard) : guard_(guard) {}

  struct Heard {
    ContactSnapshot snapshot;
    std::optional<ContactEvent> trip, contact;
    bool revoked = false;
    bool trip_lost = false;     ///< the move's arming was ended by a trip that was not received
    bool foreign_trip = false;  ///< trip or contact outside the move's arming
    InputLevel input;
    /// Contact by the sensor's newest message or by the input.
    bool touching() const { return snapshot.in_contact || input.contact; }
  };

  /// Reads the sensor's events and level. `arm_id`: the arming of the current search, if any.
  void listen(TimePoint now, std::optional<std::uint16_t> arm_id, const InputLevel& input = {});
  const Heard& heard() const { return heard_; }
  bool present() const { return guard_ != nullptr; }

  /// After listen().
  std::optional<SensorRefusal> refusal(const Move& move) const;
  /// After listen(): cause for a sensor that is not alive, or whose arming has ended.
  Cause loss() const;
  /// The sensor missed this computer's keep-alive: contacts since then belong to no arming.
  bool disarmed_itself() const {
    return heard_.snapshot.alive && !heard_.snapshot.armed &&
           heard_.snapshot.last_end == ArmEnd::kSensorDisarmed;
  }
  /// Completes the result: which side was silent is known only once the sensor is heard again.
  void explain(CoreResult& done) const;
  /// This computer's delay, or a silence not yet explained; kNone for all other causes.
  Interruption interruption_by(const Cause& cause) const;
  /// True if the verdict on a trip received at `since` is overdue, and the sensor has been heard
  /// well after it: while nothing is received the verdict may be in transit.
  bool withheld(TimePoint since, TimePoint now) const;
  /// Cause of a contact during a move other than a search: by the sensor's message, or by the input
  /// alone.
  Cause touch() const;
  /// Evaluates a retreat's contact that was not heard to be open at `due`: 'closed' requires a later
  /// message of the sensor. Empty: undecided.
  std::optional<SensorRefusal> opening(TimePoint due, TimePoint now) const;
  /// Start of a move other than a search.
  void begin() { was_open_ = false; }
  /// After listen(), during a transit or a retreat: unexpected contact. A retreat begins in
  /// contact, and a contact that opens chatters.
  bool touched(MoveKind kind, TimePoint now);
  /// Retreat, after touched(): the contact was open at least once.
  bool opened() const { return was_open_; }

 private:
  ContactGuard* guard_;
  Heard heard_;
  std::optional<std::uint16_t> tripped_arm_;  ///< arming of the last trip received
  bool was_open_ = false;                     ///< retreat: contact was open at least once
  TimePoint opened_at_{};
};

}  // namespace cellcal::drivers
