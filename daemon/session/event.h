#pragma once
// Events of a session: the kind selects the row of the table, the evidence is that of the kind.

#include <concepts>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "calib/model/enum_table.h"
#include "calib/plan/touch_sequence.h"
#include "calib/words/phrase.h"
#include "daemon/session/failure.h"
#include "drivers/contact.h"
#include "drivers/robot.h"

namespace cellcal::daemon {

struct SessionResult;  // daemon/result: passed through unread

enum class EventKind : std::uint8_t {
  // Requests from outside.
  kRun,
  kAbort,
  // Answers of the worker.
  kPlanned,
  kRouted,
  kAssessed,  ///< residual of the newest touch, and the expected contacts of the next ones
  kIdentified,
  kReported,
  kWorkFailed,
  // Reports of the devices.
  kLinks,  ///< status of robot or sensor changed
  kDeviceFailed,
  kArmed,
  kArmRefused,
  // Results of a move, as drivers::MoveOutcome. The arm is at rest in all of them.
  kArrived,
  kContact,
  kRevoked,
  kStopped,
  kUnexpectedContact,
  kStillInContact,
  kContactSilent,
  kRobotSilent,
  kRefused,
  kNotFollowing,
  // Reports of journal and clock.
  kRecorded,
  kJournalSound,  ///< everything recorded before this move is on disk
  kJournalFailed,
  kDeadline,
};

inline constexpr auto kAllEvents = all_values<EventKind>();

constexpr const char* to_string(EventKind kind) { return own_name<' '>(kind); }
EventKind event_of(drivers::MoveOutcome outcome);

/// Set of events, as named by one row of the table.
class Events {
 public:
  template <typename... K>
  requires(std::same_as<K, EventKind>&&...) constexpr explicit(false) Events(K... kinds)
      : bits_((bit(kinds) | ... | 0u)) {}
  constexpr bool has(EventKind kind) const { return (bits_ & bit(kind)) != 0; }
  static constexpr Events all() {
    Events result;
    for (EventKind kind : kAllEvents) result.bits_ |= bit(kind);
    return result;
  }

 private:
  static constexpr std::uint32_t bit(EventKind kind) { return 1u << static_cast<unsigned>(kind); }
  std::uint32_t bits_ = 0;
};

inline constexpr Events kMoveResults{EventKind::kArrived,           EventKind::kContact,
                                     EventKind::kRevoked,           EventKind::kStopped,
                                     EventKind::kUnexpectedContact, EventKind::kStillInContact,
                                     EventKind::kContactSilent,     EventKind::kRobotSilent,
                                     EventKind::kRefused,           EventKind::kNotFollowing};

/// State of the devices as seen by the session.
struct Links {
  drivers::RobotLink robot = drivers::RobotLink::kDown;
  drivers::AxisAngles actual_rad;
  drivers::Interruption interruption = drivers::Interruption::kNone;  ///< of the robot's link
  std::uint32_t interruptions = 0;                                    ///< count so far
  std::uint32_t robot_session = 0;  ///< session number of the controller
  std::uint64_t late = 0;           ///< late replies, as counted by the controller
  bool needs_operator = false, unsettled = false;
  drivers::OperatingMode mode = drivers::OperatingMode::kUnknown;
  bool override_slows = false;          ///< as in drivers::RobotState
  std::optional<int> override_percent;  ///< none: not reported
  drivers::ControllerRequest request = drivers::ControllerRequest::kNone;
  calib::Phrase robot_words;
  drivers::ContactLink contact = drivers::ContactLink::kDown;
  bool in_contact = false;
  bool can_guard_retreat = false;
  bool self_test_ok = false;
  bool clock_ok = false;  ///< the sensor's clock map is valid
  drivers::ContactFault fault = drivers::ContactFault::kNone;
  drivers::ContactDelivery delivery;
  calib::Phrase contact_words;

