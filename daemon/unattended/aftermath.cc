#include "daemon/unattended/aftermath.h"

#include <algorithm>
#include <array>

namespace cellcal::daemon {

namespace {

using drivers::Interruption;
using F = FailureKind;
constexpr std::nullopt_t kAny = std::nullopt;

// clang-format off
constexpr std::array kTable{
//                                                     resume begin
FailurePolicy{F::kComputerBusy,      kAny, true,  true,  "robot and sensor were sound; this computer was late"},
FailurePolicy{F::kRobotSilent,       Interruption::kPacketsStopped, true,  true,  "the arm holds without replies; the link is opened anew"},
FailurePolicy{F::kRobotSilent,       Interruption::kOther,          false, false, "program ended or stopped, connection closed: possibly by a person"},
FailurePolicy{F::kRobotSilent,       Interruption::kNone,           false, false, "no cause is known"},
FailurePolicy{F::kContactSilent,     kAny, true,  true,  "the arm was stopped; the sensor repeats its self-test before any motion"},
FailurePolicy{F::kDevice,            kAny, true,  true,  "nothing has moved: the port may be back"},
FailurePolicy{F::kLinkNotReady,      kAny, true,  true,  "nothing has moved: the link may come later"},
FailurePolicy{F::kAttended,          kAny, false, true,  "nothing has moved; a person works at the robot"},
FailurePolicy{F::kControllerTest,    kAny, true,  true,  "the arm rests out of contact; the controller's own test comes first"},
FailurePolicy{F::kIdentify,          kAny, false, true,  "the arm had finished; the same touches give the same answer"},
FailurePolicy{F::kContactFault,      kAny, false, false, "a wire or the sensor is to be repaired"},
FailurePolicy{F::kContactClosed,     kAny, false, false, "the tip touches something, or the line is shorted"},
FailurePolicy{F::kArmRefused,        kAny, false, false, "the sensor was already asked twice"},
FailurePolicy{F::kNoContact,         kAny, false, false, "the sphere is not there, or the circuit is dead"},
FailurePolicy{F::kContactTooEarly,   kAny, false, false, "an obstacle is missing in the plan"},
FailurePolicy{F::kUnexpectedContact, kAny, false, false, "the arm has met something that is not in the plan"},
FailurePolicy{F::kStillInContact,    kAny, false, false, "the tip may be stuck"},
FailurePolicy{F::kReadingsDisagree,  kAny, false, false, "dirt, a loose sphere or a loose tool remain"},
FailurePolicy{F::kTooManyRevoked,    kAny, false, false, "the noise remains"},
FailurePolicy{F::kMoveRefused,       kAny, false, false, "the same move would be refused again"},
FailurePolicy{F::kNotFollowing,      kAny, false, false, "emergency stop, drives off, collision: a person may be in the cell"},
FailurePolicy{F::kStoppedElsewhere,  kAny, false, false, "stopped by another party"},
FailurePolicy{F::kTimeout,           kAny, false, false, "the reason is not known"},
FailurePolicy{F::kStopUnconfirmed,   kAny, false, false, "the arm may still move"},
FailurePolicy{F::kPlan,              kAny, false, false, "no free path exists from the arm's position"},
FailurePolicy{F::kNotFound,          kAny, false, false, "a person has to measure the position of the sphere"},
FailurePolicy{F::kPlanChanged,       kAny, false, false, "a person has to begin another session"},
FailurePolicy{F::kJournal,           kAny, false, false, "nothing moves that cannot be recorded"},
FailurePolicy{F::kReport,            kAny, false, false, "the disk has to be checked first"},
FailurePolicy{F::kUnexpectedEvent,   kAny, false, false, "the cause is not known"},
};
// clang-format on

}  // namespace

std::span<const FailurePolicy> failure_policies() { return kTable; }

const FailurePolicy& aftermath(FailureKind failure, Interruption by) {
  const auto row = std::find_if(kTable.begin(), kTable.end(), [&](const FailurePolicy& one) {
    return one.failure == failure && (!one.by || *one.by == by);
  });
  return row != kTable.end() ? *row : kTable.back();
}

}  // namespace cellcal::daemon
