// Sessions of the controller: detection, replies, numbering, interruptions, origin of a silence,
// and that nothing is answered twice.

#include "tests/drivers/kuka/rsi/foreign_packet.h"
#include "tests/drivers/kuka/rsi/rig.h"
#include "tests/drivers/said.h"

namespace cellcal::drivers {
namespace {

sim::ControllerConfig patient() {
  sim::ControllerConfig krc;
  krc.timeout_cycles = 1000;
  return krc;
}

struct RsiSession : testing::Test {
  const CoreState& facts() { return rig.core.core_state(); }
  CoreResult result() {
    std::optional<CoreResult> result;
    EXPECT_TRUE(rig.run_until([&] { return (result = rig.core.next_result()).has_value(); }, 5s));
    return result.value_or(CoreResult{});
  }
  CoreResult refused(double deg = 1.0) {
    rig.begin(MoveKind::kTransit, rig.moved_by(0, deg));
    rig.cycle();
    const auto refused = rig.core.next_result();
    EXPECT_TRUE(refused && refused->outcome == MoveOutcome::kRefused);
    return refused.value_or(CoreResult{});
  }
  void pause(Duration duration) {
    rig.to_pc = false;
    rig.run(duration);
    rig.to_pc = true;
  }
  void arrive(double deg) {
    rig.begin(MoveKind::kTransit, rig.moved_by(0, deg));
    const CoreResult done = result();
    EXPECT_EQ(done.outcome, MoveOutcome::kArrived) << to_string(done.outcome);
    EXPECT_EQ(done.interruption, Interruption::kNone);
  }
  Rig rig{patient()};
};

// ---- its number, and what interrupted it -----------------------------------------------------------

TEST_F(RsiSession, KeepsItsNumberBehindAPauseAndTheReferenceEndsTheInterruption) {
  rig.run(100ms);
  EXPECT_EQ(facts().session, 0u);
  rig.krc.rsi_on();
  rig.run(200ms);
  EXPECT_EQ(facts().session, 1u);
  EXPECT_EQ(facts().interruption, Interruption::kNone) << "the first one interrupts nothing";
  rig.make_referenced();
  EXPECT_EQ(facts().interruptions, 0u);
  for (std::uint32_t n = 1; n <= 2; ++n) {
    pause(40ms);
    EXPECT_EQ(facts().link, RobotLink::kLost);
    EXPECT_EQ(facts().interruption, Interruption::kPacketsStopped);
    rig.run(100ms);
    EXPECT_EQ(facts().session, 1u);
    EXPECT_EQ(facts().interruption, Interruption::kPacketsStopped) << "until it is referenced";
    EXPECT_EQ(facts().interruptions, n);
    rig.make_referenced();
    EXPECT_EQ(facts().interruption, Interruption::kNone);
  }
}

TEST_F(RsiSession, ThatBeganBehindASilenceIsAnotherOne) {
  rig.make_ready();
  rig.to_krc = false;
  rig.cycle();
  rig.to_krc = true;
  rig.run(20ms);
  pause(40ms);
  rig.krc.rsi_on();
  rig.cycle();
  EXPECT_EQ(facts().session, 2u) << "Delay counts anew";
  EXPECT_EQ(facts().interruption, Interruption::kOther);
  EXPECT_EQ(facts().interruptions, 1u);
}

TEST_F(RsiSession, ThatBeganWithoutASilenceIsAnotherOneAndReadFromItsVeryFirstPacket) {
  rig.make_ready();
  rig.krc.cancel_program();
  rig.krc.place({0.1, -1.5, 1.5, 0.0, 1.5, 0.0});
  rig.krc.rsi_on();
  rig.cycle();
  EXPECT_EQ(facts().session, 2u) << "its start is another";
  EXPECT_EQ(facts().interruption, Interruption::kOther);
  EXPECT_EQ(facts().interruptions, 1u);
  EXPECT_EQ(facts().link, RobotLink::kNotReferenced);
  EXPECT_EQ(facts().decimals, 4);
  rig.make_referenced();
  arrive(-5.0);
}

TEST_F(RsiSession, ThatSeemsToBeginWithoutASilenceBehindACorrectionIsNotAnswered) {
  rig.make_ready();
  arrive(5.0);
  rig.krc.rsi_on();  // as if only ASPos had moved to the arm's position
  int answers = 0;
  rig.after_cycle = [&] { answers += !rig.reply.empty(); };
  rig.run(300ms);
  EXPECT_EQ(answers, 0);
  EXPECT_EQ(facts().trouble, Trouble::kCorrectionDenied);
  EXPECT_EQ(facts().link, RobotLink::kNotReferenced);
  EXPECT_TRUE(has(said(rig.core.state().words), "check what sends ASPos"))
      << rig.core.state().words;
  pause(300ms);
  rig.krc.rsi_on();  // by the operator
  rig.run(200ms);
  rig.make_referenced();
  arrive(-5.0);
}

TEST_F(RsiSession, AMoveThatTheLinkEndedSaysWhatItWas) {
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 40));
  rig.run(200ms);
  rig.to_pc = false;
  CoreResult ended = result();
  EXPECT_TRUE(is<cause::Silence>(ended.cause));
  EXPECT_EQ(ended.interruption, Interruption::kPacketsStopped);
  ended = refused();
  EXPECT_TRUE(is<cause::NoPackets>(ended.cause));
  EXPECT_EQ(ended.interruption, Interruption::kPacketsStopped);
  rig.to_pc = true;
  rig.run(100ms);
  ended = refused();
  EXPECT_TRUE(is<cause::NotReferenced>(ended.cause));
  EXPECT_EQ(ended.interruption, Interruption::kPacketsStopped);
  EXPECT_EQ(ended.ipoc, static_cast<std::uint32_t>(rig.krc.ipoc()));
  rig.make_referenced();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 40));
  rig.run(200ms);
  rig.krc.rsi_on();
  ended = result();
  EXPECT_TRUE(is<cause::SessionRestarted>(ended.cause)) << words(ended);
  EXPECT_EQ(ended.interruption, Interruption::kOther);
}

