#include "daemon/session/interruption.h"

#include <algorithm>
#include <array>

namespace cellcal::daemon {

namespace {

using drivers::Interruption;
using F = FailureKind;
constexpr std::nullopt_t kAny = std::nullopt;

// clang-format off
constexpr std::array kHarmless{
Harm{F::kRobotSilent,       Interruption::kLateReplies,    true,  "the controller runs on and holds the arm; this computer was late"},
Harm{F::kRobotSilent,       Interruption::kPacketsStopped, true,  "the arm holds without replies; harmless only if the same RSI session goes on"},
Harm{F::kRobotSilent,       Interruption::kOther,          false, "program ended or stopped, connection closed, watchdog tripped: an operator has to look"},
Harm{F::kRobotSilent,       Interruption::kNone,           false, "no cause is known"},
Harm{F::kNotFollowing,      kAny, false, "emergency stop, enabling switch, drives off, collision: somebody may be in the cell"},
Harm{F::kMoveRefused,       kAny, false, "the same move would be refused again"},
Harm{F::kStoppedElsewhere,  kAny, false, "somebody else stopped it"},
Harm{F::kUnexpectedContact, kAny, false, "the arm has met something that is not in the plan"},
Harm{F::kStillInContact,    kAny, false, "the tip may be stuck"},
Harm{F::kContactTooEarly,   kAny, false, "something stands where the plan has nothing"},
Harm{F::kContactClosed,     kAny, false, "the tip touches something, or the line is shorted"},
Harm{F::kContactSilent,     kAny, false, "without the sensor no contact is detected"},
Harm{F::kContactFault,      kAny, false, "without the sensor no contact is detected"},
Harm{F::kArmRefused,        kAny, false, "the sensor was already asked twice"},
Harm{F::kNoContact,         kAny, false, "the sphere is not there, or the circuit is dead"},
Harm{F::kReadingsDisagree,  kAny, false, "dirt, a loose sphere or a loose tool remain"},
Harm{F::kTooManyRevoked,    kAny, false, "it was already repeated"},
Harm{F::kDevice,            kAny, false, "a port or address is lost"},
Harm{F::kLinkNotReady,      kAny, false, "it was already waited for"},
Harm{F::kTimeout,           kAny, false, "the reason is not known"},
Harm{F::kStopUnconfirmed,   kAny, false, "the arm may still move"},
Harm{F::kJournal,           kAny, false, "nothing moves that cannot be recorded"},
Harm{F::kPlan,              kAny, false, "no free path exists"},
Harm{F::kPlanChanged,       kAny, false, "it would be another session"},
Harm{F::kIdentify,          kAny, false, "the same touches give the same answer"},
Harm{F::kReport,            kAny, false, "the disk has to be checked first"},
Harm{F::kAttended,          kAny, false, "somebody works at the robot"},
Harm{F::kUnexpectedEvent,   kAny, false, "the cause is not known"},
};
// clang-format on

}  // namespace

std::span<const Harm> harm_table() { return kHarmless; }

bool is_harmless(FailureKind failure, Interruption by) {
  const auto row = std::find_if(kHarmless.begin(), kHarmless.end(), [&](const Harm& harm) {
    return harm.failure == failure && (!harm.by || *harm.by == by);
  });
  return row != kHarmless.end() && row->harmless;
}

}  // namespace cellcal::daemon
