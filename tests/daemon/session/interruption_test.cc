// Harmless interruptions: the session continues automatically if permitted and all is verified
// again, and in no other case.

#include "daemon/session/interruption.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/daemon/runner/fakes.h"
#include "walk.h"

namespace cellcal::daemon::testing {
namespace {

using drivers::Interruption;
using drivers::MoveOutcome;

/// These moves, counted from 1, become silent.
Script silent_at(std::initializer_list<int> moves, Interruption by, int lost_for_ms = 16) {
  Script script;
  const bool of_the_sensor = by == Interruption::kLateBytes || by == Interruption::kUnheard;
  for (const int move : moves) {
    script.outcome[move] = of_the_sensor ? MoveOutcome::kContactSilent : MoveOutcome::kRobotSilent;
    script.interruption[move] = by;
  }
  script.lost_for_ms = lost_for_ms;
  return script;
}

/// Permits this many, by the corresponding key.
void allow(Session& session, Interruption by, int times) {
  if (by == Interruption::kPacketsStopped)
    session.start.retries = times;
  else
    session.start.repeats = {times, times};
}

const char* name_of(const ::testing::TestParamInfo<Interruption>& one) {
  switch (one.param) {
    case Interruption::kLateReplies: return "late_replies";
    case Interruption::kLateBytes: return "late_bytes";
    case Interruption::kUnheard: return "a_silence_that_is_explained_later";
    default: return "a_pause";
  }
}

std::string words_of(const State& end) {
  return end.failure ? describe(*end.failure) : "no failure";
}

int how_often(const Session& session, Phase phase) {
  return static_cast<int>(std::count(session.phases.begin(), session.phases.end(), phase));
}

class AHarmlessInterruption : public ::testing::TestWithParam<Interruption> {};
INSTANTIATE_TEST_SUITE_P(OfALink, AHarmlessInterruption,
                         ::testing::Values(Interruption::kLateReplies,
                                           Interruption::kPacketsStopped, Interruption::kLateBytes,
                                           Interruption::kUnheard),
                         name_of);

TEST_P(AHarmlessInterruption, OfAnyMoveIsGoneOnFromWhereTheOwnerAllowsIt) {
  std::size_t moves = 0;
  {
    Session without({}, 2);
    ASSERT_EQ(without.run().phase, Phase::kDone);
    moves = without.backend.world.moves.size();
  }
  for (int move = 1; move <= static_cast<int>(moves); ++move) {
    Session session(silent_at({move}, GetParam()), 2);
    allow(session, GetParam(), 1);
    const State end = session.run();
    ASSERT_EQ(end.phase, Phase::kDone) << move << ": " << words_of(end);
    EXPECT_EQ(end.interruptions.total(), 1) << move;
    EXPECT_EQ(session.recorder.touches.size(), 2u) << move;
    EXPECT_EQ(session.done.size(), 2u) << move;
    const bool reported = std::any_of(
        session.recorder.notes.begin(), session.recorder.notes.end(), [&](const std::string& note) {
          return note.find(GetParam() == Interruption::kPacketsStopped
                               ? "interruption 1 of at most 1, resuming automatically: robot-silent"
                               : "repeat 1 of at most 1 (of this touch 1 of 1), resuming "
                                 "automatically: computer-busy") == 0;
        });
    EXPECT_TRUE(reported) << move;
    // The recorded touch is not repeated, and nothing moved before a new reference.
    if (how_often(session, Phase::kWatchingTheLinks) == 0) continue;
    EXPECT_EQ(session.backend.world.references, 2) << move;
    EXPECT_GE(session.backend.world.self_tests, 1) << move;
    const int proofs = how_often(session, Phase::kProving);
    EXPECT_EQ(session.backend.world.disarmings, 2 + proofs)
        << move << ": of the interruption and the end";
  }
}

TEST_P(AHarmlessInterruption, EndsTheSessionWhereNobodyAllowedIt) {
  Session session(silent_at({3}, GetParam()), 2);
  const State end = session.run();
  EXPECT_EQ(end.phase, Phase::kFailed);
  const bool pause = GetParam() == Interruption::kPacketsStopped;
  const bool known = GetParam() != Interruption::kUnheard;
  EXPECT_EQ(end.failure->kind, pause   ? FailureKind::kRobotSilent
                               : known ? FailureKind::kComputerBusy
                                       : FailureKind::kContactSilent);
  EXPECT_EQ(end.interruptions.total(), 0);
  EXPECT_EQ(session.backend.world.moves.size(), 3u);
}

TEST_P(AHarmlessInterruption, IsGoneOnFromAsOftenAsWasAllowedAndNoOftener) {
  Session session(silent_at({2, 5, 8}, GetParam()), 2);
  allow(session, GetParam(), 2);
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kFailed);
  EXPECT_EQ(end.interruptions.total(), 2);
  EXPECT_EQ(session.backend.world.moves.size(), 8u);
  if (GetParam() == Interruption::kUnheard) return;  // nothing indicates this computer as the cause
  EXPECT_NE(
      words_of(end).find(GetParam() == Interruption::kPacketsStopped
                             ? "ll 2 automatic retries are used ([session] retries)"
                             : "ll 2 repeats of one touch are used ([session] busy_repeats_touch)"),
      std::string::npos)
      << words_of(end);
}

TEST_P(AHarmlessInterruption, MovesNothingWhileTheLinksProveThemselves) {
  Session session(silent_at({2}, GetParam()), 2);
  allow(session, GetParam(), 1);
  const drivers::TimePoint begun = session.backend.world.clock.now();
  ASSERT_EQ(session.run().phase, Phase::kDone);
  EXPECT_EQ(how_often(session, Phase::kWatchingTheLinks), 1);
  // The path is planned again, and the current touch begins again.
  EXPECT_EQ(how_often(session, Phase::kRouting), 2);
  EXPECT_GE(session.backend.world.clock.now() - begun, session.start.timeouts.watching);
}

struct Setback {
  const char* name;
  Script more;
  FailureKind kind;
  const char* words;
};

Script with(Script script, Interruption by) {
  script.outcome[2] = MoveOutcome::kRobotSilent;  // in transit
  script.interruption[2] = by;
  return script;
}

class AnInterruption : public ::testing::TestWithParam<Setback> {};

TEST_P(AnInterruption, BehindWhichNotAllIsProvenEndsTheSessionByName) {
  Session session(with(GetParam().more, Interruption::kPacketsStopped), 2);
  session.start.retries = 5;
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kFailed);
  EXPECT_EQ(end.failure->kind, GetParam().kind) << words_of(end);
  EXPECT_NE(words_of(end).find(GetParam().words), std::string::npos) << words_of(end);
  EXPECT_EQ(session.backend.world.moves.size(), 2u) << "nothing moves behind it";
  EXPECT_FALSE(session.backend.world.robot_open);
  ASSERT_EQ(session.recorder.ends.size(), 1u);
}