  EventKind kind() const { return EventKind::kLinks; }
  bool ready() const { return robot_up() && contact == drivers::ContactLink::kReady; }
  /// The sensor's data are late, or missing without evidence of a sensor fault.
  bool late_here() const {
    return fault == drivers::ContactFault::kDeliveredLate ||
           (fault == drivers::ContactFault::kSilent && delivery.open);
  }
  /// Packets arrive, and the controller is ready to be moved.
  bool robot_up() const {
    return robot != drivers::RobotLink::kDown && robot != drivers::RobotLink::kLost &&
           !needs_operator;
  }
};

/// Result of a move. The arm is at rest.
struct MoveEnded {
  drivers::MoveOutcome outcome = drivers::MoveOutcome::kArrived;
  std::uint32_t move_id = 0;
  drivers::AxisAngles at_rad{};
  drivers::Interruption interruption = drivers::Interruption::kNone;
  std::optional<drivers::Latch> latch{};
  EventKind kind() const { return event_of(outcome); }
};

struct ArmAnswer {
  bool armed = false;
  std::uint16_t arm_id = 0;
  drivers::ArmRefusal refusal = drivers::ArmRefusal::kNone;
  EventKind kind() const { return armed ? EventKind::kArmed : EventKind::kArmRefused; }
};

struct Aborted {
  std::optional<FailureKind> why{};  ///< of the daemon itself; none: requested by a person
  EventKind kind() const { return EventKind::kAbort; }
};

/// A plan to be carried out from here on.
struct Offer {
  std::shared_ptr<const calib::Plan> plan{};
  calib::Phrase stage{};       ///< purpose of the touch
  calib::Progress progress{};  ///< with touches chosen one by one
};

struct Planned {
  Offer offer{};
  std::string plan_hash{};
  EventKind kind() const { return EventKind::kPlanned; }
};

struct Routed {
  Offer offer{};
  std::uint32_t route_id = 0;  ///< of the request; 0: none
  /// While spheres are located: the offered path, and the way out of it.
  std::shared_ptr<const calib::SearchUnderWay> search{};
  /// A sphere cannot be located, for the reason in the event's words; the plan leads home.
  bool not_found = false;
  EventKind kind() const { return EventKind::kRouted; }
};

struct WorkFailed {
  std::uint32_t route_id = 0;  ///< of the request; 0: none
  EventKind kind() const { return EventKind::kWorkFailed; }
};

struct Assessed {
  std::optional<double> residual_m{};
  /// Number of touches at which the residual is that of the newest.
  std::size_t assessed = 0;
  /// Per touch of the plan; null: not known yet.
  std::shared_ptr<const std::vector<calib::ExpectedContact>> expected{};
  EventKind kind() const { return EventKind::kAssessed; }
};

struct Identified {
  std::shared_ptr<const SessionResult> result{};
  EventKind kind() const { return EventKind::kIdentified; }
};

/// Everything recorded before this move is on disk.
struct JournalSound {
  std::uint32_t move_id = 0;
  EventKind kind() const { return EventKind::kJournalSound; }
};

/// A kind that is its own evidence.
template <EventKind kKind>
struct Plain {
  EventKind kind() const { return kKind; }
};

using EventEvidence =
    std::variant<Plain<EventKind::kRun>, Aborted, Planned, Routed, Assessed, Identified,
                 Plain<EventKind::kReported>, WorkFailed, Links, Plain<EventKind::kDeviceFailed>,
                 ArmAnswer, MoveEnded, Plain<EventKind::kRecorded>, JournalSound,
                 Plain<EventKind::kJournalFailed>, Plain<EventKind::kDeadline>>;

struct Event {
  EventEvidence evidence{};
  calib::Phrase words{};    ///< reason given by driver, worker or journal
  drivers::TimePoint at{};  ///< session clock
  std::string utc{};        ///< wall time, ISO 8601

  EventKind kind() const {
    return std::visit([](const auto& of_kind) { return of_kind.kind(); }, evidence);
  }
  /// The evidence of this type; of events of another kind an empty one.
  template <class T>
  const T& get() const {
    static const T kNone{};
    const T* found = std::get_if<T>(&evidence);
    return found != nullptr ? *found : kNone;
  }
  const MoveEnded& move() const { return get<MoveEnded>(); }
  const Routed& routed() const { return get<Routed>(); }
  const Offer& offer() const {
    const Planned* planned = std::get_if<Planned>(&evidence);
    return planned != nullptr ? planned->offer : routed().offer;
  }
};

}  // namespace cellcal::daemon
