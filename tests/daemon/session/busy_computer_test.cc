// Delays of this computer, with intact robot and sensor: by default the touch is repeated a bounded
// number of times, after both links are verified. With any sign of a fault it is not.

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/daemon/runner/fakes.h"
#include "walk.h"

namespace cellcal::daemon::testing {
namespace {

using drivers::ContactFault;
using drivers::ContactLink;
using drivers::Interruption;
using drivers::MoveOutcome;

/// These moves, counted from 1, are stopped because the sensor's data is late or missing.
Script late_at(std::initializer_list<int> moves, Interruption by = Interruption::kLateBytes) {
  Script script;
  for (const int move : moves) {
    script.outcome[move] = MoveOutcome::kContactSilent;
    script.interruption[move] = by;
  }
  return script;
}

std::string why(const State& end) { return end.failure ? describe(*end.failure) : "no failure"; }

/// A session with default settings.
struct Usual : Session {
  explicit Usual(Script script, std::size_t touches = 2) : Session(std::move(script), touches) {
    start.repeats = BusyRepeats{};
  }
  int how_often(Phase phase) const {
    return static_cast<int>(std::count(phases.begin(), phases.end(), phase));
  }
  drivers::Duration lasted(drivers::TimePoint begun) { return backend.world.clock.now() - begun; }
};

TEST(ABusyComputer, EndsNoSessionAndNoKeyIsNeeded) {
  Usual session(late_at({2, 7, 11}));
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kDone) << why(end);
  EXPECT_EQ(end.interruptions.of_computer(), 3);
  EXPECT_EQ(end.interruptions.total(), 3);
  EXPECT_EQ(session.recorder.touches.size(), 2u);
}

TEST(ABusyComputer, IsAllowedThirtyRepeatsOfATouchAndFourHundredOfASession) {
  EXPECT_EQ(BusyRepeats{}.of_touch, 30);
  EXPECT_EQ(BusyRepeats{}.of_session, 400);
  EXPECT_EQ(Timeouts{}.busy, std::chrono::minutes(1));
}

TEST(Repeats, OfOneTouchAreBoundedAndBeginAnewWithTheNext) {
  // Each search of the first touch is stopped.
  Usual always(late_at({3, 6, 9, 12, 15}));
  always.start.repeats = {2, 100};
  const State end = always.run();
  ASSERT_EQ(end.phase, Phase::kFailed);
  EXPECT_EQ(end.failure->kind, FailureKind::kComputerBusy) << why(end);
  EXPECT_EQ(end.interruptions.of_computer(), 2);
  EXPECT_NE(why(end).find("ll 2 repeats of one touch are used ([session] busy_repeats_touch)"),
            std::string::npos)
      << why(end);
  // Once in each of two touches.
  Usual once(late_at({3, 13}));
  once.start.repeats = {1, 100};
  EXPECT_EQ(once.run().phase, Phase::kDone) << why(once.start);
}

TEST(Repeats, LeaveTheRetriesOfOtherInterruptionsAlone) {
  Script script = late_at({2, 5});
  script.outcome[8] = MoveOutcome::kRobotSilent;
  script.interruption[8] = Interruption::kPacketsStopped;
  script.lost_for_ms = 16;
  Usual none(script);
  const State without = none.run();
  EXPECT_EQ(without.phase, Phase::kFailed) << "retries is 0: a pause of packets ends the session";
  EXPECT_EQ(without.failure->kind, FailureKind::kRobotSilent);
  Usual one(script);
  one.start.retries = 1;
  const State with = one.run();
  EXPECT_EQ(with.phase, Phase::kDone) << why(with);
  EXPECT_EQ(with.interruptions.total(), 3);
  EXPECT_EQ(with.interruptions.of_computer(), 2);
}

TEST(ALatenessDuringTheRepeatItself, IsRepeatedAgain) {
  // The search; the return to it; the search again; and the retreat from the contact.
  Usual session(late_at({3, 4, 6, 9}));
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kDone) << why(end);
  EXPECT_EQ(end.interruptions.of_computer(), 4);
  EXPECT_EQ(session.recorder.touches.size(), 2u);
}