INSTANTIATE_TEST_SUITE_P(Session, AnInterruption,
                         ::testing::Values(Setback{"link_stays_down",
                                                   {.never_back = true},
                                                   FailureKind::kRobotSilent,
                                                   "not all links were back"},
                                           Setback{"link_comes_too_late",
                                                   {.lost_for_ms = 5000},
                                                   FailureKind::kRobotSilent,
                                                   "not all links were back"},
                                           Setback{"other_session",
                                                   {.lost_for_ms = 16, .other_session = true},
                                                   FailureKind::kRobotSilent,
                                                   "begun another session"},
                                           Setback{"late_again",
                                                   {.lost_for_ms = 16, .late_again = true},
                                                   FailureKind::kRobotSilent,
                                                   "not stable for 2 s"},
                                           Setback{"arm_moved",
                                                   {.lost_for_ms = 16, .moved_meanwhile_rad = 0.02},
                                                   FailureKind::kRobotSilent,
                                                   "not where it was left"},
                                           Setback{
                                               "sensor_fails_its_test",
                                               {.sensor_fault_at_self_test = 1, .lost_for_ms = 16},
                                               FailureKind::kContactFault,
                                               "sense line broken"}),
                         [](const auto& one) { return std::string(one.param.name); });

TEST(AnInterruptionAtRest, IsGoneOnFromLikewise) {
  for (int arming = 1; arming <= 6; ++arming) {
    Session session({.lost_for_ms = 16, .pause_at_arming = arming}, 2);
    session.start.retries = 1;
    const State end = session.run();
    ASSERT_EQ(end.phase, Phase::kDone) << arming << ": " << words_of(end);
    EXPECT_EQ(end.interruptions.total(), 1) << arming;
    EXPECT_EQ(session.backend.world.references, 2) << arming;
  }
}

