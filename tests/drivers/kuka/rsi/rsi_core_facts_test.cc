// Values reported by the RSI core: reason of a refused move, current wait, state of the link. The
// sentences are generated from them.

#include "tests/drivers/kuka/rsi/rig.h"

namespace cellcal::drivers {
namespace {

struct RsiFacts : testing::Test {
  const CoreState& facts() { return rig.core.core_state(); }
  CoreResult result() {
    std::optional<CoreResult> result;
    EXPECT_TRUE(rig.run_until([&] { return (result = rig.core.next_result()).has_value(); }, 5s));
    return result.value_or(CoreResult{});
  }
  void expect(const CoreResult& result, MoveOutcome outcome, const Cause& cause) {
    EXPECT_EQ(result.outcome, outcome) << to_string(result.outcome);
    expect_cause(result.cause, cause);
    EXPECT_EQ(result.id, rig.last_id);
    EXPECT_FALSE(result.in_space);
  }
  Rig rig;
};

TEST_F(RsiFacts, BeforeTheFirstPacketNothingIsWrongAndNothingIsAsked) {
  rig.cycle();
  EXPECT_EQ(facts().trouble, Trouble::kNone);
  EXPECT_EQ(facts().link, RobotLink::kDown);
  EXPECT_FALSE(facts().rereference_pending || facts().moving || facts().refused_when_lost);
  EXPECT_EQ(facts().packets + facts().replies + facts().late + facts().gaps, 0u);
}

TEST_F(RsiFacts, TheTcpIsThatOfThePacketOfTheAngles) {
  rig.krc.rsi_on();
  rig.run(100ms);
  EXPECT_FALSE(facts().states_tcp) << "zeros are no position";
  EXPECT_FALSE(rig.core.state().stated_tcp);
  const auto say = [&](const std::string& rist) {
    const auto at = rig.packet.find("<RIst");
    std::string packet = rig.packet;
    packet.replace(at, packet.find("/>", at) + 2 - at, rist);
    const auto ipoc = packet.find("<IPOC>") + 6;
    const auto next = std::stoul(packet.substr(ipoc)) + 4;
    packet.replace(ipoc, packet.find('<', ipoc) - ipoc, std::to_string(next));
    rig.packet = packet;
    rig.core.on_datagram(packet, rig.now += 4ms);
  };
  say(R"(<RIst X="780.5" Y="-1.0" Z="1005.0" A="180.0" B="0.0" C="-90.0"/>)");
  const auto tcp = rig.core.state().stated_tcp;
  ASSERT_TRUE(tcp);
  EXPECT_NEAR((*tcp)[0], 0.7805, 1e-12);
  EXPECT_NEAR((*tcp)[3], 180 * kDeg, 1e-12);
  say(R"(<RIst X="780.5" Y="-1.0"/>)");
  EXPECT_FALSE(rig.core.state().stated_tcp) << "incomplete";
}

TEST_F(RsiFacts, PacketsThatArriveTwiceAreCountedAndAnsweredAlike) {
  rig.make_ready();
  EXPECT_EQ(facts().duplicates, 0u);
  rig.after_cycle = [&] {
    if (rig.packet.empty()) return;
    const std::string first = rig.reply;
    EXPECT_EQ(rig.core.on_datagram(rig.packet, rig.now + 200us), first);
  };
  const auto packets = facts().packets;
  rig.run(100ms);
  EXPECT_EQ(facts().duplicates, 25u) << facts().packets - packets;
  EXPECT_EQ(rig.core.state().quality.duplicates, 25u);
}

TEST_F(RsiFacts, AMoveWithoutPacketsIsRefusedWithHowLongItHasWaited) {
  rig.run(500ms);
  rig.begin(MoveKind::kTransit, AxisAngles(6, 0.0));
  const CoreResult refused = result();
  EXPECT_EQ(refused.outcome, MoveOutcome::kRefused);
  expect_cause(refused.cause, cause::NoPackets{0.5}, 0.01);
}

TEST_F(RsiFacts, AMoveIsRefusedUntilTheReference) {
  rig.krc.rsi_on();
  rig.run(300ms);
  EXPECT_EQ(facts().link, RobotLink::kNotReferenced);
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 1));
  expect(result(), MoveOutcome::kRefused, cause::NotReferenced{});
}

