// A session from "run" to "done" on virtual time.

#include <gtest/gtest.h>

#include "tests/daemon/runner/fakes.h"

namespace cellcal::daemon::testing {
namespace {

using drivers::MoveKind;

TEST(ASession, MakesEveryTouchOfThePlanAndEndsDone) {
  Session session;
  const State end = session.run();
  EXPECT_EQ(end.phase, Phase::kDone) << (end.failure ? words(end.failure->detail) : "");
  ASSERT_EQ(session.recorder.touches.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    const RecordTouch& record = session.recorder.touches[i];
    EXPECT_EQ(record.index, i);
    EXPECT_EQ(record.touch.target, "S" + std::to_string(i + 1));
    EXPECT_NEAR(record.touch.joint_rad.at(0), 0.1 * static_cast<double>(i + 1) + 0.010, 1e-12);
    EXPECT_EQ(record.touch.time, "2026-01-01T00:00:00.000Z");
  }
  EXPECT_EQ(end.result->calibration()->after.count, 3);
  ASSERT_EQ(session.recorder.ends.size(), 1u);
  EXPECT_EQ(session.recorder.ends[0].ending, Ending::kDone);
}

TEST(ASession, GoesThroughItsPhasesInTheOrderOfTheMethod) {
  Session session({}, 1);
  session.run();
  using enum Phase;
  const std::vector<Phase> expected{
      kIdle,       kPlanning,   kConnecting, kReferencing, kRouting,    kTransit,    kArmingFast,
      kFastSearch, kBackingOff, kArmingSlow, kSlowSearch,  kBackingOff, kArmingSlow, kSlowSearch,
      kRecording,  kRetreat,    kReturning,  kIdentifying, kReporting,  kDone};
  EXPECT_EQ(session.phases, expected);
}

TEST(ASession, SearchesAtTheSpeedsOfItsPolicyUnderTheSensorsArming) {
  Session session({}, 1);
  session.run();
  std::vector<drivers::Move> searches;
  for (const drivers::Move& move : session.backend.world.moves) {
    if (move.kind == MoveKind::kSearch) searches.push_back(move);
  }
  ASSERT_EQ(searches.size(), 3u);
  EXPECT_NEAR(searches[0].cruise_s, 0.018 / 0.010, 1e-12);
  // Retreats by 1 mm from the contact at 10 mm, then by 0.6 mm; searches end 3 mm after it.
  EXPECT_NEAR(searches[0].target_rad[0], 0.118, 1e-12);
  EXPECT_NEAR(searches[1].cruise_s, 0.004 / TouchPolicy().slow_m_s, 1e-9);
  EXPECT_NEAR(searches[2].cruise_s, 0.0036 / TouchPolicy().slow_m_s, 1e-9);
  EXPECT_NEAR(searches[1].target_rad[0], 0.113, 1e-12);
  for (std::size_t i = 0; i < searches.size(); ++i) EXPECT_EQ(searches[i].arm_id, i + 1);
}

TEST(ASession, BacksOffAlongTheSearchLineAndLeavesToTheClearPoint) {
  Session session({}, 1);
  session.run();
  std::vector<double> retreats;
  for (const drivers::Move& move : session.backend.world.moves) {
    if (move.kind == MoveKind::kRetreat) retreats.push_back(move.target_rad[0]);
  }
  ASSERT_EQ(retreats.size(), 3u);
  EXPECT_NEAR(retreats[0], 0.109, 1e-12);
  EXPECT_NEAR(retreats[1], 0.1094, 1e-12);
  EXPECT_NEAR(retreats[2], 0.09, 1e-12);
}

TEST(ASession, NeverGivesTwoMovesTheSameNumber) {
  Session session;
  session.run();
  const auto& begun = session.backend.world.begun;
  ASSERT_GT(begun.size(), 10u);
  for (std::size_t i = 1; i < begun.size(); ++i) EXPECT_GT(begun[i], begun[i - 1]);
}

TEST(ASession, HasEachTouchOnDiskBeforeTheNextMove) {
  Session session;
  struct Watching final : FakeRecorder {
    using FakeRecorder::record;
    explicit Watching(Session& owner) : s(owner) {}
    void record(const RecordTouch& touch) override {
      EXPECT_FALSE(s.backend.world.moving);
      EXPECT_EQ(s.backend.world.moves.back().kind, MoveKind::kSearch);
      FakeRecorder::record(touch);
    }
    Session& s;
  } watching(session);
  Runner runner({session.backend, watching, session.worker, session.worker, session.tasks, {}}, {},
                {});
  EXPECT_EQ(runner.run().phase, Phase::kDone);
  EXPECT_EQ(watching.touches.size(), 3u);
}

TEST(ASession, KeepsEveryReadingAsEvidence) {
  Session session({}, 1);
  session.run();
  ASSERT_EQ(session.recorder.readings.size(), 3u);
  EXPECT_FALSE(session.recorder.readings[0].reading.slow);
  EXPECT_EQ(session.recorder.readings[0].number, 0);
  EXPECT_EQ(session.recorder.readings[1].number, 1);
  EXPECT_EQ(session.recorder.readings[2].number, 2);
}

TEST(ASession, ReadsAgainUntilTwoReadingsAgree) {
  // Searches are moves 3 (fast), 5, 7, 9 (slow).
  Session session({.outcome = {}, .late_m = {{5, 0.0}, {7, 0.0002}, {9, 0.00023}}}, 1);
  EXPECT_EQ(session.run().phase, Phase::kDone);
  ASSERT_EQ(session.recorder.touches.size(), 1u);
  EXPECT_NEAR(session.recorder.touches[0].touch.joint_rad[0], 0.110215, 1e-9);
  EXPECT_NEAR(session.recorder.touches[0].touch.spread_m, 0.00003, 1e-9);
  EXPECT_EQ(session.recorder.readings.size(), 4u);
}

TEST(ASession, ClosesItsDevicesBeforeItIdentifies) {
  Session session;
  session.tasks.identify = [&](const std::vector<calib::Touch>&) {
    EXPECT_FALSE(session.backend.world.robot_open);
    EXPECT_FALSE(session.backend.world.contact_open);
    return SessionResult{};
  };
  EXPECT_EQ(session.run().phase, Phase::kDone);
}

TEST(ASession, ShowsTheResidualOfTheNewestTouch) {
  Session session;
  EXPECT_EQ(session.run().residual_m, 3.0);
}

TEST(ASession, IsTheSameWhenItIsRepeated) {
  Session first, second;
  first.run();
  second.run();
  EXPECT_EQ(first.done, second.done);
  EXPECT_EQ(first.phases, second.phases);
  EXPECT_EQ(first.backend.world.clock.now(), second.backend.world.clock.now());
}

TEST(ASession, ProvesTheSensorAgainWhenItRefusesToBeArmedOnce) {
  Session session({.refused_armings = 1}, 1);
  EXPECT_EQ(session.run().phase, Phase::kDone);
  EXPECT_EQ(session.backend.world.self_tests, 1);
}

TEST(ASession, BacksOffFromNoiseAndSearchesAgain) {
  // Move 3 is the fast search, move 7 the first slow one.
  Session session(
      {.outcome = {{3, drivers::MoveOutcome::kRevoked}, {7, drivers::MoveOutcome::kRevoked}}}, 1);
  const State end = session.run();
  EXPECT_EQ(end.phase, Phase::kDone);
  EXPECT_EQ(end.total_revoked, 2u);
  EXPECT_EQ(session.recorder.touches.size(), 1u);
}

}  // namespace
}  // namespace cellcal::daemon::testing