TEST(AnInterruptionAtTheSphere, LeadsOutOfTheContactFirst) {
  // The retreat from the first contact: the tip is still in contact.
  Session session(silent_at({4}, Interruption::kPacketsStopped), 1);
  session.start.retries = 1;
  ASSERT_EQ(session.run().phase, Phase::kDone);
  EXPECT_EQ(how_often(session, Phase::kFreeing), 1);
  EXPECT_EQ(session.backend.world.moves.at(4).kind, drivers::MoveKind::kRetreat);
}

TEST(AnInterruptionOfATransit, WithTheContactClosedBehindItMovesNothing) {
  Session session(silent_at({2}, Interruption::kPacketsStopped), 2);
  session.start.retries = 3;
  session.start.resumed = true;  // from before: does not concern a contact closing now
  session.tasks.plan = [&session] { return Tasks::Planned{line_plan(2), "hash of 2"}; };
  session.on_phase = [&session](Phase phase) {
    if (phase == Phase::kRecovering) session.backend.world.in_contact = true;
  };
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kFailed);
  EXPECT_EQ(end.failure->kind, FailureKind::kUnexpectedContact) << words_of(end);
  EXPECT_EQ(session.backend.world.moves.size(), 2u);
}

TEST(AnInterruptionOfARetreatThatLeadsOn, ExpectsAContactOnlyWhereItHasNotOpened) {
  for (const bool touching : {true, false}) {
    Walk walk;
    walk.state.retries = 1;
    walk.to_slow_search();
    walk.to_next_search();
    walk.contact(0.11, 0.1102);
    walk.on(EventKind::kRecorded);
    ASSERT_TRUE(walk.state.leads_on);
    walk.on(EventKind::kLinks, [&](Event& event) { links(event).in_contact = touching; });
    walk.on(EventKind::kRobotSilent,
            [](Event& event) { move(event).interruption = Interruption::kPacketsStopped; });
    EXPECT_EQ(walk.state.phase, Phase::kRecovering);
    EXPECT_EQ(walk.state.resumed, touching);
  }
}

TEST(AnInterruptionOnTheWayHome, LeavesTheArmWhereItIsAndIdentifies) {
  Session session(silent_at({17}, Interruption::kPacketsStopped), 2);
  session.start.retries = 1;
  const State end = session.run();
  EXPECT_EQ(end.phase, Phase::kDone) << words_of(end);
  EXPECT_EQ(end.result->calibration()->after.count, 2);
}

TEST(AnInterruptionOnTheWayHome, OfTouchesChosenOneByOneLeavesTheArmThereAsWell) {
  Walk walk;
  walk.state.one_by_one = true;
  walk.state.retries = 1;
  walk.state.phase = Phase::kReturning;
  walk.on(EventKind::kRobotSilent,
          [](Event& event) { move(event).interruption = Interruption::kPacketsStopped; });
  EXPECT_EQ(walk.state.phase, Phase::kIdentifying);
  walk.the<CloseDevices>();
}

TEST(AnInterruptionBeforeTheFirstMove, ForgetsNeitherThatTheArmTouchesNorThatItDoesNot) {
  for (const bool resumed : {true, false}) {
    Walk walk;
    walk.state.resumed = resumed;
    walk.state.retries = 1;
    walk.to_routing();
    ASSERT_EQ(walk.state.phase, Phase::kRouting);
    walk.on(EventKind::kLinks, [](Event& event) {
      links(event).robot = drivers::RobotLink::kLost;
      links(event).interruption = Interruption::kPacketsStopped;
    });
    EXPECT_EQ(walk.state.phase, Phase::kRecovering);
    EXPECT_EQ(walk.state.resumed, resumed);
  }
}

