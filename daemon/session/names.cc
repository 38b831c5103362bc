// Names of phases, events, actions and failures.

#include <algorithm>

#include "daemon/files/atomic_file.h"
#include "daemon/session/action.h"
#include "daemon/session/session.h"

namespace cellcal::daemon {

const char* to_string(drivers::ContactEventKind kind) {
  switch (kind) {
    case drivers::ContactEventKind::kTrip:
      return "trip";
    case drivers::ContactEventKind::kContact:
      return "contact";
    case drivers::ContactEventKind::kRevoked:
      return "revoked";
    case drivers::ContactEventKind::kRelease:
      return "release";
  }
  return "unknown";
}

const char* to_string(Phase phase) {
  switch (phase) {
    case Phase::kIdle:
      return "idle";
    case Phase::kPlanning:
      return "planning";
    case Phase::kConnecting:
      return "connecting";
    case Phase::kReferencing:
      return "referencing";
    case Phase::kRouting:
      return "routing";
    case Phase::kFreeing:
      return "freeing";
    case Phase::kProving:
      return "proving";
    case Phase::kTransit:
      return "transit";
    case Phase::kArmingFast:
      return "arming fast";
    case Phase::kFastSearch:
      return "fast search";
    case Phase::kBackingOff:
      return "backing off";
    case Phase::kArmingSlow:
      return "arming slow";
    case Phase::kSlowSearch:
      return "slow search";
    case Phase::kRecording:
      return "recording";
    case Phase::kRetreat:
      return "retreat";
    case Phase::kChoosing:
      return "choosing";
    case Phase::kReturning:
      return "returning";
    case Phase::kIdentifying:
      return "identifying";
    case Phase::kReporting:
      return "reporting";
    case Phase::kRecovering:
      return "recovering";
    case Phase::kWatching:
      return "watching the links";
    case Phase::kStopping:
      return "stopping";
    case Phase::kDone:
      return "done";
    case Phase::kAborted:
      return "aborted";
    case Phase::kFailed:
      return "failed";
  }
  return "unknown phase";
}

std::optional<Phase> phase_of(std::string_view name) {
  const auto phase = std::find_if(kAllPhases.begin(), kAllPhases.end(),
                                  [&](Phase one) { return name == to_string(one); });
  return phase == kAllPhases.end() ? std::nullopt : std::optional(*phase);
}

const char* to_string(EventKind kind) {
  switch (kind) {
    case EventKind::kRun:
      return "run";
    case EventKind::kAbort:
      return "abort";
    case EventKind::kPlanned:
      return "planned";
    case EventKind::kRouted:
      return "routed";
    case EventKind::kAssessed:
      return "assessed";
    case EventKind::kIdentified:
      return "identified";
    case EventKind::kReported:
      return "reported";
    case EventKind::kWorkFailed:
      return "work failed";
    case EventKind::kLinks:
      return "links";
    case EventKind::kDeviceFailed:
      return "device failed";
    case EventKind::kArmed:
      return "armed";
    case EventKind::kArmRefused:
      return "arm refused";
    case EventKind::kArrived:
      return "arrived";
    case EventKind::kContact:
      return "contact";
    case EventKind::kRevoked:
      return "revoked";
    case EventKind::kStopped:
      return "stopped";
    case EventKind::kUnexpectedContact:
      return "unexpected contact";
    case EventKind::kStillInContact:
      return "still in contact";
    case EventKind::kContactSilent:
      return "contact silent";
    case EventKind::kRobotSilent:
      return "robot silent";
    case EventKind::kRefused:
      return "refused";
    case EventKind::kNotFollowing:
      return "not following";
    case EventKind::kRecorded:
      return "recorded";
    case EventKind::kJournalSound:
      return "journal sound";
    case EventKind::kJournalFailed:
      return "journal failed";
    case EventKind::kDeadline:
      return "deadline";
  }
  return "unknown event";
}

EventKind event_of(drivers::MoveOutcome outcome) {
  using drivers::MoveOutcome;
  switch (outcome) {
    case MoveOutcome::kArrived:
      return EventKind::kArrived;
    case MoveOutcome::kContact:
      return EventKind::kContact;
    case MoveOutcome::kRevoked:
      return EventKind::kRevoked;
    case MoveOutcome::kStopped:
      return EventKind::kStopped;
    case MoveOutcome::kUnexpectedContact:
      return EventKind::kUnexpectedContact;
    case MoveOutcome::kStillInContact:
      return EventKind::kStillInContact;
    case MoveOutcome::kContactSilent:
      return EventKind::kContactSilent;
    case MoveOutcome::kRobotSilent:
      return EventKind::kRobotSilent;
    case MoveOutcome::kRefused:
      return EventKind::kRefused;
    case MoveOutcome::kNotFollowing:
      return EventKind::kNotFollowing;
  }
  return EventKind::kRefused;  // every outcome is handled above
}

const char* name_of(const Action& action) {
  struct Names {
    const char* operator()(const MakePlan&) { return "make plan"; }
    const char* operator()(const FindRoute&) { return "find route"; }
    const char* operator()(const ChooseTouch&) { return "choose touch"; }
    const char* operator()(const TakeAnswer&) { return "take answer"; }
    const char* operator()(const Assess&) { return "assess"; }
    const char* operator()(const Identify&) { return "identify"; }
    const char* operator()(const WriteReport&) { return "write report"; }
    const char* operator()(const OpenDevices&) { return "open devices"; }
    const char* operator()(const Rereference&) { return "rereference"; }
    const char* operator()(const ArmSensor&) { return "arm sensor"; }
    const char* operator()(const Disarm&) { return "disarm"; }
    const char* operator()(const SelfTest&) { return "self-test"; }
    const char* operator()(const BeginMove&) { return "begin move"; }
    const char* operator()(const StopArm&) { return "stop arm"; }
    const char* operator()(const CloseDevices&) { return "close devices"; }
    const char* operator()(const RecordPlan&) { return "record plan"; }
    const char* operator()(const RecordReading&) { return "record reading"; }
    const char* operator()(const RecordTouch&) { return "record touch"; }
    const char* operator()(const CheckJournal&) { return "check journal"; }
    const char* operator()(const RecordInterruption&) { return "record interruption"; }
    const char* operator()(const RecordSearch&) { return "record search"; }
    const char* operator()(const RecordEnd&) { return "record end"; }
  };
  return std::visit(Names{}, action);
}

const char* to_string(FailureKind kind) {
  switch (kind) {
    case FailureKind::kPlan:
      return "plan";
    case FailureKind::kNotFound:
      return "not-found";
    case FailureKind::kPlanChanged:
      return "plan-changed";
    case FailureKind::kDevice:
      return "device";
    case FailureKind::kLinkNotReady:
      return "link-not-ready";
    case FailureKind::kContactFault:
      return "contact-fault";
    case FailureKind::kContactClosed:
      return "contact-closed";
    case FailureKind::kArmRefused:
      return "arm-refused";
    case FailureKind::kNoContact:
      return "no-contact";
    case FailureKind::kContactTooEarly:
      return "contact-too-early";
    case FailureKind::kUnexpectedContact:
      return "unexpected-contact";
    case FailureKind::kStillInContact:
      return "still-in-contact";
    case FailureKind::kReadingsDisagree:
      return "readings-disagree";
    case FailureKind::kTooManyRevoked:
      return "too-many-revoked";
    case FailureKind::kContactSilent:
      return "contact-silent";
    case FailureKind::kComputerBusy:
      return "computer-busy";
    case FailureKind::kRobotSilent:
      return "robot-silent";
    case FailureKind::kMoveRefused:
      return "move-refused";
    case FailureKind::kNotFollowing:
      return "not-following";
    case FailureKind::kStoppedElsewhere:
      return "stopped-elsewhere";
    case FailureKind::kTimeout:
      return "timeout";
    case FailureKind::kStopUnconfirmed:
      return "stop-unconfirmed";
    case FailureKind::kJournal:
      return "journal";
    case FailureKind::kIdentify:
      return "identify";
    case FailureKind::kReport:
      return "report";
    case FailureKind::kAttended:
      return "attended";
    case FailureKind::kControllerTest:
      return "controller-test";
    case FailureKind::kUnexpectedEvent:
      return "unexpected-event";
  }
  return "unknown-failure";
}

/// Separates a failure's kind from its detail.
constexpr std::string_view kKindSeparator = ": ";

std::string describe(const Failure& failure) {
  return printable(std::string(to_string(failure.kind)).append(kKindSeparator) + failure.detail);
}

std::string to_journal(const Failure& failure) { return describe(failure); }

Failure failure_from_journal(std::string_view text) {
  const std::size_t end = std::min(text.find(kKindSeparator.front()), text.size());
  Failure failure;
  failure.detail = text.substr(std::min(text.size(), end + kKindSeparator.size()));
  for (int kind = 0; kind <= static_cast<int>(FailureKind::kUnexpectedEvent); ++kind) {
    const auto one = static_cast<FailureKind>(kind);
    if (text.substr(0, end) == to_string(one)) failure.kind = one;
  }
  return failure;
}

}  // namespace cellcal::daemon