TEST(ABusySpell, IsWaitedOutWithTheArmAtRest) {
  Script script = late_at({3});
  script.busy_for_ms = 30'000;
  Usual session(script);
  std::size_t moves_then = 0;
  session.on_phase = [&](Phase phase) {
    if (phase == Phase::kRecovering) moves_then = session.backend.world.moves.size();
    if (phase == Phase::kReferencing && moves_then > 0) {
      EXPECT_EQ(session.backend.world.moves.size(), moves_then);
    }
  };
  const drivers::TimePoint begun = session.backend.world.clock.now();
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kDone) << why(end);
  EXPECT_EQ(end.interruptions.of_computer(), 1) << "one spell is one repeat";
  EXPECT_GT(session.lasted(begun), std::chrono::seconds(30));
  EXPECT_EQ(moves_then, 3u);
}

TEST(ABusySpell, ThatDoesNotEndEndsTheSessionByItsName) {
  Script script = late_at({3});
  script.busy_for_ms = 3'600'000;
  Usual session(script);
  const drivers::TimePoint begun = session.backend.world.clock.now();
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kFailed);
  EXPECT_EQ(end.failure->kind, FailureKind::kComputerBusy) << why(end);
  EXPECT_EQ(session.backend.world.moves.size(), 3u);
  EXPECT_LT(session.lasted(begun), std::chrono::seconds(75));
}

TEST(ABusySpell, IsEndedByAnAbortAtOnce) {
  for (const Phase phase : {Phase::kRecovering, Phase::kWatchingTheLinks}) {
    Script script = late_at({3});
    script.busy_for_ms = 3'600'000;
    Usual session(script);
    EXPECT_EQ(session.run_and_abort_in(phase).phase, Phase::kAborted) << to_string(phase);
    EXPECT_EQ(session.backend.world.moves.size(), 3u);
  }
}

TEST(ASilenceOfTheSensor, MovesNothingByItselfWhateverComesBehindIt) {
  for (const int told_after_ms : {1, 40, 2'000, 600'000}) {
    Script script = late_at({3}, Interruption::kUnheard);
    script.told_after_ms = told_after_ms;
    script.sensor_silent = true;
    Usual session(script);
    const drivers::TimePoint begun = session.backend.world.clock.now();
    const State end = session.run();
    ASSERT_EQ(end.phase, Phase::kFailed);
    EXPECT_EQ(end.failure->kind, FailureKind::kContactSilent) << why(end);
    EXPECT_EQ(end.interruptions.of_computer(), 0);
    EXPECT_EQ(session.backend.world.moves.size(), 3u);
    EXPECT_LT(session.lasted(begun), std::chrono::seconds(6)) << "named soon, told or not";
  }
}

TEST(ASilenceThatWasThisComputers, IsRepeatedOnceItsStampsHaveTold) {
  Script script = late_at({3}, Interruption::kUnheard);
  script.told_after_ms = 400;
  Usual session(script);
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kDone) << why(end);
  EXPECT_EQ(end.interruptions.of_computer(), 1);
  EXPECT_EQ(session.recorder.touches.size(), 2u);
}

/// Recovering from late data in the fast search, or from a silence not yet explained.
Walk recovering(Interruption by) {
  Walk walk;
  walk.state.repeats = BusyRepeats{};
  walk.to_fast_search();
  walk.on(EventKind::kContactSilent, [&](Event& event) {
    move(event).interruption = by;
    move(event).at_rad = {0.105};
  });
  EXPECT_EQ(walk.state.phase, Phase::kRecovering);
  EXPECT_NE(walk.find<Disarm>(), nullptr);
  return walk;
}