TEST(AnInterruption, AsksUnderNumbersThatAreNeverNought) {
  Walk walk;
  walk.state.retries = 1;
  walk.to_routing();
  walk.state.arm_id = 0xFFFF;
  walk.on(EventKind::kLinks, [](Event& event) {
    links(event).robot = drivers::RobotLink::kLost;
    links(event).interruption = Interruption::kPacketsStopped;
  });
  EXPECT_EQ(walk.state.arm_id, 1);
}

TEST(AnInterruption, CanBeAbortedWhileTheLinksProveThemselves) {
  for (const Phase phase : {Phase::kRecovering, Phase::kWatchingTheLinks}) {
    Session session(silent_at({2}, Interruption::kPacketsStopped), 2);
    session.start.retries = 1;
    EXPECT_EQ(session.run_and_abort_in(phase).phase, Phase::kAborted) << to_string(phase);
    EXPECT_EQ(session.backend.world.moves.size(), 2u);
    EXPECT_FALSE(session.backend.world.robot_open);
  }
}

class NoOtherFailure : public ::testing::TestWithParam<MoveOutcome> {};
INSTANTIATE_TEST_SUITE_P(OfAMove, NoOtherFailure,
                         ::testing::Values(MoveOutcome::kStopped, MoveOutcome::kUnexpectedContact,
                                           MoveOutcome::kStillInContact,
                                           MoveOutcome::kContactSilent, MoveOutcome::kRobotSilent,
                                           MoveOutcome::kRefused, MoveOutcome::kNotFollowing));

TEST_P(NoOtherFailure, IsEverGoneOnFrom) {
  for (const Interruption by : {Interruption::kNone, Interruption::kOther}) {
    Session session({.outcome = {{2, GetParam()}}, .interruption = {{2, by}}}, 2);
    session.start.retries = 100;
    session.start.repeats = {100, 100};
    EXPECT_EQ(session.run().phase, Phase::kFailed);
    EXPECT_EQ(session.backend.world.moves.size(), 2u);
  }
}

TEST(TheHarmTable, KnowsEveryFailureAndGivesAReason) {
  std::set<FailureKind> known;
  std::set<Interruption> of_the_link;
  for (const InterruptionRule& harm : interruption_rule_table()) {
    if (harm.by) {
      EXPECT_TRUE(of_the_link.insert(*harm.by).second) << harm.reason;
    }
    known.insert(harm.failure);
    EXPECT_STRNE(harm.reason, "");
    EXPECT_TRUE(harm.goes_on == GoesOn::kNever || harm.failure == FailureKind::kRobotSilent ||
                harm.failure == FailureKind::kComputerBusy)
        << harm.reason;
  }
  EXPECT_EQ(of_the_link, (std::set{Interruption::kNone, Interruption::kLateReplies,
                                   Interruption::kPacketsStopped, Interruption::kOther,
                                   Interruption::kLateBytes, Interruption::kUnheard}));
  for (const FailureKind kind : all_values<FailureKind>())
    EXPECT_TRUE(known.contains(kind)) << to_string(kind);
  using F = FailureKind;
  EXPECT_EQ(goes_on(F::kComputerBusy, Interruption::kLateReplies), GoesOn::kRepeats);
  EXPECT_EQ(goes_on(F::kComputerBusy, Interruption::kLateBytes), GoesOn::kRepeats);
  EXPECT_EQ(goes_on(F::kRobotSilent, Interruption::kPacketsStopped), GoesOn::kRetries);
  EXPECT_EQ(goes_on(F::kRobotSilent, Interruption::kOther), GoesOn::kNever);
  EXPECT_EQ(goes_on(F::kRobotSilent, Interruption::kNone), GoesOn::kNever);
  EXPECT_EQ(goes_on(F::kContactSilent, Interruption::kUnheard), GoesOn::kNever);
  EXPECT_EQ(goes_on(F::kContactSilent, Interruption::kNone), GoesOn::kNever);
  EXPECT_EQ(goes_on(F::kNotFollowing, Interruption::kPacketsStopped), GoesOn::kNever);
}

}  // namespace
}  // namespace cellcal::daemon::testing