TEST_F(RsiFacts, AReferenceIsPendingFromTheAskingToTheRest) {
  rig.make_ready();
  EXPECT_FALSE(facts().rereference_pending);
  rig.core.rereference();
  EXPECT_EQ(facts().link, RobotLink::kNotReferenced) << "at once: nothing moves meanwhile";
  rig.cycle();
  EXPECT_EQ(facts().link, RobotLink::kReady) << "the record shows that it rests";
  EXPECT_FALSE(facts().rereference_pending);
  // A reference that cannot be taken is pending, and discarded when the link is lost.
  rig.krc.rsi_on();
  rig.run(40ms);
  rig.core.rereference();
  rig.cycle();
  rig.to_pc = false;
  rig.run(2s);
  EXPECT_EQ(facts().link, RobotLink::kLost);
  EXPECT_FALSE(facts().rereference_pending);
  rig.to_pc = true;
  rig.krc.rsi_on();
  rig.run(1s);
  EXPECT_EQ(facts().link, RobotLink::kNotReferenced) << "nobody asked in this session";
}

TEST_F(RsiFacts, OneAtATimeAndTheOtherIsToldSo) {
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 10));
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 5));
  expect(*rig.core.next_result(), MoveOutcome::kRefused, cause::Busy{});
  rig.run(50ms);
  EXPECT_TRUE(facts().moving);
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 5));
  expect(*rig.core.next_result(), MoveOutcome::kRefused, cause::Busy{});
}

TEST_F(RsiFacts, StoppedBeforeItBeganItWasStoppedAndNotRefused) {
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 10));
  rig.core.stop();
  expect(*rig.core.next_result(), MoveOutcome::kStopped, cause::StopAsked{});
}

TEST_F(RsiFacts, AtTheEndOfTheSessionNothingBegins) {
  rig.make_ready();
  rig.core.close();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 10));
  rig.cycle();
  expect(*rig.core.next_result(), MoveOutcome::kRefused, cause::Closing{});
}

TEST_F(RsiFacts, ARestartEndsTheMoveByName) {
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 10));
  rig.run(100ms);
  rig.krc.rsi_on();
  const CoreResult ended = result();
  EXPECT_EQ(ended.outcome, MoveOutcome::kRobotSilent);
  ASSERT_TRUE(is<cause::SessionRestarted>(ended.cause)) << words(ended);
  const auto& restart = std::get<cause::SessionRestarted>(ended.cause);
  EXPECT_EQ(restart.sign, cause::SessionRestarted::Sign::kSetpoint);
  EXPECT_EQ(restart.axis, 0);
  EXPECT_EQ(restart.before, 0.0);
  EXPECT_GT(restart.after, 0.0);
  EXPECT_EQ(facts().link, RobotLink::kNotReferenced);
}

TEST_F(RsiFacts, PacketsOfTooFewAxesAreNamedUntilThereAreEnough) {
  rig.make_ready();
  const std::string few =
      "<Rob Type=\"KUKA\"><AIPos A1=\"0.0000\" A2=\"-90.0000\"/><IPOC>4711</IPOC></Rob>";
  rig.core.on_datagram(few, rig.now);
  EXPECT_EQ(facts().trouble, Trouble::kTooFewAxes);
  EXPECT_EQ(facts().last_error, WireError::kNoAxes);
  EXPECT_EQ(facts().bad_packets, 1u);
  rig.run(20ms);
  EXPECT_EQ(facts().trouble, Trouble::kNone);
}

TEST_F(RsiFacts, SaysWhatItLearnsAndWhatItIsLike) {
  rig.krc.rsi_on();
  rig.run(20ms);
  EXPECT_EQ(facts().trouble, Trouble::kLearning);
  rig.run(200ms);
  EXPECT_EQ(facts().trouble, Trouble::kNone);
  EXPECT_EQ(facts().ipoc_step, 4u);
  EXPECT_NEAR(facts().cycle_s, 0.004, 1e-9);
  EXPECT_TRUE(facts().sends_setpoint && facts().sends_delay);
  EXPECT_EQ(facts().decimals, 4);
  EXPECT_EQ(facts().gaps, 0u);
  EXPECT_NEAR(facts().jitter_s, 0.0, 1e-9);
  EXPECT_NEAR(facts().longest_gap_s, 0.004, 1e-9);
  int turn = 0;
  rig.network_delay = [&] { return ++turn % 2 == 0 ? Duration(100us) : Duration(1100us); };
  rig.run(2s);
  EXPECT_NEAR(facts().jitter_s, 1e-3, 1e-4);
  EXPECT_NEAR(facts().longest_gap_s, 5e-3, 1e-9);
  EXPECT_GT(facts().replies, 500u);
  EXPECT_EQ(facts().packets, facts().replies);
}