TEST(BehindALateness, NothingMovesBeforeSelfTestClockReferenceAndPlace) {
  Walk walk = recovering(Interruption::kLateBytes);
  const auto at_the_contact = [](Event& event) { links(event).actual_rad = {0.105}; };
  walk.on(EventKind::kLinks, at_the_contact);
  EXPECT_EQ(walk.state.phase, Phase::kWatchingTheLinks);
  walk.the<SelfTest>();
  walk.on(EventKind::kDeadline);
  EXPECT_EQ(walk.state.phase, Phase::kReferencing);
  walk.the<Rereference>();
  walk.on(EventKind::kLinks, at_the_contact);
  EXPECT_EQ(walk.state.phase, Phase::kRouting);
  EXPECT_EQ(walk.find<BeginMove>(), nullptr);
}

TEST(BehindALateness, AnySignOfAFaultEndsIt) {
  struct Sign {
    const char* name;
    std::function<void(Event&)> change;
    FailureKind kind;
  };
  const Sign kSigns[] = {
      {"robot lost", [](Event& e) { links(e).robot = drivers::RobotLink::kLost; },
       FailureKind::kComputerBusy},
      {"program stopped", [](Event& e) { links(e).needs_operator = true; },
       FailureKind::kComputerBusy},
      {"another session", [](Event& e) { links(e).robot_session = 2; }, FailureKind::kComputerBusy},
      {"sensor silent", [](Event& e) { links(e).delivery.silent = 1; }, FailureKind::kComputerBusy},
      {"sensor restarted",
       [](Event& e) {
         links(e).contact = ContactLink::kFault;
         links(e).fault = ContactFault::kLostState;
       },
       FailureKind::kContactFault},
      {"self-test failed",
       [](Event& e) {
         links(e).contact = ContactLink::kFault;
         links(e).fault = ContactFault::kSelfTestFailed;
       },
       FailureKind::kContactFault},
      {"silent, and by its own stamps",
       [](Event& e) {
         links(e).contact = ContactLink::kFault;
         links(e).fault = ContactFault::kSilent;
       },
       FailureKind::kContactSilent},
      {"port lost", [](Event& e) { links(e).contact = ContactLink::kDown; },
       FailureKind::kContactSilent}};
  for (const Sign& sign : kSigns) {
    for (const bool watching : {false, true}) {
      Walk walk = recovering(Interruption::kLateBytes);
      if (watching) walk.on(EventKind::kLinks);
      ASSERT_EQ(walk.state.phase, watching ? Phase::kWatchingTheLinks : Phase::kRecovering);
      walk.on(EventKind::kLinks, sign.change);
      ASSERT_EQ(walk.state.phase, Phase::kFailed) << sign.name << watching;
      EXPECT_EQ(walk.state.failure->kind, sign.kind) << sign.name << watching;
      EXPECT_EQ(walk.find<BeginMove>(), nullptr);
    }
  }
}

TEST(BehindALateness, WhatIsNotProvenByTheEndOfTheWatchIsNotBelieved) {
  const std::pair<const char*, std::function<void(Event&)>> kLacks[] = {
      {"self-test", [](Event& e) { links(e).self_test_ok = false; }},
      {"clock", [](Event& e) { links(e).clock_ok = false; }},
      {"sensor", [](Event& e) { links(e).contact = ContactLink::kIdentifying; }}};
  for (const auto& [name, change] : kLacks) {
    Walk walk = recovering(Interruption::kLateBytes);
    walk.on(EventKind::kLinks);
    ASSERT_EQ(walk.state.phase, Phase::kWatchingTheLinks);
    walk.on(EventKind::kLinks, change);
    walk.on(EventKind::kDeadline);
    EXPECT_EQ(walk.state.phase, Phase::kRecovering) << name << ": waited for, as long as it may";
    walk.at = *walk.state.busy_until;
    walk.on(EventKind::kDeadline);
    EXPECT_EQ(walk.state.phase, Phase::kFailed) << name;
    EXPECT_EQ(walk.state.failure->kind, FailureKind::kComputerBusy);
  }
}

