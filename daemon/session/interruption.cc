#include "daemon/session/interruption.h"

#include <algorithm>
#include <array>
#include <numeric>

namespace cellcal::daemon {

namespace {

using drivers::Interruption;
using F = FailureKind;
using enum GoesOn;
constexpr std::nullopt_t kAny = std::nullopt;

// clang-format off
constexpr std::array kHarmless{
Harm{F::kComputerBusy,      Interruption::kLateReplies,    kRepeats, "the controller runs on and holds the arm; this computer was late"},
Harm{F::kComputerBusy,      Interruption::kLateBytes,      kRepeats, "the sensor sent in time, by its own stamps; this computer delivered late"},
Harm{F::kComputerBusy,      kAny, kNever, "no cause is known"},
Harm{F::kRobotSilent,       Interruption::kPacketsStopped, kRetries, "the arm holds without replies; harmless only if the same RSI session goes on"},
Harm{F::kRobotSilent,       Interruption::kOther,          kNever, "program ended or stopped, connection closed, watchdog tripped: requires an operator"},
Harm{F::kRobotSilent,       Interruption::kNone,           kNever, "no cause is known"},
Harm{F::kNotFollowing,      kAny, kNever, "emergency stop, enabling switch, drives off, collision: a person may be in the cell"},
Harm{F::kMoveRefused,       kAny, kNever, "the same move would be refused again"},
Harm{F::kStoppedElsewhere,  kAny, kNever, "stopped by another party"},
Harm{F::kUnexpectedContact, kAny, kNever, "the arm has met something that is not in the plan"},
Harm{F::kStillInContact,    kAny, kNever, "the tip may be stuck"},
Harm{F::kContactTooEarly,   kAny, kNever, "an obstacle is missing in the plan"},
Harm{F::kContactClosed,     kAny, kNever, "the tip touches something, or the line is shorted"},
Harm{F::kContactSilent,     Interruption::kUnheard,        kNever,   "held until the sensor's time stamps show the cause; lateness of this computer has its own row"},
Harm{F::kContactSilent,     kAny, kNever, "without the sensor no contact is detected"},
Harm{F::kContactFault,      kAny, kNever, "without the sensor no contact is detected"},
Harm{F::kArmRefused,        kAny, kNever, "the sensor was already asked twice"},
Harm{F::kNoContact,         kAny, kNever, "the sphere is not there, or the circuit is dead"},
Harm{F::kReadingsDisagree,  kAny, kNever, "dirt, a loose sphere or a loose tool remain"},
Harm{F::kTooManyRevoked,    kAny, kNever, "it was already repeated"},
Harm{F::kDevice,            kAny, kNever, "a port or address is lost"},
Harm{F::kLinkNotReady,      kAny, kNever, "already waited for"},
Harm{F::kTimeout,           kAny, kNever, "the reason is not known"},
Harm{F::kStopUnconfirmed,   kAny, kNever, "the arm may still move"},
Harm{F::kJournal,           kAny, kNever, "nothing moves that cannot be recorded"},
Harm{F::kPlan,              kAny, kNever, "no free path exists"},
Harm{F::kNotFound,          kAny, kNever, "a person has to measure the position of the sphere"},
Harm{F::kPlanChanged,       kAny, kNever, "it would be another session"},
Harm{F::kIdentify,          kAny, kNever, "the same touches give the same answer"},
Harm{F::kReport,            kAny, kNever, "the disk has to be checked first"},
Harm{F::kAttended,          kAny, kNever, "a person works at the robot"},
Harm{F::kControllerTest,    kAny, kNever, "the controller's program is left for its test"},
Harm{F::kUnexpectedEvent,   kAny, kNever, "the cause is not known"},
};
// clang-format on

}  // namespace

std::span<const Harm> harm_table() { return kHarmless; }

GoesOn goes_on(FailureKind failure, Interruption by) {
  const auto row = std::find_if(kHarmless.begin(), kHarmless.end(), [&](const Harm& harm) {
    return harm.failure == failure && (!harm.by || *harm.by == by);
  });
  return row != kHarmless.end() ? row->goes_on : kNever;
}

int InterruptionCounts::total() const { return std::accumulate(of.begin(), of.end(), 0); }

int InterruptionCounts::of_computer() const {
  int late = 0;
  for (std::size_t i = 0; i < of.size(); ++i)
    if (kCountedCauses[i].of_computer) late += of[i];
  return late;
}

void InterruptionCounts::count(Interruption by) {
  for (std::size_t i = 0; i < of.size(); ++i)
    if (kCountedCauses[i].by == by) ++of[i];
}

const char* name_of_cause(Interruption by) {
  for (const CountedCause& one : kCountedCauses)
    if (one.by == by) return one.name;
  return "";
}

std::optional<Interruption> cause_of(std::string_view name) {
  for (const CountedCause& one : kCountedCauses)
    if (one.name == name) return one.by;
  return std::nullopt;
}

std::string words(const InterruptionCounts& counts) {
  std::string all;
  for (std::size_t i = 0; i < counts.of.size(); ++i)
    if (counts.of[i] > 0)
      all +=
          (all.empty() ? "" : ", ") + std::to_string(counts.of[i]) + " " + kCountedCauses[i].words;
  return all;
}

FailureKind failure_by(Interruption by, FailureKind otherwise) {
  const bool late = by == Interruption::kLateReplies || by == Interruption::kLateBytes;
  return late ? FailureKind::kComputerBusy : otherwise;
}

}  // namespace cellcal::daemon
