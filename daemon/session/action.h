#pragma once
// Actions of a session. The runner performs them in order; when one fails, the rest of that step is dropped
// and the failure comes back as an event.

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "calib/model/enum_table.h"
#include "calib/model/touch.h"
#include "calib/plan/touch_sequence.h"
#include "daemon/session/event.h"
#include "daemon/session/failure.h"
#include "daemon/session/phase.h"
#include "drivers/contact.h"
#include "drivers/robot.h"

namespace cellcal::daemon {

struct Event;
struct SessionResult;  // daemon/result: passed through unread

/// One slow or fast search that ended in contact.
struct Reading {
  drivers::AxisAngles contact_rad;  ///< at the instant of contact
  drivers::AxisAngles settled_rad;  ///< at rest after the stop
  double along_m = 0.0;             ///< tip travel from the stand-off, along the search line
  bool slow = false;
  double time_sigma_s = 0.0;
  double reaction_s = 0.0;
  int bounces = 0;
  std::string utc;
};

// Requests to the worker, answered by kPlanned, kRouted, kAssessed, kIdentified, kReported or kWorkFailed.
struct MakePlan {};
struct FindRoute {
  std::size_t next = 0;     ///< index of the first touch still to be made
  bool in_contact = false;  ///< the path begins in contact
  std::uint32_t route_id = 0;
};
/// In a session with touches chosen one by one. Answered by kRouted.
struct ChooseTouch {
  std::optional<calib::NotMade> failed;  ///< the touch offered last could not be made
  bool in_contact = false;               ///< the path begins in contact with a sphere
  drivers::AxisAngles from_rad;  ///< future position of the arm; empty: its current position
  std::uint32_t route_id = 0;
};
struct Assess {};
struct Identify {};
struct WriteReport {
  std::shared_ptr<const SessionResult> result;
};

/// Delivers an answer that the worker gave ahead of time, as the same event.
struct TakeAnswer {
  std::shared_ptr<const Event> answer;
};

// Requests to the devices.
struct OpenDevices {};
struct Rereference {};
struct ArmSensor {
  std::uint16_t arm_id = 0;
  std::chrono::milliseconds lifetime{0};
};
struct Disarm {};
struct SelfTest {};
struct BeginMove {
  drivers::Move move;
};
struct StopArm {};
struct CloseDevices {};  ///< disarms too; no effect where nothing is open

// Requests to the journal, in order, while the session continues. RecordTouch and RecordEnd are answered by
// kRecorded, all of them by kJournalFailed on failure.
struct RecordPlan {
  std::string hash;
  std::size_t touches = 0;
};
struct RecordReading {
  std::size_t touch = 0;
  int number = 0;  ///< counts up within the touch
  Reading reading;
};
struct RecordTouch {
  std::size_t index = 0;
  calib::Touch touch;
  // For status publication only; not part of any row.
  std::optional<std::array<double, 3>> tip_m{};  ///< nominal model [m, base frame]
  std::optional<double> residual_m{};            ///< after assessment
};
/// While spheres are located: on disk before the arm enters the search.
struct RecordSearch {
  std::shared_ptr<const calib::SearchUnderWay> search;
};
/// Answered by kJournalSound once every earlier request is on disk and the journal is still the file that it
/// was written to.
struct CheckJournal {
  std::uint32_t move_id = 0;  ///< the move that waits for it
};
/// A line of the session's log; losing it is not a failure.
struct RecordInterruption {
  int number = 0, most = 0;
  /// Repeats caused by lateness of this computer: number and most are those of the session, these of one
  /// touch. 0: another cause.
  int of_touch = 0, most_of_touch = 0;
  std::string failure;  ///< describe(Failure): the failure that would have ended the session
  drivers::Interruption by = drivers::Interruption::kNone;
};
enum class Ending { kDone, kAborted, kFailed };
struct RecordEnd {
  Ending ending = Ending::kDone;
  std::string failure;                            ///< to_journal(why); empty: none
  std::optional<Failure> why{};                   ///< kFailed, and kAborted by the daemon itself
  std::shared_ptr<const SessionResult> result{};  ///< kDone
};

using Action = std::variant<MakePlan, FindRoute, ChooseTouch, TakeAnswer, Assess, Identify,
                            WriteReport, OpenDevices, Rereference, ArmSensor, Disarm, SelfTest,
                            BeginMove, StopArm, CloseDevices, RecordPlan, RecordReading,
                            RecordTouch, CheckJournal, RecordInterruption, RecordSearch, RecordEnd>;

/// Name of the action, for logs and tests.
const char* name_of(const Action& action);

// Evidence recorded with a session besides its touches: every change of phase, and every event of the contact
// sensor as received. No decision depends on it.

struct RecordChange {
  PhaseChange change;
  EventKind on = EventKind::kRun;
  std::string utc{};
  double clock_s = 0.0;  ///< session's clock
  /// Late replies as the controller counted them by then, and how late this computer delivered the
  /// sensor's bytes at worst.
  std::uint64_t late_replies = 0;
  double sensor_late_s = 0.0;
};

struct RecordContact {
  std::size_t touch = 0;  ///< current touch
  std::string utc;        ///< time of the event
  drivers::ContactRecord contact;
};

/// A harmless interruption, by its cause.
struct RecordCause {
  std::string utc;
  drivers::Interruption by = drivers::Interruption::kNone;
};

/// "trip", "contact", "revoked", "release".
constexpr const char* to_string(drivers::ContactEventKind kind) { return own_name(kind); }

}  // namespace cellcal::daemon
