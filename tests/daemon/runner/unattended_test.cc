// Unattended sessions.

#include <gtest/gtest.h>

#include "tests/daemon/runner/fakes.h"

namespace cellcal::daemon::testing {
namespace {

using drivers::OperatingMode;

Script script_of(OperatingMode mode, std::optional<int> override_percent) {
  Script script;
  script.mode = mode;
  script.override_percent = override_percent;
  return script;
}

State run(Script script, bool unattended, std::size_t* moves = nullptr) {
  Session session(std::move(script), 2);
  session.start.unattended = unattended;
  State end = session.run();
  if (moves != nullptr) *moves = session.backend.world.moves.size();
  return end;
}

TEST(ASessionWithoutAPerson, EndsBeforeItsFirstMotionWhereSomebodyWorksAtTheRobot) {
  const Script kSomebody[] = {script_of(OperatingMode::kT1, {}), script_of(OperatingMode::kT2, 100),
                              script_of(OperatingMode::kExt, 30),
                              script_of(OperatingMode::kUnknown, 0)};
  for (const Script& script : kSomebody) {
    std::size_t moves = 1;
    const State end = run(script, true, &moves);
    ASSERT_TRUE(end.failure);
    EXPECT_EQ(end.failure->kind, FailureKind::kAttended) << describe(*end.failure);
    EXPECT_EQ(moves, 0u);
    EXPECT_EQ(run(script, false).phase, Phase::kDone) << "a person may";
  }
}

TEST(ASessionWithoutAPerson, GoesOnWhereNobodyDoesOrTheLinkDoesNotTell) {
  EXPECT_EQ(run(script_of(OperatingMode::kAut, 100), true).phase, Phase::kDone);
  EXPECT_EQ(run(script_of(OperatingMode::kExt, {}), true).phase, Phase::kDone);
  EXPECT_EQ(run({}, true).phase, Phase::kDone);
}

TEST(WhatMadeTheRobotSilent, IsPartOfTheFailure) {
  Script script;
  script.outcome = {{2, drivers::MoveOutcome::kRobotSilent}};
  script.interruption = {{2, drivers::Interruption::kLateReplies}};
  EXPECT_EQ(run(script, false).failure->by, drivers::Interruption::kLateReplies);
  script.interruption = {{2, drivers::Interruption::kOther}};
  EXPECT_EQ(run(script, false).failure->by, drivers::Interruption::kOther);
}

}  // namespace
}  // namespace cellcal::daemon::testing
