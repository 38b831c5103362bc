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
Aftermath{F::kComputerBusy,      kAny, true,  true,  "robot and sensor were sound; this computer was late"},
Aftermath{F::kRobotSilent,       Interruption::kPacketsStopped, true,  true,  "the arm holds without replies; the link is opened anew"},
Aftermath{F::kRobotSilent,       Interruption::kOther,          false, false, "program ended or stopped, connection closed: possibly by a person"},
Aftermath{F::kRobotSilent,       Interruption::kNone,           false, false, "no cause is known"},
Aftermath{F::kContactSilent,     kAny, true,  true,  "the arm was stopped; the sensor repeats its self-test before any motion"},
Aftermath{F::kDevice,            kAny, true,  true,  "nothing has moved: the port may be back"},
Aftermath{F::kLinkNotReady,      kAny, true,  true,  "nothing has moved: the link may come later"},
Aftermath{F::kAttended,          kAny, false, true,  "nothing has moved; a person works at the robot"},
Aftermath{F::kControllerTest,    kAny, true,  true,  "the arm rests out of contact; the controller's own test comes first"},
Aftermath{F::kIdentify,          kAny, false, true,  "the arm had finished; the same touches give the same answer"},
Aftermath{F::kContactFault,      kAny, false, false, "a wire or the sensor is to be repaired"},
Aftermath{F::kContactClosed,     kAny, false, false, "the tip touches something, or the line is shorted"},
Aftermath{F::kArmRefused,        kAny, false, false, "the sensor was already asked twice"},
Aftermath{F::kNoContact,         kAny, false, false, "the sphere is not there, or the circuit is dead"},
Aftermath{F::kContactTooEarly,   kAny, false, false, "an obstacle is missing in the plan"},
Aftermath{F::kUnexpectedContact, kAny, false, false, "the arm has met something that is not in the plan"},
Aftermath{F::kStillInContact,    kAny, false, false, "the tip may be stuck"},
Aftermath{F::kReadingsDisagree,  kAny, false, false, "dirt, a loose sphere or a loose tool remain"},
Aftermath{F::kTooManyRevoked,    kAny, false, false, "the noise remains"},
Aftermath{F::kMoveRefused,       kAny, false, false, "the same move would be refused again"},
Aftermath{F::kNotFollowing,      kAny, false, false, "emergency stop, drives off, collision: a person may be in the cell"},
Aftermath{F::kStoppedElsewhere,  kAny, false, false, "stopped by another party"},
Aftermath{F::kTimeout,           kAny, false, false, "the reason is not known"},
Aftermath{F::kStopUnconfirmed,   kAny, false, false, "the arm may still move"},
Aftermath{F::kPlan,              kAny, false, false, "no free path exists from the arm's position"},
Aftermath{F::kNotFound,          kAny, false, false, "a person has to measure the position of the sphere"},
Aftermath{F::kPlanChanged,       kAny, false, false, "a person has to begin another session"},
Aftermath{F::kJournal,           kAny, false, false, "nothing moves that cannot be recorded"},
Aftermath{F::kReport,            kAny, false, false, "the disk has to be checked first"},
Aftermath{F::kUnexpectedEvent,   kAny, false, false, "the cause is not known"},
};
// clang-format on

}  // namespace

std::span<const Aftermath> aftermath_table() { return kTable; }

const Aftermath& aftermath(FailureKind failure, Interruption by) {
  const auto row = std::find_if(kTable.begin(), kTable.end(), [&](const Aftermath& one) {
    return one.failure == failure && (!one.by || *one.by == by);
  });
  return row != kTable.end() ? *row : kTable.back();
}

}  // namespace cellcal::daemon