TEST_F(RsiSession, LateRepliesInAMoveAreAnInterruptionByTheirName) {
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 40));
  for (int late = 0; late < 3; ++late) {
    rig.run(60ms);
    rig.to_krc = false;
    rig.cycle();
    rig.to_krc = true;
  }
  const CoreResult ended = result();
  EXPECT_TRUE(is<cause::LateReplies>(ended.cause));
  EXPECT_EQ(ended.interruption, Interruption::kLateReplies);
  EXPECT_EQ(facts().interruption, Interruption::kLateReplies);
  EXPECT_EQ(facts().interruptions, 1u);
  EXPECT_EQ(facts().session, 1u);
  rig.krc.rsi_on();
  rig.cycle();
  EXPECT_EQ(facts().session, 2u);
  EXPECT_EQ(facts().interruption, Interruption::kOther) << "by now it is more than late replies";
}

TEST_F(RsiSession, WhatIsNotTheLinksDoingIsNoInterruption) {
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 40));
  rig.run(100ms);
  EXPECT_EQ(refused().interruption, Interruption::kNone) << "busy";
  rig.core.stop();
  const CoreResult stopped = result();
  EXPECT_EQ(stopped.outcome, MoveOutcome::kStopped);
  EXPECT_TRUE(is<cause::StopAsked>(stopped.cause));
  EXPECT_EQ(stopped.interruption, Interruption::kNone);
  EXPECT_EQ(facts().interruptions, 0u);
}

TEST(RsiSessionRefused, AMoveWhoseRepliesAreNotTakenIsInterruptedByTheController) {
  RsiConfig config = rig_config();
  config.sentype = "KROSHU";
  Rig rig(patient(), config);
  rig.krc.rsi_on();
  rig.run(200ms);
  rig.begin(MoveKind::kTransit, AxisAngles(6, 0.0));
  rig.cycle();
  const auto refused = rig.core.next_result();
  ASSERT_TRUE(refused);
  EXPECT_TRUE(is<cause::NotAccepted>(refused->cause));
  EXPECT_EQ(refused->interruption, Interruption::kOther);
}

TEST_F(RsiSession, AMoveThatWaitsToBeginWhenThePacketsStopIsRefusedByThat) {
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 1));
  for (int ms = 1; ms <= 13; ++ms) rig.core.on_tick(rig.now + std::chrono::milliseconds(ms));
  const auto refused = rig.core.next_result();
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->outcome, MoveOutcome::kRefused);
  expect_cause(refused->cause, cause::Silence{0.013}, 1e-3);
  EXPECT_EQ(refused->interruption, Interruption::kPacketsStopped);
}