TEST(RsiFactsAtRest, ANewAdapterBesideAMovingArmWaitsForItsRest) {
  Rig rig;
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 40));
  rig.run(200ms);
  RsiCore other(rig_config(), nullptr);
  for (int i = 0; i < 10; ++i) {
    rig.cycle();
    other.on_datagram(rig.packet, rig.now);
  }
  EXPECT_EQ(other.core_state().trouble, Trouble::kWaitingForRest);
  EXPECT_EQ(other.core_state().replies, 0u);
}

TEST(RsiFactsRefused, ThatNoReplyIsTakenIsSaidAfterTenAndNoMoveBegins) {
  RsiConfig config = rig_config();
  config.sentype = "KROSHU";
  Rig rig({}, config);
  rig.krc.rsi_on();
  ASSERT_TRUE(
      rig.run_until([&] { return rig.core.core_state().trouble == Trouble::kNotAccepted; }, 1s));
  EXPECT_EQ(rig.core.core_state().replies, 10u);
  rig.begin(MoveKind::kTransit, AxisAngles(6, 0.0));
  rig.cycle();
  const auto refused = rig.core.next_result();
  ASSERT_TRUE(refused);
  EXPECT_TRUE(is<cause::NotAccepted>(refused->cause));
}

TEST_F(RsiFacts, LateRepliesOfAnEarlierMoveAreNotCountedAgainstTheNext) {
  rig.make_ready();
  for (int move = 0; move < 3; ++move) {
    rig.begin(MoveKind::kTransit, rig.moved_by(0, move % 2 == 0 ? 5.0 : -5.0));
    rig.run(100ms);
    for (int late = 0; late < 2; ++late) {
      rig.to_krc = false;
      rig.cycle();
      rig.to_krc = true;
      rig.run(20ms);
    }
    EXPECT_EQ(facts().late_while_moving, 2u);
    expect(result(), MoveOutcome::kArrived, cause::None{});
  }
  EXPECT_EQ(facts().late, 6u);
}

TEST_F(RsiFacts, ModeAndOverrideAreKnownFromTheFirstPacketOfASession) {
  EXPECT_EQ(rig.core.state().mode, OperatingMode::kUnknown) << "before any";
  rig.make_ready();
  EXPECT_EQ(rig.core.state().mode, OperatingMode::kAut);
  EXPECT_EQ(rig.core.state().override_percent, 100);
  rig.krc.set_override(30);
  rig.cycle();
  EXPECT_EQ(rig.core.state().override_percent, 30);
  EXPECT_EQ(rig.core.state().link, RobotLink::kReady) << "it slows nothing, and stops nothing";
  rig.krc.mode(sim::OperatingMode::kT1);
  rig.run(200ms);
  EXPECT_EQ(rig.core.state().mode, OperatingMode::kUnknown) << "no packets, no mode";
  EXPECT_FALSE(rig.core.state().override_percent);
  rig.krc.rsi_on();
  rig.cycle();
  EXPECT_EQ(rig.core.state().mode, OperatingMode::kT1);
}

TEST_F(RsiFacts, ModeAndOverrideThatAreNotSentAreUnknown) {
  sim::ControllerConfig older;
  older.mode_tag.clear();
  older.override_tag.clear();
  Rig other(older);
  other.make_ready();
  EXPECT_EQ(other.core.state().mode, OperatingMode::kUnknown);
  EXPECT_FALSE(other.core.state().override_percent);
}

TEST_F(RsiFacts, AModeThatIsNoneOfTheFourIsUnknownAndStopsNothing) {
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 1));
  rig.before_core = [&] {
    const std::size_t at = rig.packet.find("<Mode R=\"3\"");
    ASSERT_NE(at, std::string::npos);
    rig.packet.replace(at, 11, "<Mode R=\"nan\"");
  };
  EXPECT_EQ(result().outcome, MoveOutcome::kArrived);
  EXPECT_EQ(rig.core.state().mode, OperatingMode::kUnknown);
  EXPECT_EQ(rig.core.state().link, RobotLink::kReady);
  EXPECT_EQ(facts().bad_packets, 0u);
}

}  // namespace
}  // namespace cellcal::drivers