TEST(BehindALateness, AHeartbeatThatIsLateAgainBeginsTheWatchAnew) {
  Walk walk = recovering(Interruption::kLateBytes);
  walk.on(EventKind::kLinks);
  const auto before = walk.state.deadline;
  walk.on(EventKind::kLinks, [](Event& event) { links(event).delivery.late = 5; });
  EXPECT_EQ(walk.state.phase, Phase::kWatchingTheLinks);
  EXPECT_GT(*walk.state.deadline, *before);
  walk.the<SelfTest>();
  EXPECT_EQ(walk.state.interruptions.of_computer(), 1)
      << "nothing has moved: it is the same repeat";
}

TEST(ASensorThatWasIdentifiedAnew, IsNoFaultySensorWhileItsBytesWereLate) {
  Walk walk = recovering(Interruption::kUnheard);
  walk.on(EventKind::kLinks, [](Event& event) {
    links(event).contact = ContactLink::kFault;
    links(event).fault = ContactFault::kSilent;
    links(event).delivery.open = true;
  });
  EXPECT_EQ(walk.state.phase, Phase::kRecovering);
  EXPECT_EQ(walk.state.interruptions.of_computer(), 0);
  walk.on(EventKind::kLinks, [](Event& event) {
    links(event).contact = ContactLink::kFault;
    links(event).fault = ContactFault::kDeliveredLate;
    links(event).delivery.late = 1;
    links(event).contact_words = "this computer was busy";
  });
  EXPECT_EQ(walk.state.phase, Phase::kRecovering);
  EXPECT_EQ(walk.state.interruptions.of_computer(), 1);
  walk.the<RecordInterruption>();
  EXPECT_NEAR(walk.timeout_s(), 3.0, 1e-6);
  walk.on(EventKind::kDeadline);
  EXPECT_EQ(walk.state.phase, Phase::kRecovering)
      << "the robot is there: a busy spell is waited out";
  EXPECT_EQ(walk.state.deadline, walk.state.busy_until);
  walk.on(EventKind::kLinks, [](Event& event) { links(event).delivery.late = 1; });
  EXPECT_EQ(walk.state.phase, Phase::kWatchingTheLinks);
}

TEST(ARobotWhoseLinkIsLostBecauseItsThreadDidNotRun, IsWaitedForThreeSeconds) {
  for (const bool back : {true, false}) {
    Walk walk = recovering(Interruption::kLateReplies);
    const auto lost = [](Event& event) {
      links(event).robot = drivers::RobotLink::kLost;
      links(event).interruption = Interruption::kLateReplies;
    };
    walk.on(EventKind::kLinks, lost);
    ASSERT_EQ(walk.state.phase, Phase::kRecovering);
    EXPECT_NEAR(walk.timeout_s(), 3.0, 0.1);
    if (back) {
      walk.on(EventKind::kLinks);
      EXPECT_EQ(walk.state.phase, Phase::kWatchingTheLinks);
    } else {
      walk.on(EventKind::kDeadline);
      EXPECT_EQ(walk.state.phase, Phase::kFailed);
    }
  }
}

TEST(ALatenessAtRest, IsGoneOnFromLikewise) {
  const auto late = [](Event& event) {
    links(event).contact = ContactLink::kFault;
    links(event).fault = ContactFault::kDeliveredLate;
    links(event).contact_words = "this computer was busy: sensor data 340 ms late, limit 300 ms";
  };
  for (const bool may : {true, false}) {
    Walk walk;
    if (may) walk.state.repeats = BusyRepeats{};
    walk.to_arming();
    walk.on(EventKind::kLinks, late);
    EXPECT_EQ(walk.state.phase, may ? Phase::kRecovering : Phase::kFailed);
    if (may) continue;
    EXPECT_EQ(walk.state.failure->kind, FailureKind::kComputerBusy);
    EXPECT_NE(why(walk.state).find("340 ms late"), std::string::npos);
  }
}

