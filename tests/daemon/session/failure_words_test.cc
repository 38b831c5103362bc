// Message of each failure: the touch, the evidence, the remedy.

#include <gtest/gtest.h>

#include "daemon/session/rules.h"
#include "tests/daemon/runner/fakes.h"
#include "tests/daemon/session/events.h"

namespace cellcal::daemon::testing {
namespace {

using drivers::ContactLink;
using drivers::Interruption;
using drivers::RobotLink;
using enum Phase;
using F = FailureKind;

constexpr const char* kStand =
    ". Check in this order: emergency stop, enabling switch and start key (T1), over RSI in T1 more than 250 mm/s at the "
    "TCP or flange ([motion] hand_speed_mm_s, speed_percent), the program and its message on the pendant, the cable, the controller's power";

struct FailureWords : ::testing::Test {
  FailureWords() {
    state.plan = std::make_shared<calib::Plan>(line_plan(2));
    state.links.robot = RobotLink::kReady;
    state.links.contact = ContactLink::kReady;
  }
  std::string in(Phase phase, F kind = F::kDevice) {
    state.phase = phase;
    return words(rules::failure_detail(kind, state, event));
  }
  void contact_at(double rad) {
    event = event_of_kind(EventKind::kContact);
    move(event).latch.emplace();
    move(event).latch->contact_rad = {rad};
  }