TEST_F(RsiSession, AThreadThatDidNotRunIsThisComputersLatenessAndNoSilenceOfTheController) {
  struct Case {
    int awake_ms;
    bool held_up;
  };
  // It polls each millisecond up to awake_ms after the last packet, and then not before 20 ms.
  for (const Case& one : {Case{0, true}, Case{3, true}, Case{6, false}, Case{11, false}}) {
    Rig fresh;
    fresh.make_ready();
    fresh.begin(MoveKind::kTransit, fresh.moved_by(0, 20));
    fresh.run(100ms);
    for (int ms = 1; ms <= one.awake_ms; ++ms)
      fresh.core.on_tick(fresh.now + std::chrono::milliseconds(ms));
    fresh.core.on_tick(fresh.now + 20ms);
    const auto result = fresh.core.next_result();
    ASSERT_TRUE(result) << one.awake_ms;
    EXPECT_EQ(result->outcome, MoveOutcome::kRobotSilent);
    EXPECT_EQ(is<cause::HeldUp>(result->cause), one.held_up) << one.awake_ms << words(*result);
    EXPECT_EQ(result->interruption,
              one.held_up ? Interruption::kLateReplies : Interruption::kPacketsStopped);
    EXPECT_EQ(fresh.core.state().link, RobotLink::kLost) << "nothing moves either way";
    if (!one.held_up) continue;
    EXPECT_TRUE(has(said(words(*result)), "this computer was busy: no packet read for"))
        << words(*result);
    // Its session continues, and by its own count it is the same one.
    const std::uint32_t session = fresh.core.state().session;
    fresh.run(100ms);
    EXPECT_EQ(fresh.core.state().link, RobotLink::kNotReferenced);
    EXPECT_EQ(fresh.core.state().session, session);
    EXPECT_EQ(fresh.core.state().interruption, Interruption::kLateReplies);
  }
}

// ---- references ------------------------------------------------------------------------------------

TEST_F(RsiSession, AReferenceIsTheMeanOfTwelvePacketsBehindTwelveThatAreAlike) {
  rig.make_ready();
  // The arm is pushed aside by a degree; its encoders flicker.
  std::vector<double> seen;
  int n = 0;
  rig.before_core = [&] {
    ForeignPacket text;
    text.actual_deg = {1.0 + 0.0001 * (n % 5), -90, 90, 0, 90, 0};
    text.setpoint_deg = {0, -90, 90, 0, 90, 0};
    text.delay = 0;
    text.ipoc = static_cast<unsigned>(rig.krc.ipoc());
    text.capitals = false;
    text.fixed_decimals = 4;
    rig.packet = text_of(text);
    seen.push_back(text.actual_deg[0]);
    ++n;
  };
  rig.core.rereference();
  for (int i = 1; i < 24; ++i) {
    rig.cycle();
    ASSERT_EQ(facts().link, RobotLink::kNotReferenced) << i;
    ASSERT_TRUE(facts().rereference_pending);
  }
  rig.cycle();
  EXPECT_EQ(facts().link, RobotLink::kReady);
  EXPECT_FALSE(facts().rereference_pending);
  double sum = 0.0;
  for (std::size_t i = seen.size() - 12; i < seen.size(); ++i) sum += seen[i];
  EXPECT_NEAR(facts().commanded_rad[0], sum / 12 * kDeg, 1e-12);
}

TEST_F(RsiSession, OneThatWasAskedForIsPendingUntilTheLinkIsLostAndNotAfter) {
  rig.krc.rsi_on();
  rig.run(20ms);
  rig.core.rereference();
  rig.cycle();
  EXPECT_TRUE(facts().rereference_pending) << "the cycle is not learnt yet";
  pause(300ms);
  EXPECT_EQ(facts().link, RobotLink::kLost);
  EXPECT_FALSE(facts().rereference_pending);
  rig.run(500ms);
  EXPECT_EQ(facts().link, RobotLink::kNotReferenced) << "it has to be asked for again";
  EXPECT_FALSE(facts().rereference_pending);
  rig.make_referenced();
}

