// A disk that stalls: its jobs wait, and nothing else does.

#include <gtest/gtest.h>

#include "tests/daemon/runner/fakes.h"

namespace cellcal::daemon::testing {
namespace {

/// State at the end of the session, while the disk still stalled.
struct AtTheEnd {
  bool seen = false;
  std::size_t moves = 0, waiting = 0;
  bool moving = true, open = true;
};

/// Releases the disk once the session has ended, and records the state at that time.
AtTheEnd watch_the_end(Session& session, AtTheEnd& end,
                       std::function<void(const State&, Runner&)> more = {}) {
  session.watch = [&session, &end, more](const State& state, Runner& runner) {
    if (more) more(state, runner);
    if (!is_final(state.phase) || end.seen) return;
    const World& world = session.backend.world;
    end = {true, world.moves.size(), session.disk.waiting.size(), world.moving,
           world.robot_open || world.contact_open};
    session.disk.release();
  };
  return end;
}

/// The touch is recorded after it.
bool in_the_last_search(const State& state) {
  return state.phase == Phase::kSlowSearch && state.slow.size() == 1;
}

int jobs_of_a_whole_session() {
  Session session({}, 2);
  session.run();
  return session.disk.posted;
}

TEST(ADiskThatStalls, AtAnyRecordHoldsTheNextMoveBackAndTheSessionEndsByName) {
  const int jobs = jobs_of_a_whole_session();
  ASSERT_GT(jobs, 40);
  int by_name = 0;
  for (int nth = 1; nth <= jobs; ++nth) {
    Session session({}, 2);
    session.disk.stalls_at = nth;
    std::optional<std::size_t> moves_at_stall;
    AtTheEnd at_end;
    watch_the_end(session, at_end, [&](const State&, Runner&) {
      if (!session.disk.waiting.empty() && !moves_at_stall) {
        moves_at_stall = session.backend.world.moves.size();
      }
    });
    const State end = session.run();
    if (end.phase == Phase::kDone) {  // the last notes, for which nothing waits
      EXPECT_GE(nth, jobs - 1);
      continue;
    }
    ASSERT_EQ(end.phase, Phase::kFailed) << nth;
    const bool thinking = end.failure->kind == FailureKind::kTimeout;  // the record of the end
    EXPECT_TRUE(end.failure->kind == FailureKind::kJournal || thinking) << nth;
    by_name += thinking ? 0 : 1;
    ASSERT_TRUE(at_end.seen && moves_at_stall) << nth;
    EXPECT_EQ(at_end.moves, *moves_at_stall) << nth << ": something moved behind a stalled record";
    EXPECT_FALSE(at_end.moving) << nth;
    EXPECT_FALSE(at_end.open) << nth;
    EXPECT_GT(at_end.waiting, 0u) << nth;
  }
  EXPECT_GT(by_name, jobs / 2);
}

TEST(ADiskThatStalls, IsWhatTheFailureSpeaksOf) {
  Session session({}, 1);
  session.watch = [&](const State& state, Runner&) {
    if (state.phase == Phase::kSlowSearch) session.disk.stalls_at = 0;
    if (is_final(state.phase)) session.disk.release();
  };
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kFailed);
  EXPECT_EQ(end.failure->kind, FailureKind::kJournal);
  EXPECT_NE(words(end.failure->detail).find("the journal's disk does not answer"),
            std::string::npos)
      << words(end.failure->detail);
}

TEST(ADiskThatStalls, KeepsNoAbortFromEndingASessionThatRecordsATouch) {
  Session session({}, 1);
  AtTheEnd at_end;
  watch_the_end(session, at_end, [&](const State& state, Runner& runner) {
    if (in_the_last_search(state)) session.disk.stalls_at = 0;
    if (state.phase == Phase::kRecording) runner.request_abort();
  });
  EXPECT_EQ(session.run().phase, Phase::kAborted);
  EXPECT_TRUE(at_end.seen);
  EXPECT_GT(at_end.waiting, 1u) << "the touch and the end wait for the disk, the session does not";
  EXPECT_FALSE(at_end.open);
  // Once the disk answers, all jobs are done, in order.
  EXPECT_EQ(session.recorder.touches.size(), 1u);
  ASSERT_EQ(session.recorder.ends.size(), 1u);
  EXPECT_EQ(session.recorder.ends[0].ending, Ending::kAborted);
}

TEST(ADiskThatStalls, KeepsNoAbortFromAMoveThatWaitsForIt) {
  Session session({}, 1);
  AtTheEnd at_end;
  watch_the_end(session, at_end, [&](const State& state, Runner& runner) {
    if (state.phase == Phase::kFastSearch) session.disk.stalls_at = 0;
    if (state.phase == Phase::kBackingOff) runner.request_abort();
  });
  EXPECT_EQ(session.run().phase, Phase::kAborted);
  EXPECT_EQ(session.backend.world.moves.back().kind, drivers::MoveKind::kSearch);
  EXPECT_EQ(session.backend.world.stops, 0) << "nothing moved";
  EXPECT_FALSE(at_end.open);
}

TEST(ADiskThatStalls, WhileTheArmMovesKeepsNoAbortFromStoppingIt) {
  Session session({.endless_from = 3}, 1);
  AtTheEnd at_end;
  watch_the_end(session, at_end, [&](const State& state, Runner& runner) {
    if (session.backend.world.moves.size() < 3) return;
    session.disk.stalls_at = 0;
    if (kMovingPhases.has(state.phase)) runner.request_abort();
  });
  EXPECT_EQ(session.run().phase, Phase::kAborted);
  EXPECT_EQ(session.backend.world.stops, 1);
  EXPECT_FALSE(at_end.moving);
  EXPECT_GT(at_end.waiting, 0u);
}

TEST(ADiskThatStalls, HidesNoLostRobot) {
  Session session({}, 1);
  AtTheEnd at_end;
  watch_the_end(session, at_end, [&](const State& state, Runner&) {
    if (in_the_last_search(state)) session.disk.stalls_at = 0;
    if (state.phase == Phase::kRecording) session.backend.world.robot_lost = true;
  });
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kFailed);
  EXPECT_EQ(end.failure->kind, FailureKind::kRobotSilent);
  EXPECT_GT(at_end.waiting, 0u);
}

TEST(AJournalThatIsGone, IsNoticedBeforeTheNextMove) {
  struct Gone final : FakeRecorder {
    using FakeRecorder::record;
    void record(const RecordTouch&) override { gone = true; }
    void check() override {
      if (gone) throw std::runtime_error("journal x.db: was removed");
    }
    bool gone = false;
  } recorder;
  Session session;
  Runner runner({session.backend, recorder, session.worker, session.worker, session.tasks, {}}, {},
                {});
  const State end = runner.run();
  ASSERT_EQ(end.phase, Phase::kFailed);
  EXPECT_EQ(end.failure->kind, FailureKind::kJournal);
  EXPECT_NE(words(end.failure->detail).find("x.db: was removed"), std::string::npos);
  EXPECT_EQ(session.backend.world.moves.back().kind, drivers::MoveKind::kSearch);
  EXPECT_FALSE(session.backend.world.robot_open);
}

}  // namespace
}  // namespace cellcal::daemon::testing
