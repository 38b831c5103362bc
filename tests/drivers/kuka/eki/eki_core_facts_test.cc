// Values reported by the EKI core: reason of a refused move, cause of a lost link, current wait.
// The sentences are generated from them.

#include "tests/drivers/kuka/eki/eki_rig.h"

namespace cellcal::drivers {
namespace {

struct EkiFacts : testing::Test {
  const EkiCoreState& facts() { return rig.core.core_state(); }
  CoreResult result() {
    std::optional<CoreResult> result;
    EXPECT_TRUE(rig.run_until([&] { return (result = rig.core.next_result()).has_value(); }, 10s));
    return result.value_or(CoreResult{});
  }
  void expect(const CoreResult& result, MoveOutcome outcome, const Cause& cause) {
    EXPECT_EQ(result.outcome, outcome) << to_string(result.outcome);
    expect_cause(result.cause, cause);
    EXPECT_EQ(result.id, rig.last_id);
  }
  EkiRig rig;
};

TEST_F(EkiFacts, WithoutAConnectionThatIsWhatIsWrong) {
  rig.run(40ms);
  EXPECT_EQ(facts().trouble, EkiTrouble::kNotConnected);
  EXPECT_EQ(facts().loss, EkiLoss::kNone);
  EXPECT_FALSE(facts().rereference_pending || facts().moving || facts().connected);
  rig.begin(MoveKind::kTransit, AxisAngles(6, 0.0));
  const CoreResult refused = result();
  EXPECT_EQ(refused.outcome, MoveOutcome::kRefused);
  expect_cause(refused.cause, cause::NotConnected{0.04}, 0.01);
}

TEST_F(EkiFacts, AConnectionThatEndsBeforeItsFirstStateWasNeverALink) {
  rig.run(40ms);
  ASSERT_TRUE(rig.connect());
  rig.close_connection();
  rig.cycle();
  EXPECT_EQ(facts().link, RobotLink::kDown);
  EXPECT_EQ(facts().loss, EkiLoss::kNone);
}

TEST_F(EkiFacts, NothingBeginsBeforeTheReferenceOrWhileTheControllerIsNotReady) {
  rig.run(40ms);
  ASSERT_TRUE(rig.connect());
  rig.run(1s);
  EXPECT_EQ(facts().trouble, EkiTrouble::kNone);
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 1));
  expect(result(), MoveOutcome::kRefused, cause::NotReferenced{});
  EXPECT_FALSE(facts().rereference_pending);
}

TEST_F(EkiFacts, AReferenceIsPendingFromTheAskingToTheRest) {
  rig.make_ready();
  EXPECT_FALSE(facts().rereference_pending);
  rig.core.rereference();
  EXPECT_EQ(facts().link, RobotLink::kNotReferenced) << "at once";
  rig.core.on_tick(rig.now);
  EXPECT_TRUE(facts().rereference_pending);
  rig.run(100ms);
  EXPECT_EQ(facts().link, RobotLink::kReady);
  // Requests on a lost link are discarded.
  rig.core.rereference();
  rig.close_connection();
  rig.cycle();
  EXPECT_FALSE(facts().rereference_pending);
}

TEST_F(EkiFacts, OneAtATimeStoppedOrClosing) {
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 10));
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 5));
  expect(*rig.core.next_result(), MoveOutcome::kRefused, cause::Busy{});
  rig.core.stop();
  --rig.last_id;
  expect(*rig.core.next_result(), MoveOutcome::kStopped, cause::StopAsked{});
  ++rig.last_id;
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 30));
  rig.run(300ms);
  EXPECT_TRUE(facts().moving);
  rig.core.stop();
  expect(result(), MoveOutcome::kStopped, cause::StopAsked{});
  rig.core.close();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 1));
  expect(result(), MoveOutcome::kRefused, cause::Closing{});
}

TEST_F(EkiFacts, WhatIsCommandedIsTheTargetWhileItMovesAndWhereItStandsAfterwards) {
  rig.make_ready();
  EXPECT_NEAR(facts().commanded_rad[0], facts().actual_rad[0], 1e-12);
  const AxisAngles target = rig.moved_by(0, 30);
  rig.begin(MoveKind::kTransit, target);
  rig.run(300ms);
  EXPECT_NEAR(facts().commanded_rad[0], target[0], 1e-12);
  EXPECT_LT(facts().actual_rad[0], target[0] - 1 * kEkiDeg);
  rig.core.stop();
  result();
  rig.run(100ms);
  EXPECT_NEAR(facts().commanded_rad[0], facts().actual_rad[0], 1e-12);
}