// ---- origin of a silence ---------------------------------------------------------------------------

TEST_F(RsiSession, APacketThatIsRepeatedForMoreThanAFifthOfASecondEndsTheMoveAsSilence) {
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 60));
  rig.run(300ms);
  const AxisAngles commanded = rig.commanded();
  const TimePoint first = rig.now;
  std::optional<CoreResult> ended;
  while (!ended && rig.now - first < 1s) {
    rig.now += 4ms;
    rig.core.on_datagram(rig.packet, rig.now);
    ended = rig.core.next_result();
    EXPECT_EQ(rig.commanded(), commanded) << "nothing advances";
  }
  ASSERT_TRUE(ended);
  EXPECT_GT(rig.now - first, 196ms);
  EXPECT_LE(rig.now - first, 208ms);
  EXPECT_EQ(ended->outcome, MoveOutcome::kRobotSilent);
  expect_cause(ended->cause, cause::Silence{0.2}, 0.009);
  EXPECT_EQ(ended->interruption, Interruption::kPacketsStopped);
  EXPECT_EQ(facts().link, RobotLink::kLost);
}

TEST_F(RsiSession, RepeatedAndDamagedPacketsInBetweenAdvanceNothing) {
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 60));
  rig.run(400ms);
  for (int i = 0; i < 10; ++i) {
    const AxisAngles before = rig.commanded();
    rig.cycle();
    const AxisAngles after = rig.commanded();
    EXPECT_NEAR((after[0] - before[0]) / kDeg, 0.4, 1e-5) << "one cycle at 100 deg/s";
    rig.core.on_datagram(rig.packet, rig.now + 200us);
    std::string damaged = rig.packet;
    damaged.replace(damaged.find("<AIPos"), 6, "<<<<<<");
    rig.core.on_datagram(damaged, rig.now + 300us);
    EXPECT_EQ(rig.commanded(), after);
  }
}

TEST_F(RsiSession, TheSamePacketOverAgainDoesNotShowThatAMovingArmRests) {
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 40));
  rig.run(300ms);
  RsiCore other(rig_config(), nullptr);
  for (int i = 0; i < 10; ++i) {
    EXPECT_TRUE(other.on_datagram(rig.packet, rig.now + i * 1ms).empty()) << i;
  }
  EXPECT_EQ(other.core_state().trouble, Trouble::kWaitingForRest);
}

/// Synthetic packets for a separate core.
struct Packets {
  explicit Packets(RsiConfig config = rig_config()) : core(std::move(config), nullptr) {
    text.actual_deg = {0, -90, 90, 0, 90, 0};
    text.setpoint_deg = text.actual_deg;
    text.delay = 0;
    text.ipoc = 10'000;
    text.capitals = false;
    text.fixed_decimals = 4;
  }
  /// The next packet, this long after the preceding one.
  bool answered(Duration after = 4ms) {
    now += after;
    text.ipoc += 4;
    return !core.on_datagram(text_of(text), now).empty();
  }
  RsiCore core;
  ForeignPacket text;
  TimePoint now{1000s};
};

TEST(RsiSilence, WhoWasAnsweredDidNotWaitForUs) {
  // Relative: zeros are sent while the arm, moved by another process' increments, is still moving.
  RsiConfig config = rig_config();
  config.mode = CorrectionMode::kRelative;
  config.hold_on = false;
  Packets peer(config);
  for (int i = 0; i < 5; ++i) {
    peer.text.actual_deg[0] += 0.5;
    EXPECT_TRUE(peer.answered());
  }
  peer.text.actual_deg[0] += 0.5;
  EXPECT_TRUE(peer.answered(300ms)) << "its own pause";
  EXPECT_EQ(peer.core.core_state().trouble, Trouble::kWaitingForRest);
  EXPECT_EQ(peer.core.core_state().link, RobotLink::kNotReferenced);
}

TEST(RsiSilence, WhoWasNotAnsweredForAFifthOfASecondWaitsAndItsArmRests) {
  Packets peer;
  peer.text.actual_deg[0] = 3.0;
  EXPECT_FALSE(peer.answered());
  EXPECT_FALSE(peer.answered(190ms));
  EXPECT_TRUE(peer.answered(201ms)) << "at once: nothing moves before the answer";
  Packets other;
  other.text.actual_deg[0] = 3.0;
  EXPECT_FALSE(other.answered());
  EXPECT_TRUE(other.answered(1s));
}

