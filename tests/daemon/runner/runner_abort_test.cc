#include <gtest/gtest.h>

#include "tests/daemon/runner/fakes.h"

namespace cellcal::daemon::testing {
namespace {

class AnAbort : public ::testing::TestWithParam<Phase> {};

TEST_P(AnAbort, LeavesTheArmAtRestAndTheTouchesOnDisk) {
  const Phase phase = GetParam();
  Script script;
  script.contact_closed = phase == Phase::kFreeing || phase == Phase::kProving;
  const bool interrupted = phase == Phase::kRecovering || phase == Phase::kWatchingTheLinks;
  if (interrupted) {
    script.outcome[2] = drivers::MoveOutcome::kRobotSilent;
    script.interruption[2] = drivers::Interruption::kPacketsStopped;
    script.lost_for_ms = 16;
  }
  Session session(script);
  session.start.resumed = script.contact_closed;
  session.start.retries = interrupted ? 1 : 0;
  const State end = session.run_and_abort_in(phase);
  EXPECT_EQ(end.phase, Phase::kAborted) << to_string(end.phase);
  EXPECT_FALSE(end.failure.has_value());
  EXPECT_FALSE(session.backend.world.moving);
  EXPECT_FALSE(session.backend.world.robot_open);
  EXPECT_FALSE(session.backend.world.contact_open);
  EXPECT_EQ(session.backend.world.stops, kMovingPhases.has(phase) ? 1 : 0);
  ASSERT_EQ(session.recorder.ends.size(), 1u);
  EXPECT_EQ(session.recorder.ends[0].ending, Ending::kAborted);
  EXPECT_EQ(session.done.size(), session.recorder.touches.size());
}

std::vector<Phase> abortable() {
  std::vector<Phase> phases;
  for (Phase phase : kAllPhases) {
    // On the virtual clock the worker answers immediately: planning, routing, identifying,
    // reporting and recording cannot be interrupted. They are covered by the table's test. This
    // session's touches are planned beforehand; choosing is covered by one_by_one_test.
    const bool instantaneous = kThinkingPhases.has(phase) || phase == Phase::kRouting ||
                               phase == Phase::kRecording || phase == Phase::kChoosing;
    if (kActivePhases.has(phase) && !instantaneous) phases.push_back(phase);
  }
  return phases;
}

INSTANTIATE_TEST_SUITE_P(Runner, AnAbort, ::testing::ValuesIn(abortable()), [](const auto& one) {
  std::string name = to_string(one.param);
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
});

TEST(AnAbort, OfAnArmThatDoesNotStopSaysSo) {
  Session session({.endless_from = 1, .ignores_stop = true});
  const State end = session.run_and_abort_in(Phase::kTransit);
  ASSERT_EQ(end.phase, Phase::kFailed);
  EXPECT_EQ(end.failure->kind, FailureKind::kStopUnconfirmed);
}

TEST(AnAbort, ThatTheDiskRefusesToRecordIsANamedFailure) {
  Session session;
  session.recorder.fails_at = 2;  // the plan is the first record, the end the second
  const State end = session.run_and_abort_in(Phase::kTransit);
  ASSERT_EQ(end.phase, Phase::kFailed);
  EXPECT_EQ(end.failure->kind, FailureKind::kJournal);
}

}  // namespace
}  // namespace cellcal::daemon::testing
