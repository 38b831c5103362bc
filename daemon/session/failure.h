#pragma once
// Failures of a session: a named kind, and the evidence as a phrase that states what happened, where, and what
// to do next.

#include <string>
#include <string_view>

#include "calib/model/enum_table.h"
#include "calib/words/phrase.h"
#include "drivers/robot.h"

namespace cellcal::daemon {

enum class FailureKind {
  kPlan,               ///< no plan, or no clear path from the arm's position
  kNotFound,           ///< a sphere cannot be located
  kPlanChanged,        ///< resumed, but the stored inputs no longer reproduce the stored plan
  kDevice,             ///< a device or address could not be opened
  kLinkNotReady,       ///< robot or contact sensor did not become ready in time
  kContactFault,       ///< the contact sensor is not trustworthy (loop, self-test, restarted)
  kContactClosed,      ///< contact is closed before the first move
  kArmRefused,         ///< the sensor refused to be armed
  kNoContact,          ///< end of the search without contact
  kContactTooEarly,    ///< contact before the plausible window
  kUnexpectedContact,  ///< contact outside a search
  kStillInContact,     ///< contact did not open on the way back
  kReadingsDisagree,   ///< readings of one touch do not repeat
  kTooManyRevoked,     ///< too many trips caused by noise
  kContactSilent,      ///< no data of the contact sensor, or its port is lost
  kComputerBusy,  ///< this computer was late (sensor data or replies); robot and sensor were sound
  kRobotSilent,
  kMoveRefused,
  kNotFollowing,
  kStoppedElsewhere,  ///< the move was stopped by another party
  kTimeout,           ///< a phase took longer than anything plausible
  kStopUnconfirmed,   ///< stop commanded, rest not confirmed: use the emergency stop
  kJournal,           ///< a touch or the session could not be written to disk
  kIdentify,
  kReport,
  kAttended,        ///< an unattended session, with a person working at the robot
  kControllerTest,  ///< an unattended session, with the controller requesting its brake or mastering test
  kWindowOver,       ///< aborted by the schedule: its window is over
  kDaemonStopped,    ///< aborted by the end of the daemon
  kUnexpectedEvent,  ///< an event that the table does not list for this phase
};

/// "no-contact", as used by the journal and the API.
constexpr const char* to_string(FailureKind kind) { return own_name<'-'>(kind); }

/// Resumed with the stored cell file and touches, a session ends in these again: a new one follows.
constexpr bool fails_again(FailureKind kind) {
  using enum FailureKind;
  return kind == kNotFound || kind == kPlanChanged || kind == kIdentify;
}

struct Failure {
  FailureKind kind = FailureKind::kUnexpectedEvent;
  calib::Phrase detail;
  /// Cause of kRobotSilent, kComputerBusy, kContactSilent.
  drivers::Interruption by = drivers::Interruption::kNone;

  bool operator==(const Failure&) const = default;
};

/// Kind and evidence.
calib::Phrase phrase(const Failure& failure);
/// The failure as one line of text, safe for terminals and logs.
std::string describe(const Failure& failure, const calib::Language& language = {});

/// Column `failure` of the journal's table `session`, and RecordEnd::failure: the form of describe() in English, e.g.
/// "no-contact: no contact up to 8 mm" (to_string of the kind, a colon, a blank, the detail). The cause of
/// the failure is not included.
std::string to_journal(const Failure& failure);
/// Inverse of to_journal(), except for unprintable characters of the detail. A kind unknown to this version
/// gives kUnexpectedEvent with the text after the colon as its detail.
Failure failure_from_journal(std::string_view text);
/// phrase() as JSON, {"format": "cellcal.failure/1", "said": ...}: column `document` of a failed session.
std::string failure_to_json(const Failure& failure);
/// Empty for anything else.
calib::Phrase failure_said_in(std::string_view json);

}  // namespace cellcal::daemon