// ---- replies
// -----------------------------------------------------------------------------------------

TEST(RsiAnswers, BeforeThereIsASessionADamagedPacketIsNotAnsweredAndTheFirstFrameOfRsi2Is) {
  RsiCore core(rig_config(), nullptr);
  TimePoint now{1000s};
  EXPECT_TRUE(
      core.on_datagram("<Rob Type=\"KUKA\"><AIPos A1=\"x\"/><IPOC>7</IPOC></Rob>", now).empty());
  EXPECT_FALSE(core.on_datagram("<Rob Type=\"KUKA\"><IPOC>8</IPOC></Rob>", now += 4ms).empty());
}

TEST_F(RsiSession, AFrameOfIpocAloneWithinASessionIsAnsweredWithWhatIsHeld) {
  rig.make_ready();
  arrive(5.0);
  const std::string held =
      rig.reply.substr(rig.reply.find("<AK"), rig.reply.find("<Stop") - rig.reply.find("<AK"));
  EXPECT_TRUE(has(held, "A1=\"5.0000"));
  const std::string alone =
      "<Rob Type=\"KUKA\"><IPOC>" + std::to_string(rig.krc.ipoc() + 4) + "</IPOC></Rob>";
  const std::string reply(rig.core.on_datagram(alone, rig.now + 4ms));
  EXPECT_TRUE(has(reply, held)) << reply;
}

TEST(RsiAnswers, WithoutAStopTagNoReplySpeaksOfItAndNoneEndsTheSession) {
  RsiConfig config = rig_config();
  config.stop_tag.clear();
  Packets peer(config);
  EXPECT_TRUE(peer.answered());
  peer.core.close();
  peer.now += 4ms;
  peer.text.ipoc += 4;
  const std::string reply(peer.core.on_datagram(text_of(peer.text), peer.now));
  EXPECT_FALSE(reply.empty());
  EXPECT_FALSE(has(reply, "Stop"));
  EXPECT_FALSE(peer.core.end_sent());
}

TEST_F(RsiSession, IsEndedByAReplyWithStopAndByNothingBefore) {
  EXPECT_FALSE(rig.core.end_sent());
  rig.make_ready();
  EXPECT_FALSE(rig.core.end_sent()) << "Stop was 0";
  rig.core.close();
  EXPECT_FALSE(rig.core.end_sent());
  rig.cycle();
  EXPECT_TRUE(has(rig.reply, "<Stop>1</Stop>")) << rig.reply;
  EXPECT_TRUE(rig.core.end_sent());
}

TEST_F(RsiSession, EachSessionSeesStopLowBeforeItRises) {
  rig.make_ready();
  pause(300ms);
  ASSERT_EQ(facts().link, RobotLink::kLost);
  rig.core.close();
  rig.krc.rsi_on();
  ASSERT_TRUE(rig.run_until([&] { return !rig.reply.empty(); }, 1s));
  EXPECT_TRUE(has(rig.reply, "<Stop>0</Stop>")) << rig.reply;
  rig.cycle();
  EXPECT_TRUE(has(rig.reply, "<Stop>1</Stop>")) << rig.reply;
  RsiCore core(rig_config(), nullptr);
  core.close();
  const std::string first(
      core.on_datagram("<Rob Type=\"KUKA\"><IPOC>8</IPOC></Rob>", TimePoint{1000s}));
  EXPECT_TRUE(has(first, "<Stop>0</Stop>")) << first;
}

// ---- replies that are not accepted
// ---------------------------------------------------------------------

TEST(RsiNotTaken, FourRepliesAreEnoughToSayItWhenTheLinkIsLostAndTheNextSessionIsJudgedAnew) {
  for (const int answered : {3, 4}) {
    Rig rig(patient());
    rig.to_krc = false;
    rig.krc.rsi_on();
    for (int i = 0; i < answered; ++i) rig.cycle();
    ASSERT_EQ(rig.core.core_state().replies, static_cast<std::uint64_t>(answered));
    rig.to_pc = false;
    rig.run(500ms);
    ASSERT_EQ(rig.core.core_state().link, RobotLink::kLost);
    EXPECT_EQ(rig.core.core_state().refused_when_lost, answered == 4);
    rig.to_pc = rig.to_krc = true;
    rig.krc.rsi_on();
    rig.run(100ms);
    EXPECT_FALSE(rig.core.core_state().refused_when_lost);
    EXPECT_EQ(rig.core.core_state().trouble, Trouble::kLearning);
  }
}