TEST(ALatenessWhileATouchGoesToTheDisk, WaitsUntilItIsThere) {
  Walk walk;
  walk.state.repeats = BusyRepeats{};
  walk.to_slow_search();
  walk.to_next_search();
  walk.contact(0.11, 0.1102);
  ASSERT_EQ(walk.state.phase, Phase::kRecording);
  walk.on(EventKind::kLinks, [](Event& event) {
    links(event).contact = ContactLink::kFault;
    links(event).fault = ContactFault::kDeliveredLate;
  });
  EXPECT_EQ(walk.state.phase, Phase::kRecording);
  walk.on(EventKind::kRecorded);
  EXPECT_EQ(walk.state.phase, Phase::kRecovering);
  EXPECT_EQ(walk.state.done, 1u) << "it is made, and not made again";
}

TEST(ALatenessWhileTheLastTouchGoesToTheDisk, IsFollowedByTheRetreatAndTheWayHome) {
  for (const bool led_on : {false, true}) {  // to the last touch by the retreat from the one before
    SCOPED_TRACE(led_on);
    Walk walk(1);
    walk.state.repeats = BusyRepeats{};
    walk.to_slow_search();
    walk.to_next_search();
    walk.contact(0.11, 0.1102);
    ASSERT_EQ(walk.state.phase, Phase::kRecording);
    walk.state.leads_on = led_on;
    walk.on(EventKind::kLinks, [](Event& event) {
      links(event).contact = ContactLink::kFault;
      links(event).fault = ContactFault::kDeliveredLate;
    });
    walk.on(EventKind::kRecorded);
    ASSERT_EQ(walk.state.phase, Phase::kRecovering);
    walk.on(EventKind::kLinks);
    walk.on(EventKind::kDeadline);
    for (int i = 0; i < 4 && walk.state.phase != Phase::kRetreat; ++i) walk.on(EventKind::kLinks);
    ASSERT_EQ(walk.state.phase, Phase::kRetreat);
    EXPECT_EQ(walk.the<BeginMove>().move.target_rad.at(0), walk.plan->touches[0].clear.at(0));
    walk.on(EventKind::kArrived);
    EXPECT_EQ(walk.state.phase, Phase::kReturning);
  }
}

TEST(AnArmingThatWasNotAnswered, InTimeIsRepeatedWhereThisComputerWasLateAndOnlyThere) {
  for (const int arming : {1, 2, 4}) {
    Script script;
    script.late_at_arming = arming;
    Usual session(script);
    const State end = session.run();
    ASSERT_EQ(end.phase, Phase::kDone) << arming << ": " << why(end);
  }
  Script mute;
  mute.arming_unanswered = true;
  Usual session(mute);
  EXPECT_EQ(session.run().failure->kind, FailureKind::kArmRefused);
  // A late answer does not explain the state of the tip.
  Walk walk;
  walk.state.repeats = BusyRepeats{};
  walk.to_arming();
  walk.on(EventKind::kLinks, [](Event& event) { links(event).delivery.late = 1; });
  for (int i = 0; i < 2; ++i) {
    walk.on(EventKind::kArmRefused,
            [](Event& event) { arming(event).refusal = drivers::ArmRefusal::kInContact; });
  }
  EXPECT_EQ(walk.state.phase, Phase::kFailed);
  EXPECT_EQ(walk.state.failure->kind, FailureKind::kArmRefused);
}

