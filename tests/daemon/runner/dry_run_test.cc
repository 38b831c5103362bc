// A dry run: the complete path, without any contact.

#include <gtest/gtest.h>

#include "tests/daemon/runner/fakes.h"

namespace cellcal::daemon::testing {
namespace {

using drivers::MoveKind;

struct DryRun : Session {
  explicit DryRun(Script script = {}, std::size_t touches = 3)
      : Session(std::move(script), touches) {
    start.dry = true;
  }
};

TEST(ADryRun, GoesFromStandOffToStandOffOverTheClearPointsAndHome) {
  DryRun session;
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kDone) << (end.failure ? words(end.failure->detail) : "");
  const calib::Plan plan = line_plan(3);
  std::vector<double> went;
  for (const drivers::Move& move : session.backend.world.moves) went.push_back(move.target_rad[0]);
  std::vector<double> expected;
  for (const calib::PlannedTouch& touch : plan.touches) {
    for (const calib::JointVector& at : touch.transit) expected.push_back(at[0]);
    expected.push_back(touch.clear[0]);
  }
  for (const calib::JointVector& at : plan.home) expected.push_back(at[0]);
  EXPECT_EQ(went, expected);
  EXPECT_EQ(end.done, 3u);
}

TEST(ADryRun, SearchesNothingArmsNothingAndRecordsNoTouch) {
  DryRun session;
  session.run();
  for (const drivers::Move& move : session.backend.world.moves)
    EXPECT_EQ(move.kind, MoveKind::kTransit) << "contact on any other move might be meant";
  EXPECT_EQ(session.backend.world.armings, 0);
  EXPECT_TRUE(session.recorder.touches.empty());
  EXPECT_TRUE(session.recorder.readings.empty());
  ASSERT_EQ(session.recorder.ends.size(), 1u);
  EXPECT_EQ(session.recorder.ends[0].ending, Ending::kDone);
}

TEST(ADryRun, OfOneTouchEndsAtHome) {
  DryRun session({}, 1);
  EXPECT_EQ(session.run().phase, Phase::kDone);
  EXPECT_EQ(session.backend.world.at_rad, 0.0);
}

TEST(ADryRun, EndsWhereTheTipMeetsSomethingOnWhicheverMove) {
  DryRun whole;
  whole.run();
  for (int move = 1; move <= static_cast<int>(whole.backend.world.moves.size()); ++move) {
    DryRun session({.outcome = {{move, drivers::MoveOutcome::kUnexpectedContact}}});
    const State end = session.run();
    EXPECT_EQ(end.phase, Phase::kFailed) << move;
    ASSERT_TRUE(end.failure);
    EXPECT_EQ(end.failure->kind, FailureKind::kUnexpectedContact) << move;
    EXPECT_EQ(session.backend.world.moves.size(), static_cast<std::size_t>(move));
  }
}

TEST(ADryRun, ThatIsAbortedStopsTheArm) {
  for (const Phase phase : {Phase::kTransit, Phase::kRetreat, Phase::kReturning}) {
    DryRun session;
    EXPECT_EQ(session.run_and_abort_in(phase).phase, Phase::kAborted) << to_string(phase);
    EXPECT_GE(session.backend.world.stops, 1) << to_string(phase);
  }
}

}  // namespace
}  // namespace cellcal::daemon::testing
