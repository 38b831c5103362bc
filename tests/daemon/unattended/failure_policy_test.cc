#include <gtest/gtest.h>

#include <set>

#include "daemon/session/interruption.h"
#include "daemon/unattended/decision.h"

namespace cellcal::daemon {
namespace {

using drivers::Interruption;

constexpr std::size_t kKinds = static_cast<std::size_t>(FailureKind::kUnexpectedEvent) + 1;

TEST(TheAftermath, OfEveryFailureIsKnownWithItsReason) {
  std::set<FailureKind> known;
  std::set<std::pair<FailureKind, Interruption>> causes;
  for (const FailurePolicy& one : failure_policies()) {
    EXPECT_STRNE(one.reason, "");
    known.insert(one.failure);
    if (one.by) {
      EXPECT_TRUE(causes.emplace(one.failure, *one.by).second) << one.reason;
    }
  }
  EXPECT_EQ(known.size(), kKinds);
  EXPECT_EQ(causes.size(), 5u);
}

TEST(TheAftermath, ResumesNothingBehindWhichNoOtherSessionMightBegin) {
  for (const FailurePolicy& one : failure_policies())
    EXPECT_TRUE(one.begin || !one.resume) << one.reason;
}

TEST(TheAftermath, WaitsForSomebodyWhereTheArmMetSomethingOrSomebodyStoppedIt) {
  for (const FailureKind kind :
       {FailureKind::kUnexpectedContact, FailureKind::kContactTooEarly,
        FailureKind::kStillInContact, FailureKind::kContactClosed, FailureKind::kNotFollowing,
        FailureKind::kStoppedElsewhere, FailureKind::kStopUnconfirmed,
        FailureKind::kUnexpectedEvent, FailureKind::kJournal}) {
    EXPECT_FALSE(aftermath(kind, Interruption::kNone).begin) << to_string(kind);
  }
  EXPECT_FALSE(aftermath(FailureKind::kRobotSilent, Interruption::kOther).begin);
  EXPECT_FALSE(aftermath(FailureKind::kRobotSilent, Interruption::kNone).begin);
}

TEST(TheAftermath, OfASensorThatAPersonMayHaveUnpluggedWaitsForSomebody) {
  for (const Interruption by : {Interruption::kOther, Interruption::kNone}) {
    EXPECT_FALSE(aftermath(FailureKind::kContactSilent, by).resume);
    EXPECT_FALSE(aftermath(FailureKind::kContactSilent, by).begin);
  }
  EXPECT_TRUE(aftermath(FailureKind::kContactSilent, Interruption::kPacketsStopped).resume);
}

TEST(TheAftermath, ResumesWhateverASessionCouldHaveGoneOnFromByItself) {
  for (const InterruptionRule& harm : interruption_rule_table()) {
    if (harm.goes_on == GoesOn::kNever) continue;
    EXPECT_TRUE(aftermath(harm.failure, harm.by.value_or(Interruption::kNone)).resume)
        << harm.reason;
  }
}

}  // namespace
}  // namespace cellcal::daemon
