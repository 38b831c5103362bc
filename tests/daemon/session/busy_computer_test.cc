// Where this computer was late, and robot and sensor were sound: the touch is repeated by itself, by
// default, a bounded number of times, behind proof of both links. With any sign of a fault it is not.

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

/// These moves, counted from 1, are stopped since the sensor's data came late, or did not come.
Script late_at(std::initializer_list<int> moves, Interruption by = Interruption::kLateBytes) {
  Script script;
  for (const int move : moves) {
    script.outcome[move] = MoveOutcome::kContactSilent;
    script.interruption[move] = by;
  }
  return script;
}

std::string why(const State& end) { return end.failure ? describe(*end.failure) : "no failure"; }

/// As a session begins where no key says anything.
struct Usual : Session {
  explicit Usual(Script script, std::size_t touches = 2) : Session(std::move(script), touches) {
    start.repeats = BusyRepeats{};
  }
  int how_often(Phase phase) const {
    return static_cast<int>(std::count(phases.begin(), phases.end(), phase));
  }
  drivers::Duration lasted(drivers::TimePoint begun) { return backend.world.clock.now() - begun; }
};

TEST(a_busy_computer, ends_no_session_and_no_key_is_needed) {
  Usual session(late_at({2, 7, 11}));
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kDone) << why(end);
  EXPECT_EQ(end.interruptions.of_computer(), 3);
  EXPECT_EQ(end.interruptions.total(), 3);
  EXPECT_EQ(session.recorder.touches.size(), 2u);
}

TEST(a_busy_computer, is_allowed_thirty_repeats_of_a_touch_and_four_hundred_of_a_session) {
  EXPECT_EQ(BusyRepeats{}.of_touch, 30);
  EXPECT_EQ(BusyRepeats{}.of_session, 400);
  EXPECT_EQ(Timeouts{}.busy, std::chrono::minutes(1));
}

TEST(repeats, of_one_touch_are_bounded_and_begin_anew_with_the_next) {
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
  // One each of two touches.
  Usual once(late_at({3, 13}));
  once.start.repeats = {1, 100};
  EXPECT_EQ(once.run().phase, Phase::kDone) << why(once.start);
}

TEST(repeats, leave_the_retries_of_other_interruptions_alone) {
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

TEST(a_lateness_during_the_repeat_itself, is_repeated_again) {
  // The search; the way back to it; the search again; and the move out of the contact.
  Usual session(late_at({3, 4, 6, 9}));
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kDone) << why(end);
  EXPECT_EQ(end.interruptions.of_computer(), 4);
  EXPECT_EQ(session.recorder.touches.size(), 2u);
}