TEST_F(EkiFacts, EachLossHasItsOwnName) {
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 30));
  rig.run(300ms);
  rig.cable = false;
  const CoreResult silent = result();
  EXPECT_EQ(silent.outcome, MoveOutcome::kRobotSilent);
  expect_cause(silent.cause, cause::NotConnected{0.26}, 0.01);
  EXPECT_EQ(facts().loss, EkiLoss::kSilence);
  EXPECT_EQ(facts().link, RobotLink::kLost);
}

TEST_F(EkiFacts, AConnectionThatIsClosedEndsTheMoveByThatName) {
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 30));
  rig.run(300ms);
  rig.close_connection();
  expect(*rig.core.next_result(), MoveOutcome::kRobotSilent, cause::LinkClosed{});
  EXPECT_EQ(facts().loss, EkiLoss::kClosed);
  EXPECT_FALSE(rig.core.wants_close());
}

TEST_F(EkiFacts, ASessionThatIsTakenEndsItByThatNameAndNumber) {
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 30));
  rig.run(300ms);
  rig.mangle = [&](std::string bytes) {
    const std::string ours = "\"" + std::to_string(rig.session) + "\"";
    for (auto at = bytes.find(ours); at != std::string::npos; at = bytes.find(ours)) {
      bytes.replace(at, ours.size(), "\"777\"");
    }
    return bytes;
  };
  expect(result(), MoveOutcome::kRobotSilent, cause::SessionTaken{777});
  EXPECT_EQ(facts().loss, EkiLoss::kSessionTaken);
  EXPECT_EQ(facts().other_session, 777u);
}

TEST_F(EkiFacts, ACommandThatIsNotTakenCostsTheLink) {
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 30));
  std::optional<CoreResult> end;
  // States keep arriving; sent data never does.
  for (int i = 0; i < 500 && !end; ++i) {
    rig.now += rig.krc.cycle();
    rig.krc.tick(rig.now);
    rig.core.on_bytes(rig.krc.drain_output(), rig.now);
    rig.core.on_tick(rig.now);
    rig.core.sent(rig.core.output().size());
    end = rig.core.next_result();
  }
  ASSERT_TRUE(end);
  EXPECT_EQ(end->outcome, MoveOutcome::kRobotSilent);
  EXPECT_EQ(facts().link, RobotLink::kLost);
  EXPECT_TRUE(rig.core.wants_close());
}

TEST_F(EkiFacts, TellsHowEvenlyStatesCome) {
  rig.make_ready();
  rig.run(2s);
  EXPECT_LT(facts().jitter_s, 0.02);
  EXPECT_NEAR(facts().cycle_s, 0.02, 0.002);
  EXPECT_GT(facts().longest_gap_s, 0.015);
  EXPECT_EQ(facts().session, rig.session);
  EXPECT_EQ(facts().axes, 6);
  EXPECT_GE(facts().decimals_seen, 3);
  EXPECT_EQ(facts().override_percent, 100);
  EXPECT_TRUE(facts().ready && facts().drives);
  EXPECT_FALSE(facts().stopped || facts().input);
}

TEST_F(EkiFacts, AControllerThatObeysSomebodyElseIsNotOneThatDoesNotHear) {
  for (const bool other : {true, false}) {
    EkiRig fresh;
    fresh.mangle = [&](std::string bytes) {
      const std::string ours = "\"" + std::to_string(fresh.session) + "\"";
      for (auto at = bytes.find(ours); at != std::string::npos; at = bytes.find(ours)) {
        bytes.replace(at, ours.size(), other ? "\"777\"" : "\"0\"");
      }
      return bytes;
    };
    fresh.run(40ms);
    ASSERT_TRUE(fresh.connect());
    fresh.run(600ms);
    EXPECT_EQ(fresh.core.core_state().trouble,
              other ? EkiTrouble::kOtherSession : EkiTrouble::kNotHeard);
    EXPECT_EQ(fresh.core.core_state().other_session, other ? 777u : 0u);
    // And is closed after five seconds.
    EXPECT_FALSE(fresh.core.wants_close());
    EXPECT_TRUE(fresh.run_until([&] { return !fresh.connected; }, 5s));
  }
}

}  // namespace
}  // namespace cellcal::drivers
