#pragma once
// Why a session failed: a named type, and the evidence in words that say what happened, where, and
// what to do next.

#include <string>
#include <string_view>

#include "drivers/robot.h"

namespace cellcal::daemon {

enum class FailureKind {
  kPlan,               ///< no plan, or no clear way from where the arm stands
  kNotFound,           ///< a sphere is not where the cell file says, or cannot be located
  kPlanChanged,        ///< resumed, but the stored inputs no longer give the stored plan
  kDevice,             ///< a device or address could not be opened
  kLinkNotReady,       ///< robot or contact sensor did not become ready in time
  kContactFault,       ///< the contact sensor cannot be trusted (loop, self-test, lost, silent)
  kContactClosed,      ///< contact is closed before the first move
  kArmRefused,         ///< the sensor would not be armed
  kNoContact,          ///< end of the search without contact
  kContactTooEarly,    ///< contact before the plausible window
  kUnexpectedContact,  ///< contact outside a search
  kStillInContact,     ///< contact did not open on the way back
  kReadingsDisagree,   ///< readings of one touch do not repeat
  kTooManyRevoked,     ///< trips that were noise, again and again
  kContactSilent,
  kComputerBusy,  ///< this computer was late: sensor data or replies; robot and sensor were sound
  kRobotSilent,
  kMoveRefused,
  kNotFollowing,
  kStoppedElsewhere,  ///< the move was stopped, but not by this session
  kTimeout,           ///< a phase took longer than anything plausible
  kStopUnconfirmed,   ///< stop commanded, but no sign of rest: use the emergency stop
  kJournal,           ///< a touch or the session could not be put on disk
  kIdentify,
  kReport,
  kAttended,         ///< a session without a person, and somebody works at the robot
  kControllerTest,   ///< likewise, and the controller asks for its brake or mastering test
  kUnexpectedEvent,  ///< an event that the table does not list for this phase
};

/// Hyphenated name, e.g. "no-contact"; stands in the journal and the API.
const char* to_string(FailureKind kind);

struct Failure {
  FailureKind kind = FailureKind::kUnexpectedEvent;
  std::string detail;
  /// kRobotSilent, kComputerBusy, kContactSilent: what was behind it.
  drivers::Interruption by = drivers::Interruption::kNone;

  bool operator==(const Failure&) const = default;
};

/// The failure as one line of text, safe for a terminal and a log.
std::string describe(const Failure& failure);

/// The column `failure` of the journal's table `session`, and RecordEnd::failure: as
/// describe() has it, "no-contact: no contact up to 8 mm" (to_string of the kind, a colon, a blank,
/// the detail). What was behind the failure is not in it.
std::string to_journal(const Failure& failure);
/// What to_journal() wrote, but for the detail's characters that no terminal shows. Of a kind that
/// this version does not know: kUnexpectedEvent, its detail what stands behind the colon.
Failure failure_from_journal(std::string_view text);

}  // namespace cellcal::daemon
