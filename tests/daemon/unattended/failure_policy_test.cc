#include <gtest/gtest.h>

#include <set>

#include "daemon/session/interruption.h"
#include "daemon/unattended/decision.h"

namespace cellcal::daemon {
namespace {

using drivers::Interruption;

constexpr std::size_t kKinds = static_cast<std::size_t>(FailureKind::kUnexpectedEvent) + 1;

TEST(the_aftermath, of_every_failure_is_known_with_its_reason) {
  std::set<FailureKind> known;
  std::set<Interruption> of_the_robot;
  for (const FailurePolicy& one : failure_policies()) {
    EXPECT_STRNE(one.reason, "");
    known.insert(one.failure);
    if (one.by) {
      EXPECT_TRUE(of_the_robot.insert(*one.by).second) << one.reason;
    }
  }
  EXPECT_EQ(known.size(), kKinds);
  EXPECT_EQ(of_the_robot.size(), 3u);
}

TEST(the_aftermath, resumes_nothing_behind_which_no_other_session_might_begin) {
  for (const FailurePolicy& one : failure_policies())
    EXPECT_TRUE(one.begin || !one.resume) << one.reason;
}

TEST(the_aftermath, waits_for_somebody_where_the_arm_met_something_or_somebody_stopped_it) {
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

TEST(the_aftermath, resumes_whatever_a_session_could_have_gone_on_from_by_itself) {
  for (const InterruptionRule& harm : interruption_rule_table()) {
    if (harm.goes_on == GoesOn::kNever) continue;
    EXPECT_TRUE(aftermath(harm.failure, harm.by.value_or(Interruption::kNone)).resume)
        << harm.reason;
  }
}

}  // namespace
}  // namespace cellcal::daemon