TEST(AContactBehindALateness, InTransitEndsTheSessionAndAtTheSphereDoesNot) {
  const auto touching = [](Event& event) {
    links(event).in_contact = links(event).can_guard_retreat = true;
  };
  Walk at_the_sphere = recovering(Interruption::kLateBytes);
  at_the_sphere.on(EventKind::kLinks, touching);
  EXPECT_EQ(at_the_sphere.state.phase, Phase::kWatchingTheLinks);
  Walk transit;
  transit.state.repeats = BusyRepeats{};
  transit.to_routing();
  transit.on(EventKind::kRouted);
  transit.on(EventKind::kContactSilent,
             [](Event& event) { move(event).interruption = Interruption::kLateBytes; });
  ASSERT_EQ(transit.state.phase, Phase::kRecovering);
  transit.on(EventKind::kLinks, touching);
  EXPECT_EQ(transit.state.phase, Phase::kFailed);
  EXPECT_EQ(transit.state.failure->kind, FailureKind::kUnexpectedContact);
}

/// Touches chosen one by one, during the search for the first.
Walk one_by_one_searching() {
  Walk walk;
  walk.state.one_by_one = true;
  walk.state.repeats = BusyRepeats{};
  walk.to_fast_search();
  return walk;
}
void late_bytes(Event& event) {
  move(event).interruption = Interruption::kLateBytes;
  move(event).at_rad = {0.112};
}
/// Both links are verified; the arm is where it was left.
void prove_links(Walk& walk) {
  const auto there = [](Event& event) { links(event).actual_rad = {0.112}; };
  walk.on(EventKind::kLinks, there);
  walk.on(EventKind::kDeadline);
  ASSERT_EQ(walk.state.phase, Phase::kReferencing);
  walk.on(EventKind::kLinks, there);
}

TEST(ASearchChosenOneByOne, IsRepeatedOverTheWayItCameWithoutANewChoice) {
  for (const int times : {1, 2}) {  // also interrupted on that path
    Walk walk = one_by_one_searching();
    const double began_rad = 0.1 + walk.state.approach_m;
    walk.on(EventKind::kContactSilent, late_bytes);
    for (int time = 1; time <= times; ++time) {
      prove_links(walk);
      ASSERT_EQ(walk.state.phase, Phase::kFreeing);
      expect_move(walk, drivers::MoveKind::kRetreat, began_rad, 0.0, kWaypointS);
      EXPECT_EQ(walk.find<ChooseTouch>(), nullptr);
      if (time < times) walk.on(EventKind::kContactSilent, late_bytes);
    }
    walk.on(EventKind::kArrived);
    ASSERT_EQ(walk.state.phase, Phase::kProving);
    walk.the<SelfTest>();
    walk.on(EventKind::kLinks);
    EXPECT_EQ(walk.state.phase, Phase::kArmingFast) << "the same touch, from where it began";
    EXPECT_FALSE(walk.state.first);
  }
}

TEST(AWayOutOfATouchChosenOneByOne, GoesOnToTheClearPoint) {
  Walk walk = one_by_one_searching();
  walk.to_next_search();
  walk.to_next_search();
  walk.contact(0.110, 0.1102);
  walk.on(EventKind::kRecorded);
  ASSERT_EQ(walk.state.phase, Phase::kRetreat);
  walk.on(EventKind::kContactSilent, late_bytes);
  prove_links(walk);
  ASSERT_EQ(walk.state.phase, Phase::kRetreat);
  expect_move(walk, drivers::MoveKind::kRetreat, 0.09, 0.0, kWaypointS);
  EXPECT_EQ(walk.state.done, 1u);
  walk.on(EventKind::kArrived);
  EXPECT_EQ(walk.state.phase, Phase::kChoosing);
  walk.the<ChooseTouch>();
}

TEST(ALatenessBehindTheLastTouch, LeavesTheArmWhereItIsAndIdentifies) {
  for (const Interruption by : {Interruption::kLateBytes, Interruption::kUnheard}) {
    Usual session(late_at({17}, by));
    const State end = session.run();
    EXPECT_EQ(end.phase, Phase::kDone) << why(end);
    EXPECT_EQ(end.interruptions.of_computer(), 1);
    EXPECT_EQ(session.backend.world.moves.size(), 17u) << "not home: the arm stays";
  }
}

}  // namespace
}  // namespace cellcal::daemon::testing