TEST(RsiNotTaken, IsJudgedByDelaySinceTheFirstPacketThatWasAnswered) {
  Packets peer;
  const unsigned delays[] = {0, 1, 1, 2, 3, 4, 5, 6, 7, 8};
  for (const unsigned delay : delays) {
    EXPECT_NE(peer.core.core_state().trouble, Trouble::kNotAccepted);
    peer.text.delay = delay;
    EXPECT_TRUE(peer.answered());
  }
  EXPECT_EQ(peer.core.core_state().trouble, Trouble::kNotAccepted) << "all ten, but two under way";
}

TEST(RsiSilence, ThatDelayWasSeenToCountIsRememberedBehindIt) {
  // Without ASPos: a Delay that has not increased in a second of silence belongs to another session
  // if it is known to count. Then the correction is 0, and the packet is answered immediately.
  for (const bool counted : {true, false}) {
    Packets peer;
    peer.text.setpoint_deg.reset();
    peer.text.ipoc = 0u - 4u;  // its very first packet
    const auto follow = [&](int cycles) {
      for (int i = 0; i < cycles; ++i) {
        ASSERT_TRUE(peer.answered()) << i;
        for (std::size_t k = 0; k < 6; ++k) {
          peer.text.actual_deg[k] = peer.core.core_state().commanded_rad[k] / kDeg;
        }
      }
    };
    follow(40);
    peer.core.rereference();
    follow(10);
    AxisAngles target = peer.core.state().commanded_rad;
    target[0] += 1 * kDeg;
    peer.core.begin({1, MoveKind::kTransit, target, 0.0, 0});
    if (counted) peer.text.delay = 1;
    follow(200);
    const auto done = peer.core.next_result();
    ASSERT_TRUE(done && done->outcome == MoveOutcome::kArrived);
    peer.core.on_tick(peer.now + 100ms);
    ASSERT_EQ(peer.core.core_state().link, RobotLink::kLost);
    peer.text.ipoc += 1000;
    EXPECT_EQ(peer.answered(1004ms), counted);
    if (counted) {
      EXPECT_NEAR(peer.core.core_state().commanded_rad[0], peer.text.actual_deg[0] * kDeg, 1e-6);
    }
  }
}

/// If RSI outlives an emergency stop, the last correction is held while the arm is stopped, and Start
/// moves the arm to it: by its lag.
TEST(RsiSessionVariant, ThatOutlivesAnEmergencyStopMovesTheArmAtStartByWhatItWasBehindAndNoMore) {
  sim::ControllerConfig krc;
  krc.rsi_outlives_stop = true;
  for (const double cruise_s : {10.0, 1.0}) {  // 1 and 10 deg/s
    Rig rig(krc);
    rig.make_ready();
    rig.begin(MoveKind::kTransit, rig.moved_by(0, 10.0), cruise_s);
    rig.run(cruise_s > 1.0 ? 3s : 600ms);
    rig.krc.emergency_stop(true);
    const CoreResult result = rig.finish();
    EXPECT_EQ(result.outcome, MoveOutcome::kNotFollowing) << words(result);
    EXPECT_EQ(rig.core.state().link, RobotLink::kNotReferenced);
    const std::vector<double> stood = rig.krc.actual_rad_at(rig.now);
    rig.run(2s);
    EXPECT_EQ(rig.krc.actual_rad_at(rig.now), stood);
    rig.krc.emergency_stop(false);
    rig.krc.start_key(true);
    rig.run(2s);
    const double moved_deg = (rig.krc.actual_rad_at(rig.now)[0] - stood[0]) / kDeg;
    EXPECT_GT(moved_deg, 0.0) << "uncommanded: the first row of the checklist on site";
    EXPECT_LT(moved_deg, cruise_s > 1.0 ? 0.1 : 1.5);
  }
}

}  // namespace
}  // namespace cellcal::drivers