  State state;
  Event event;
};

TEST(AFailureInTheJournal, IsReadAsItWasWritten) {
  for (int kind = 0; kind <= static_cast<int>(F::kUnexpectedEvent); ++kind)
    for (const char* detail :
         {"", "no contact up to 8 mm", "touch 3 of 40 (S2): 12 ms: late", ":"}) {
      const Failure failure{static_cast<F>(kind), detail};
      EXPECT_EQ(failure_from_journal(to_journal(failure)), failure) << to_journal(failure);
    }
  EXPECT_EQ(to_journal({F::kNoContact, "no contact up to 8 mm"}),
            "no-contact: no contact up to 8 mm")
      << "as journals of earlier versions have it";
}

TEST(AFailureInTheJournal, ThatIsOfNoKindKnownHereIsUnexpected) {
  EXPECT_EQ(failure_from_journal(""), Failure{});
  EXPECT_EQ(failure_from_journal("of-tomorrow: x"), (Failure{F::kUnexpectedEvent, "x"}));
  EXPECT_EQ(failure_from_journal("no-contact"), (Failure{F::kNoContact, ""}));
}

TEST_F(FailureWords, NameTheTouchThatWasBeingMade) {
  event.words = "gone";
  EXPECT_EQ(in(kTransit), "touch 1 of 2 (S1): gone");
  EXPECT_EQ(in(kRetreat), "touch 1 of 2 (S1): gone") << "not on disk yet";
  EXPECT_EQ(in(kArmingFast), "touch 1 of 2 (S1): gone");
  state.done = 1;
  EXPECT_EQ(in(kTransit), "touch 2 of 2 (S2): gone");
  EXPECT_EQ(in(kRetreat), "touch 1 of 2 (S1): gone") << "the arm still leaves it";
  state.touch_failed.emplace();
  EXPECT_EQ(in(kRetreat), "touch 2 of 2 (S2): gone");
  state.touch_failed.reset();
  state.done = 2;
  EXPECT_EQ(in(kRetreat), "touch 2 of 2 (S2): gone");
  EXPECT_EQ(in(kReturning), "gone");
  state.done = 0;
  for (const Phase outside : {kIdle, kPlanning, kConnecting, kIdentifying, kReporting}) {
    EXPECT_EQ(in(outside), "gone") << to_string(outside);
  }
  state.plan.reset();
  EXPECT_EQ(in(kTransit), "gone");
}

TEST_F(FailureWords, OfTouchesChosenOneByOneSayThatTheCountIsForeseen) {
  event.words = "gone";
  state.one_by_one = true;
  state.done = state.chosen_after = 7;
  state.progress.touches_left = 4;
  state.progress.checks_left = 2;
  EXPECT_EQ(in(kTransit), "touch 8 of about 13 (S1): gone");
}

TEST_F(FailureWords, NameTheTargetWhereThereIsOne) {
  state.revoked = 4;
  EXPECT_EQ(in(kSlowSearch, F::kTooManyRevoked),
            "touch 1 of 2 (S1): 5 trips of the contact sensor on S1 were noise. Check the sensor's "
            "cable, earth and shield");
  state.done = 2;
  EXPECT_EQ(in(kSlowSearch, F::kTooManyRevoked),
            "5 trips of the contact sensor on the target were noise. Check the sensor's cable, "
            "earth and shield");
  state.plan.reset();
  state.done = 0;
  EXPECT_EQ(in(kSlowSearch, F::kTooManyRevoked),
            "5 trips of the contact sensor on the target were noise. Check the sensor's cable, "
            "earth and shield");
}

TEST_F(FailureWords, SayHowFarFromTheSurfaceItWas) {
  EXPECT_EQ(
      in(kFastSearch, F::kNoContact),
      "touch 1 of 2 (S1): no contact up to 8.0 mm beyond the expected surface of S1 (cell file). "
      "Check centre_mm (in the robot's root, whatever $ROBROOT) and diameter_mm in the cell file, and the contact circuit; "
      "'cellcal run --find' finds a sphere whose centre is known roughly");
  contact_at(0.105);
  const std::string before =
      " mm before the expected surface of S1 (cell file): the tip met something else, or centre_mm "
      "is wrong. Look at the tip, then correct centre_mm or remove the obstacle";
  EXPECT_EQ(in(kFastSearch, F::kContactTooEarly), "touch 1 of 2 (S1): contact 5.0" + before);
  move(event).latch.reset();
  EXPECT_EQ(in(kFastSearch, F::kContactTooEarly), "touch 1 of 2 (S1): contact 10.0" + before);
}

TEST_F(FailureWords, ListTheReadingsThatDisagree) {
  for (const double along_m : {0.0101, 0.0099}) {
    state.slow.emplace_back();
    state.slow.back().along_m = along_m;
  }
  contact_at(0.1103);
  const std::string words =
      "touch 1 of 2 (S1): 3 readings on S1 do not agree within 0.060 mm (10.100, 9.900, ";
  const std::string look =
      " mm). Clean tip and sphere, and look for a loose sphere or a loose tool";
  EXPECT_EQ(in(kSlowSearch, F::kReadingsDisagree), words + "10.300" + look);
  move(event).latch.reset();
  EXPECT_EQ(in(kSlowSearch, F::kReadingsDisagree), words + "0.000" + look);
}

TEST_F(FailureWords, NameTheCommandOfANewSessionWhereTheKindIsNotResumed) {
  state.phase = kTransit;
  const auto then = [&](F kind) { return words(rules::failure_words(kind, state, event)); };
  EXPECT_NE(then(F::kDevice).find("Then: 'cellcal run --resume'"), std::string::npos);
  state.anew = "cellcal dry-run --cell a.toml";
  for (const F kind : {F::kDevice, F::kNoContact, F::kNotFound}) {
    EXPECT_NE(then(kind).find("Then: 'cellcal dry-run --cell a.toml'"), std::string::npos)
        << then(kind);
    EXPECT_EQ(then(kind).find("resume"), std::string::npos) << then(kind);
  }
}

TEST_F(FailureWords, SayWhichLinkIsMissingAndWhatToStart) {
  state.how_to_start = "start CELLCAL_RSI";
  state.links.robot = RobotLink::kDown;
  const std::string waited = ". Waited 300 s ([session] connect_wait_s)";
  EXPECT_EQ(in(kConnecting, F::kLinkNotReady), "robot: not ready. Start CELLCAL_RSI" + waited);
  state.links.robot_words = "no packet";
  state.links.contact = ContactLink::kDown;
  EXPECT_EQ(in(kConnecting, F::kLinkNotReady),
            "robot: no packet. Start CELLCAL_RSI. Contact sensor: not ready" + waited);
  state.links.robot = RobotLink::kReady;
  state.links.contact_words = "no answer";
  EXPECT_EQ(in(kConnecting, F::kLinkNotReady), "contact sensor: no answer" + waited);
}

TEST_F(FailureWords, SayWhyTheSensorWasNotProvenThoughBothLinksAreReady) {
  const std::string touch = "touch 1 of 2 (S1): ";
  EXPECT_EQ(
      in(kProving, F::kLinkNotReady),
      touch + "no result of the contact sensor's self-test within 15 s. Check the sensor's cable");
  state.links.in_contact = true;
  EXPECT_NE(in(kProving, F::kLinkNotReady).find("contact did not open"), std::string::npos);
}

TEST_F(FailureWords, SayOfLinksThatWereUpBeforeWhichOneIsNot) {
  const auto words = [&](RobotLink robot, ContactLink contact) {
    state.links.robot = robot;
    state.links.contact = contact;
    return in(kWatchingTheLinks, F::kLinkNotReady);
  };
  EXPECT_EQ(words(RobotLink::kReady, ContactLink::kReady), "");
  EXPECT_EQ(words(RobotLink::kNotReferenced, ContactLink::kReady), "robot: not referenced");
  EXPECT_EQ(words(RobotLink::kLost, ContactLink::kReady), "robot: not ready");
  EXPECT_EQ(words(RobotLink::kReady, ContactLink::kFault), "contact sensor: not ready");
  EXPECT_EQ(words(RobotLink::kLost, ContactLink::kDown),
            "robot: not ready. Contact sensor: not ready");
}

TEST_F(FailureWords, OfASilentRobotComeFromItsLinkAtRestAndFromTheMoveOnItsWay) {
  state.links.robot_words = "as last seen";
  state.links.interruption = Interruption::kPacketsStopped;
  event = event_of_kind(EventKind::kLinks);
  EXPECT_EQ(in(kConnecting, F::kRobotSilent), std::string("as last seen") + kStand);
  event = event_of_kind(EventKind::kRobotSilent);
  move(event).interruption = Interruption::kPacketsStopped;
  EXPECT_EQ(in(kConnecting, F::kRobotSilent), std::string("as last seen") + kStand);
  event.words = "12 ms without a packet";
  move(event).interruption = Interruption::kOther;
  EXPECT_EQ(in(kConnecting, F::kRobotSilent), std::string("12 ms without a packet") + kStand);
  event.words = state.links.robot_words = "";
  EXPECT_EQ(in(kConnecting, F::kRobotSilent),
            std::string("the robot controller stopped the session") + kStand);
}

TEST_F(FailureWords, SayThatNoMoreInterruptionsAreAllowedWhereAnyWere) {
  event = event_of_kind(EventKind::kRobotSilent);
  move(event).interruption = Interruption::kPacketsStopped;
  const std::string paused = std::string("no more packets from the controller") + kStand;
  EXPECT_EQ(in(kConnecting, F::kRobotSilent), paused) << "none are allowed, none were";
  state.retries = 1;
  state.interruptions.count(Interruption::kPacketsStopped);
  EXPECT_EQ(in(kConnecting, F::kRobotSilent),
            paused + ". All 1 automatic retries are used ([session] retries)");
  state.interruptions = {};
  state.interruptions.count(Interruption::kLateBytes);
  state.interruptions.count(Interruption::kLateReplies);
  EXPECT_EQ(in(kConnecting, F::kRobotSilent), paused)
      << "this computer's lateness uses none of them";
}

TEST_F(FailureWords, OfABusyComputerSaySoFirstAndWhichBoundIsReached) {
  event = event_of_kind(EventKind::kContactSilent);
  move(event).interruption = Interruption::kLateBytes;
  const std::string busy = "this computer was busy: sensor data 30 ms late, limit 25 ms";
  event.words = busy;
  EXPECT_EQ(in(kConnecting, F::kComputerBusy), busy) << "no repeats were allowed";
  state.repeats = {3, 9};
  EXPECT_EQ(in(kConnecting, F::kComputerBusy), busy);
  state.busy_of_touch = 3;
  EXPECT_EQ(in(kConnecting, F::kComputerBusy),
            busy + ". All 3 repeats of one touch are used ([session] busy_repeats_touch)");
  state.busy_of_touch = 0;
  for (int k = 0; k < 9; ++k) state.interruptions.count(Interruption::kLateBytes);
  EXPECT_EQ(in(kConnecting, F::kComputerBusy),
            busy + ". All 9 repeats of a session are used ([session] busy_repeats)");
  // At rest the evidence comes from the sensor's link.
  event = event_of_kind(EventKind::kLinks);
  state.links.contact_words = "this computer was busy: sensor data 340 ms late, limit 300 ms";
  state.repeats = {};
  state.interruptions = {};
  EXPECT_EQ(in(kConnecting, F::kComputerBusy), words(state.links.contact_words));
}

}  // namespace
}  // namespace cellcal::daemon::testing
