// Each possible failure has its name and message, and leaves the arm at its position.

#include <gtest/gtest.h>

#include <stdexcept>

#include "tests/daemon/runner/fakes.h"

namespace cellcal::daemon::testing {
namespace {

using drivers::MoveOutcome;

struct Case {
  const char* name;
  Script script;
  FailureKind kind;
  const char* words;
  std::size_t moves;  ///< begun before the failure
};

class AFailure : public ::testing::TestWithParam<Case> {};

TEST_P(AFailure, IsNamedAndNothingMovesAfterIt) {
  Session session(GetParam().script, 2);
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kFailed);
  ASSERT_TRUE(end.failure.has_value());
  EXPECT_EQ(end.failure->kind, GetParam().kind) << to_string(end.failure->kind);
  EXPECT_NE(words(end.failure->detail).find(GetParam().words), std::string::npos)
      << words(end.failure->detail);
  EXPECT_EQ(words(end.failure->detail).find("begin move"), std::string::npos)
      << "internal: " << words(end.failure->detail);
  EXPECT_EQ(session.backend.world.moves.size(), GetParam().moves);
  EXPECT_FALSE(session.backend.world.robot_open);
  EXPECT_FALSE(session.backend.world.contact_open);
  ASSERT_EQ(session.recorder.ends.size(), 1u);
  EXPECT_EQ(session.recorder.ends[0].ending, Ending::kFailed);
  EXPECT_EQ(session.recorder.ends[0].failure, describe(*end.failure));
}

const Case kCases[] = {
    {"missing_device",
     {.open_contact_error = "/dev/ttyUSB0: no such device; plug it in"},
     FailureKind::kDevice,
     "/dev/ttyUSB0: no such device",
     0},
    {"port_taken",
     {.open_robot_error = "port 49152 is taken"},
     FailureKind::kDevice,
     "port 49152 is taken",
     0},
    {"no_packets_from_the_robot",
     {.robot_never_ready = true},
     FailureKind::kLinkNotReady,
     "robot: no packet on port 49152",
     0},
    {"sensor_never_ready",
     {.contact_never_ready = true},
     FailureKind::kLinkNotReady,
     "contact sensor: no IDENT",
     0},
    {"robot_never_referenced",
     {.never_referenced = true},
     FailureKind::kLinkNotReady,
     "robot: not referenced",
     0},
    {"contact_closed_before_the_move",
     {.contact_closed = true},
     FailureKind::kContactClosed,
     "contact closed before the first move",
     0},
    {"contact_in_a_transit",
     {.outcome = {{2, MoveOutcome::kUnexpectedContact}}},
     FailureKind::kUnexpectedContact,
     "touch 1 of 2 (S1): contact outside of a search",
     2},
    {"sensor_not_armed", {.refused_armings = 9}, FailureKind::kArmRefused, "self-test too old", 2},
    {"arming_unanswered", {.arming_unanswered = true}, FailureKind::kArmRefused, "no answer", 2},
    {"robot_lost_at_rest",
     {.robot_lost_at_arming = 1},
     FailureKind::kRobotSilent,
     "Check in this order: emergency stop, enabling switch",
     2},
    {"sensor_fault_at_rest",
     {.sensor_fault_at_arming = 1},
     FailureKind::kContactFault,
     "sense line broken",
     2},
    {"contact_silent",
     {.outcome = {{3, MoveOutcome::kContactSilent}}},
     FailureKind::kContactSilent,
     "no heartbeat from the contact sensor in time",
     3},
    {"robot_silent",
     {.outcome = {{3, MoveOutcome::kRobotSilent}},
      .interruption = {{3, drivers::Interruption::kPacketsStopped}}},
     FailureKind::kRobotSilent,
     "no more packets from the controller. Check in this order: emergency stop",
     3},
    {"late_replies",
     {.outcome = {{3, MoveOutcome::kRobotSilent}},
      .interruption = {{3, drivers::Interruption::kLateReplies}}},
     FailureKind::kComputerBusy,
     "this computer was busy: replies too late for the controller. Stop other programs on this computer. "
     "Then: 'cellcal run --resume'",
     3},
    {"move_refused",
     {.outcome = {{1, MoveOutcome::kRefused}}},
     FailureKind::kMoveRefused,
     "did not begin the move",
     1},
    {"arm_does_not_follow",
     {.outcome = {{4, MoveOutcome::kNotFollowing}}},
     FailureKind::kNotFollowing,
     "does not follow",
     4},
    {"stopped_by_another_hand",
     {.outcome = {{1, MoveOutcome::kStopped}}},
     FailureKind::kStoppedElsewhere,
     "another source",
     1},
    {"still_in_contact_after_back_off",
     {.outcome = {{4, MoveOutcome::kStillInContact}}},
     FailureKind::kStillInContact,
     "spatter",
     4},
    {"transit_without_end", {.endless_from = 2}, FailureKind::kTimeout, "'transit' took longer", 2},
    {"search_without_end",
     {.endless_from = 3},
     FailureKind::kTimeout,
     "'fast search' took longer",
     3},
    {"stop_without_effect",
     {.endless_from = 2, .ignores_stop = true},
     FailureKind::kStopUnconfirmed,
     "emergency stop",
     2},
    {"contact_of_a_transit_move",
     {.outcome = {{1, MoveOutcome::kContact}}},
     FailureKind::kUnexpectedEvent,
     "event 'contact' in phase 'transit'",
     1},
    {"device_refuses_a_move",
     {.begin_throws_at = 2},
     FailureKind::kStopUnconfirmed,
     "socket gone",
     2},
};

INSTANTIATE_TEST_SUITE_P(Runner, AFailure, ::testing::ValuesIn(kCases),
                         [](const auto& one) { return std::string(one.param.name); });

TEST(AFullDisk, AtAnyRecordStopsTheSessionBeforeTheNextMove) {
  int calls = 0;
  {
    Session session({}, 2);
    session.run();
    calls = session.recorder.calls;
  }
  ASSERT_GT(calls, 8);
  for (int nth = 1; nth <= calls; ++nth) {
    Session session({}, 2);
    session.recorder.fails_at = nth;
    std::size_t moves_at_failure = 0;
    const State end = session.run();
    ASSERT_EQ(end.phase, Phase::kFailed) << nth;
    EXPECT_EQ(end.failure->kind, FailureKind::kJournal) << nth;
    EXPECT_NE(words(end.failure->detail).find("disk full; make room"), std::string::npos) << nth;
    // Each reading is a record, and no search follows a failed record.
    moves_at_failure = session.backend.world.moves.size();
    if (moves_at_failure > 0 && nth < calls) {
      EXPECT_EQ(session.backend.world.moves.back().kind, drivers::MoveKind::kSearch) << nth;
    }
    EXPECT_FALSE(session.backend.world.robot_open) << nth;
  }
}

TEST(AFullDisk, ThatTakesTheEndAgainLeavesNoTouchCountedThatIsNotThere) {
  for (int nth = 1; nth <= 12; ++nth) {
    Session session({}, 2);
    session.recorder.fails_at = nth;
    session.recorder.fails_for = 1;
    session.run();
    EXPECT_EQ(session.done.size(), session.recorder.touches.size()) << nth;
  }
}

TEST(AFailingWorker, EndsTheSessionWithItsWords) {
  const auto fail = [](const char* words) { throw std::runtime_error(words); };
  Session plan;
  plan.tasks.plan = [&]() -> Tasks::Planned {
    fail("S3 is out of reach");
    return {};
  };
  const auto planned = plan.run().failure;
  ASSERT_TRUE(planned);
  EXPECT_EQ(planned->kind, FailureKind::kPlan);
  EXPECT_TRUE(words(planned->detail).starts_with("S3 is out of reach. ")) << words(planned->detail);
  EXPECT_EQ(plan.backend.world.opened, 0);

  Session route;
  route.tasks.route = [&](const calib::Plan& p, const FindRoute&, const calib::JointVector&) {
    fail("no clear way, jog the arm");
    return p;
  };
  const State lost = route.run();
  EXPECT_EQ(lost.failure->kind, FailureKind::kPlan);
  EXPECT_NE(words(lost.failure->detail).find("jog the arm"), std::string::npos);
  EXPECT_TRUE(route.backend.world.moves.empty());

  Session identify;
  identify.tasks.identify = [&](const std::vector<calib::Touch>&) {
    fail("too few touches");
    return SessionResult{};
  };
  EXPECT_EQ(identify.run().failure, (Failure{FailureKind::kIdentify, "too few touches"}));
  EXPECT_EQ(identify.recorder.touches.size(), 3u);

  Session report;
  report.tasks.report = [&](const SessionResult&, const std::vector<calib::Touch>&) {
    fail("report.html: cannot be written");
  };
  const auto reported = report.run().failure;
  ASSERT_TRUE(reported);
  EXPECT_EQ(reported->kind, FailureKind::kReport);
  EXPECT_TRUE(words(reported->detail).starts_with("report.html: cannot be written. "))
      << words(reported->detail);
}

TEST(AFailure, ReadsAsOneLineWhateverADeviceSays) {
  const Failure failure{FailureKind::kDevice, "two\nlines\x1b[2J"};
  EXPECT_EQ(describe(failure), "device: two lines [2J");
}

TEST(ASession, ThatMeetsAnExceptionOfNobodysStopsTheArmAndEndsFailed) {
  Session session;
  Runner runner({session.backend, session.recorder, session.worker, session.worker, session.tasks,
                 [](const State& state, const std::vector<calib::Touch>&) {
                   if (state.phase == Phase::kSlowSearch) throw std::runtime_error("out of paper");
                 }},
                session.start, {});
  const State end = runner.run();
  EXPECT_EQ(end.phase, Phase::kFailed);
  ASSERT_TRUE(end.failure);
  EXPECT_NE(words(end.failure->detail).find("out of paper"), std::string::npos)
      << words(end.failure->detail);
  EXPECT_GE(session.backend.world.stops, 1);
  EXPECT_FALSE(session.backend.world.robot_open);
  EXPECT_FALSE(session.backend.world.contact_open);
  ASSERT_EQ(session.recorder.ends.size(), 1u);
  EXPECT_EQ(session.recorder.ends[0].ending, Ending::kFailed);
}

TEST(AnAssessment, ThatFailsEndsNoSession) {
  Session session({}, 2);
  session.tasks.assess = [](const std::vector<calib::Touch>&) -> Tasks::Assessed {
    throw std::runtime_error("not enough memory");
  };
  const State end = session.run();
  EXPECT_EQ(end.phase, Phase::kDone) << (end.failure ? describe(*end.failure) : "");
  EXPECT_EQ(session.recorder.touches.size(), 2u);
}

}  // namespace
}  // namespace cellcal::daemon::testing