TEST(a_busy_spell, is_waited_out_with_the_arm_at_rest) {
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

TEST(a_busy_spell, that_does_not_end_ends_the_session_by_its_name) {
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

TEST(a_busy_spell, is_ended_by_an_abort_at_once) {
  for (const Phase phase : {Phase::kRecovering, Phase::kWatching}) {
    Script script = late_at({3});
    script.busy_for_ms = 3'600'000;
    Usual session(script);
    EXPECT_EQ(session.run_and_abort_in(phase).phase, Phase::kAborted) << to_string(phase);
    EXPECT_EQ(session.backend.world.moves.size(), 3u);
  }
}

TEST(a_silence_of_the_sensor, moves_nothing_by_itself_whatever_comes_behind_it) {
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

TEST(a_silence_that_was_this_computers, is_repeated_once_its_stamps_have_told) {
  Script script = late_at({3}, Interruption::kUnheard);
  script.told_after_ms = 400;
  Usual session(script);
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kDone) << why(end);
  EXPECT_EQ(end.interruptions.of_computer(), 1);
  EXPECT_EQ(session.recorder.touches.size(), 2u);
}

/// Recovering from a lateness in the fast search, or from a silence that is not explained yet.
Walk recovering(Interruption by) {
  Walk walk;
  walk.state.repeats = BusyRepeats{};
  walk.to_fast_search();
  walk.on(EventKind::kContactSilent, [&](Event& event) {
    event.interruption = by;
    event.at_rad = {0.105};
  });
  EXPECT_EQ(walk.state.phase, Phase::kRecovering);
  EXPECT_NE(walk.find<Disarm>(), nullptr);
  return walk;
}

TEST(behind_a_lateness, nothing_moves_before_self_test_clock_reference_and_place) {
  Walk walk = recovering(Interruption::kLateBytes);
  const auto at_the_contact = [](Event& event) { event.links.actual_rad = {0.105}; };
  walk.on(EventKind::kLinks, at_the_contact);
  EXPECT_EQ(walk.state.phase, Phase::kWatching);
  walk.the<SelfTest>();
  walk.on(EventKind::kDeadline);
  EXPECT_EQ(walk.state.phase, Phase::kReferencing);
  walk.the<Rereference>();
  walk.on(EventKind::kLinks, at_the_contact);
  EXPECT_EQ(walk.state.phase, Phase::kRouting);
  EXPECT_EQ(walk.find<BeginMove>(), nullptr);
}

TEST(behind_a_lateness, any_sign_of_a_fault_ends_it) {
  struct Sign {
    const char* name;
    std::function<void(Event&)> change;
    FailureKind kind;
  };
  const Sign kSigns[] = {
      {"robot lost", [](Event& e) { e.links.robot = drivers::RobotLink::kLost; },
       FailureKind::kComputerBusy},
      {"program stopped", [](Event& e) { e.links.needs_operator = true; },
       FailureKind::kComputerBusy},
      {"another session", [](Event& e) { e.links.robot_session = 2; }, FailureKind::kComputerBusy},
      {"sensor silent", [](Event& e) { e.links.delivery.silent = 1; }, FailureKind::kComputerBusy},
      {"sensor restarted",
       [](Event& e) {
         e.links.contact = ContactLink::kFault;
         e.links.fault = ContactFault::kLostState;
       },
       FailureKind::kContactFault},
      {"self-test failed",
       [](Event& e) {
         e.links.contact = ContactLink::kFault;
         e.links.fault = ContactFault::kSelfTestFailed;
       },
       FailureKind::kContactFault},
      {"silent, and by its own stamps",
       [](Event& e) {
         e.links.contact = ContactLink::kFault;
         e.links.fault = ContactFault::kSilent;
       },
       FailureKind::kContactFault},
      {"port lost", [](Event& e) { e.links.contact = ContactLink::kDown; },
       FailureKind::kContactFault}};
  for (const Sign& sign : kSigns) {
    for (const bool watching : {false, true}) {
      Walk walk = recovering(Interruption::kLateBytes);
      if (watching) walk.on(EventKind::kLinks);
      ASSERT_EQ(walk.state.phase, watching ? Phase::kWatching : Phase::kRecovering);
      walk.on(EventKind::kLinks, sign.change);
      ASSERT_EQ(walk.state.phase, Phase::kFailed) << sign.name << watching;
      EXPECT_EQ(walk.state.failure->kind, sign.kind) << sign.name << watching;
      EXPECT_EQ(walk.find<BeginMove>(), nullptr);
    }
  }
}

TEST(behind_a_lateness, what_is_not_proven_by_the_end_of_the_watch_is_not_believed) {
  const std::pair<const char*, std::function<void(Event&)>> kLacks[] = {
      {"self-test", [](Event& e) { e.links.self_test_ok = false; }},
      {"clock", [](Event& e) { e.links.clock_ok = false; }},
      {"sensor", [](Event& e) { e.links.contact = ContactLink::kIdentifying; }}};
  for (const auto& [name, change] : kLacks) {
    Walk walk = recovering(Interruption::kLateBytes);
    walk.on(EventKind::kLinks);
    ASSERT_EQ(walk.state.phase, Phase::kWatching);
    walk.on(EventKind::kLinks, change);
    walk.on(EventKind::kDeadline);
    EXPECT_EQ(walk.state.phase, Phase::kRecovering) << name << ": waited for, as long as it may";
    walk.at = *walk.state.busy_until;
    walk.on(EventKind::kDeadline);
    EXPECT_EQ(walk.state.phase, Phase::kFailed) << name;
    EXPECT_EQ(walk.state.failure->kind, FailureKind::kComputerBusy);
  }
}

TEST(behind_a_lateness, a_heartbeat_that_is_late_again_begins_the_watch_anew) {
  Walk walk = recovering(Interruption::kLateBytes);
  walk.on(EventKind::kLinks);
  const auto before = walk.state.deadline;
  walk.on(EventKind::kLinks, [](Event& event) { event.links.delivery.late = 5; });
  EXPECT_EQ(walk.state.phase, Phase::kWatching);
  EXPECT_GT(*walk.state.deadline, *before);
  walk.the<SelfTest>();
  EXPECT_EQ(walk.state.interruptions.of_computer(), 1)
      << "nothing has moved: it is the same repeat";
}

TEST(a_sensor_that_was_identified_anew, is_no_faulty_sensor_while_its_bytes_were_late) {
  Walk walk = recovering(Interruption::kUnheard);
  walk.on(EventKind::kLinks, [](Event& event) {
    event.links.contact = ContactLink::kFault;
    event.links.fault = ContactFault::kSilent;
    event.links.delivery.open = true;
  });
  EXPECT_EQ(walk.state.phase, Phase::kRecovering);
  EXPECT_EQ(walk.state.interruptions.of_computer(), 0);
  walk.on(EventKind::kLinks, [](Event& event) {
    event.links.contact = ContactLink::kFault;
    event.links.fault = ContactFault::kDeliveredLate;
    event.links.delivery.late = 1;
    event.links.contact_words = "this computer was busy";
  });
  EXPECT_EQ(walk.state.phase, Phase::kRecovering);
  EXPECT_EQ(walk.state.interruptions.of_computer(), 1);
  walk.the<RecordInterruption>();
  EXPECT_NEAR(walk.timeout_s(), 3.0, 1e-6);
  walk.on(EventKind::kDeadline);
  EXPECT_EQ(walk.state.phase, Phase::kRecovering)
      << "the robot is there: a busy spell is waited out";
  EXPECT_EQ(walk.state.deadline, walk.state.busy_until);
  walk.on(EventKind::kLinks, [](Event& event) { event.links.delivery.late = 1; });
  EXPECT_EQ(walk.state.phase, Phase::kWatching);
}

TEST(a_robot_whose_link_is_lost_because_its_thread_did_not_run, is_waited_for_three_seconds) {
  for (const bool back : {true, false}) {
    Walk walk = recovering(Interruption::kLateReplies);
    const auto lost = [](Event& event) {
      event.links.robot = drivers::RobotLink::kLost;
      event.links.interruption = Interruption::kLateReplies;
    };
    walk.on(EventKind::kLinks, lost);
    ASSERT_EQ(walk.state.phase, Phase::kRecovering);
    EXPECT_NEAR(walk.timeout_s(), 3.0, 0.1);
    if (back) {
      walk.on(EventKind::kLinks);
      EXPECT_EQ(walk.state.phase, Phase::kWatching);
    } else {
      walk.on(EventKind::kDeadline);
      EXPECT_EQ(walk.state.phase, Phase::kFailed);
    }
  }
}

TEST(a_lateness_at_rest, is_gone_on_from_likewise) {
  const auto late = [](Event& event) {
    event.links.contact = ContactLink::kFault;
    event.links.fault = ContactFault::kDeliveredLate;
    event.links.contact_words = "this computer was busy: sensor data 340 ms late, limit 300 ms";
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

TEST(a_lateness_while_a_touch_goes_to_the_disk, waits_until_it_is_there) {
  Walk walk;
  walk.state.repeats = BusyRepeats{};
  walk.to_slow_search();
  walk.contact(0.11, 0.1102);
  walk.on(EventKind::kArrived);
  walk.on(EventKind::kArmed);
  walk.contact(0.11, 0.1102);
  ASSERT_EQ(walk.state.phase, Phase::kRecording);
  walk.on(EventKind::kLinks, [](Event& event) {
    event.links.contact = ContactLink::kFault;
    event.links.fault = ContactFault::kDeliveredLate;
  });
  EXPECT_EQ(walk.state.phase, Phase::kRecording);
  walk.on(EventKind::kRecorded);
  EXPECT_EQ(walk.state.phase, Phase::kRecovering);
  EXPECT_EQ(walk.state.done, 1u) << "it is made, and not made again";
}

TEST(an_arming_that_was_not_answered,
     in_time_is_repeated_where_this_computer_was_late_and_only_there) {
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
  // Of what is at the tip nothing is explained by a late answer.
  Walk walk;
  walk.state.repeats = BusyRepeats{};
  walk.to_arming();
  walk.on(EventKind::kLinks, [](Event& event) { event.links.delivery.late = 1; });
  for (int i = 0; i < 2; ++i) {
    walk.on(EventKind::kArmRefused, [](Event& event) {
      event.refusal = drivers::ArmRefusal::kInContact;
      event.links.delivery.late = 1;
    });
  }
  EXPECT_EQ(walk.state.phase, Phase::kFailed);
  EXPECT_EQ(walk.state.failure->kind, FailureKind::kArmRefused);
}

TEST(a_contact_behind_a_lateness, in_transit_ends_the_session_and_at_the_sphere_does_not) {
  const auto touching = [](Event& event) {
    event.links.in_contact = event.links.can_guard_retreat = true;
  };
  Walk at_the_sphere = recovering(Interruption::kLateBytes);
  at_the_sphere.on(EventKind::kLinks, touching);
  EXPECT_EQ(at_the_sphere.state.phase, Phase::kWatching);
  Walk transit;
  transit.state.repeats = BusyRepeats{};
  transit.to_routing();
  transit.on(EventKind::kRouted);
  transit.on(EventKind::kContactSilent,
             [](Event& event) { event.interruption = Interruption::kLateBytes; });
  ASSERT_EQ(transit.state.phase, Phase::kRecovering);
  transit.on(EventKind::kLinks, touching);
  EXPECT_EQ(transit.state.phase, Phase::kFailed);
  EXPECT_EQ(transit.state.failure->kind, FailureKind::kUnexpectedContact);
}

/// Touches chosen one by one, at the search for the first.
Walk one_by_one_searching() {
  Walk walk;
  walk.state.one_by_one = true;
  walk.state.repeats = BusyRepeats{};
  walk.to_fast_search();
  return walk;
}
void late_bytes(Event& event) {
  event.interruption = Interruption::kLateBytes;
  event.at_rad = {0.112};
}
/// Both links prove themselves; the arm is where it was left.
void prove_links(Walk& walk) {
  const auto there = [](Event& event) { event.links.actual_rad = {0.112}; };
  walk.on(EventKind::kLinks, there);
  walk.on(EventKind::kDeadline);
  ASSERT_EQ(walk.state.phase, Phase::kReferencing);
  walk.on(EventKind::kLinks, there);
}

TEST(a_search_chosen_one_by_one, is_repeated_over_the_way_it_came_without_a_new_choice) {
  for (const int times : {1, 2}) {  // interrupted on that way as well
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

TEST(a_way_out_of_a_touch_chosen_one_by_one, goes_on_to_the_clear_point) {
  Walk walk = one_by_one_searching();
  walk.contact(0.110, 0.1102);
  walk.on(EventKind::kArrived);
  walk.on(EventKind::kArmed);
  walk.contact(0.110, 0.1102);
  walk.on(EventKind::kArrived);
  walk.on(EventKind::kArmed);
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

TEST(a_lateness_behind_the_last_touch, leaves_the_arm_where_it_is_and_identifies) {
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
