// Packets with one false part: no reply moves the arm beyond its limits, and the cause is that of
// the false part.

#include <array>
#include <vector>

#include "drivers/kuka/rsi/path_move.h"
#include "drivers/kuka/rsi/rsi_setpoint.h"
#include "tests/drivers/kuka/rsi/rig.h"
#include "tests/drivers/said.h"

namespace cellcal::drivers {
namespace {

constexpr double kRsiCycleS = 0.004;
/// The six transmitted decimals, in each of three replies.
constexpr double kWireDeg = 4e-6;

sim::ControllerConfig waiting_krc() {
  sim::ControllerConfig krc;
  krc.timeout_cycles = 1000;
  return krc;
}

/// Motion demanded of the axes between replies.
class Replies {
 public:
  void check(const std::string& reply) {
    if (reply.empty()) return;
    std::array<double, 6> at{};
    for (std::size_t i = 0; i < at.size(); ++i) {
      const std::string name = "A" + std::to_string(i + 1) + "=\"";
      at[i] = std::stod(reply.substr(reply.find(name, reply.find("<AK")) + name.size()));
    }
    said.push_back(at);
  }
  /// Largest difference of this order per cycle [deg/s, deg/s^2].
  double most(int order) const {
    double found = 0.0;
    for (std::size_t k = 2; k < said.size(); ++k) {
      for (std::size_t i = 0; i < 6; ++i) {
        const double step = said[k][i] - said[k - 1][i];
        const double change = step - (said[k - 1][i] - said[k - 2][i]);
        found = std::max(found, order == 1 ? std::abs(step) / kRsiCycleS
                                           : std::abs(change) / (kRsiCycleS * kRsiCycleS));
      }
    }
    return found;
  }
  std::vector<std::array<double, 6>> said;
};

void expect_within_limits(const Replies& replies) {
  EXPECT_LE(replies.most(1), 100.0 + kWireDeg / kRsiCycleS);
  EXPECT_LE(replies.most(2), 400.0 + kWireDeg / (kRsiCycleS * kRsiCycleS));
}

struct InconsistentPackets : testing::Test {
  void SetUp() override { make(rig_config()); }
  void make(const RsiConfig& config) {
    rig = std::make_unique<Rig>(waiting_krc(), config);
    rig->make_ready();
    ASSERT_EQ(rig->move(MoveKind::kTransit, rig->moved_by(1, -12)).outcome, MoveOutcome::kArrived);
    rig->after_cycle = [this] { replies.check(rig->reply); };
    rig->cycle();
    rig->cycle();
  }
  /// Increases the number after `name` in `element` by this.
  void shift(const std::string& element, const std::string& name, double by, int decimals) {
    std::string& text = rig->packet;
    const auto at = text.find(name + "=\"", text.find("<" + element)) + name.size() + 2;
    const auto end = text.find('"', at);
    char number[40];
    std::snprintf(number, sizeof number, "%.*f", decimals, std::stod(text.substr(at, end)) + by);
    text.replace(at, end - at, number);
  }
  void shift_ipoc(int by) {
    std::string& text = rig->packet;
    const auto at = text.find("<IPOC>") + 6, end = text.find("</IPOC>");
    text.replace(at, end - at, std::to_string(std::stoll(text.substr(at, end)) + by));
  }
  const CoreState& facts() { return rig->core.core_state(); }
  std::optional<CoreResult> begun_move_ends(Duration limit = 2s) {
    std::optional<CoreResult> result;
    rig->run_until([&] { return (result = rig->core.next_result()).has_value(); }, limit);
    return result;
  }

  std::unique_ptr<Rig> rig;
  Replies replies;
};

TEST_F(InconsistentPackets, AStartPoseThatIsShiftedAtRestIsNoCorrection) {
  for (const double by_deg : {1.0, -5.0, 30.0, -12.0 /* as if there were none */}) {
    SCOPED_TRACE(by_deg);
    make(rig_config());
    const std::vector<double> held = rig->krc.correction_deg();
    rig->before_core = [&] { shift("ASPos", "A2", by_deg, 4); };
    rig->run(400ms);
    EXPECT_EQ(rig->krc.correction_deg(), held) << "the arm holds";
    EXPECT_LE(replies.most(1), kWireDeg / kRsiCycleS);
    EXPECT_EQ(facts().trouble, Trouble::kCorrectionDenied);
    EXPECT_EQ(facts().link, RobotLink::kNotReferenced);
    EXPECT_TRUE(rig->core.state().unsettled);
    // Once it is correct again, the session is unchanged.
    rig->before_core = {};
    rig->run(100ms);
    EXPECT_EQ(rig->krc.correction_deg(), held);
    rig->make_referenced();
    EXPECT_EQ(rig->move(MoveKind::kTransit, rig->moved_by(1, 3)).outcome, MoveOutcome::kArrived);
    expect_within_limits(replies);
    replies.said.clear();
  }
}

TEST_F(InconsistentPackets, AStartPoseThatIsShiftedInAMoveEndsItByItsNameAndIsNoCorrection) {
  for (const double by_deg : {1.0, 30.0}) {
    SCOPED_TRACE(by_deg);
    make(rig_config());
    rig->begin(MoveKind::kTransit, rig->moved_by(1, -40));
    rig->run(400ms);
    rig->before_core = [&] { shift("ASPos", "A2", by_deg, 4); };
    const auto ended = begun_move_ends();
    ASSERT_TRUE(ended);
    EXPECT_EQ(ended->outcome, MoveOutcome::kRobotSilent);
    expect_cause(
        ended->cause,
        cause::SessionRestarted{cause::SessionRestarted::Sign::kSetpoint, -90.0, -90.0 + by_deg, 1},
        1e-6);
    EXPECT_TRUE(has(said(words(*ended)), "A2: start pose (ASPos) went from")) << words(*ended);
    rig->run(400ms);
    expect_within_limits(replies);
    EXPECT_EQ(facts().trouble, Trouble::kCorrectionDenied);
    replies.said.clear();
  }
}

TEST_F(InconsistentPackets, DelayThatCountsBackEndsTheMoveByItsNameAndTheCorrectionIsHeldOn) {
  rig->to_krc = false;
  rig->cycle();
  rig->to_krc = true;
  rig->run(20ms);
  replies.said.clear();
  rig->begin(MoveKind::kTransit, rig->moved_by(1, -40));
  rig->run(100ms);
  rig->before_core = [&] { shift("Delay", "D", -1, 0); };
  rig->cycle();
  rig->before_core = {};
  const auto ended = begun_move_ends();
  ASSERT_TRUE(ended);
  expect_cause(ended->cause,
               cause::SessionRestarted{cause::SessionRestarted::Sign::kDelay, 1.0, 0.0, 0});
  EXPECT_TRUE(has(said(words(*ended)), "Delay counted back from 1 to 0")) << words(*ended);
  rig->run(400ms);
  EXPECT_GT(facts().replies, 0u);
  rig->make_referenced();
  EXPECT_LE(replies.most(1), 100.0 + kWireDeg / kRsiCycleS);
}

TEST_F(InconsistentPackets, WithoutAStartPoseNoCounterThatLiesForAPacketSendsTheArmBackToZero) {
  for (const bool of_delay : {true, false}) {
    SCOPED_TRACE(of_delay);
    sim::ControllerConfig krc = waiting_krc();
    krc.send_setpoint = false;
    Rig other(krc);
    other.run(300ms);  // nobody answers, so that it starts after this
    other.make_ready();
    ASSERT_EQ(other.move(MoveKind::kTransit, other.moved_by(1, -12)).outcome,
              MoveOutcome::kArrived);
    other.to_krc = false;
    other.cycle();
    other.to_krc = true;
    other.run(40ms);
    const std::vector<double> held = other.krc.correction_deg();
    other.before_core = [&] {
      if (of_delay) {
        const auto at = other.packet.find("<Delay D=\"") + 10;
        ASSERT_NE(other.packet[at], '0');
        other.packet.replace(at, other.packet.find('"', at) - at, "0");
      } else {
        other.packet.replace(other.packet.find("<IPOC>") + 6, 1, "7");
      }
    };
    other.cycle();
    other.before_core = {};
    other.run(500ms);
    EXPECT_EQ(other.krc.correction_deg(), held);
  }
}

TEST_F(InconsistentPackets,
       ALinkThatIsLostWithTheLastReplyIsTakenUpByTheOneThatTheControllerHolds) {
  for (const Duration moving : {60ms, 400ms}) {  // at 7 and at 100 deg/s
    make(rig_config());
    rig->begin(MoveKind::kTransit, rig->moved_by(1, -60));
    rig->run(moving);
    rig->to_krc = false;
    rig->cycle();  // this reply does not arrive
    rig->to_pc = false;
    rig->run(40ms);
    const std::vector<double> held = rig->krc.correction_deg();
    rig->to_krc = rig->to_pc = true;
    rig->run(300ms);
    EXPECT_EQ(rig->krc.correction_deg(), held) << rig->core.state().words;
    rig->core.next_result();
    rig->make_referenced();
    EXPECT_EQ(rig->move(MoveKind::kTransit, rig->moved_by(1, 3)).outcome, MoveOutcome::kArrived);
  }
}

TEST_F(InconsistentPackets, APacketThatOnlyItsIpocIsLeftOfIsNoBeginningOfASession) {
  const std::vector<double> held = rig->krc.correction_deg();
  rig->to_pc = false;
  rig->run(100ms);
  rig->to_pc = true;
  rig->before_core = [&] {
    rig->packet = "<Rob Type=\"KUKA\"><IPOC>" + std::to_string(rig->krc.ipoc()) + "</IPOC></Rob>";
  };
  rig->run(20ms);
  rig->before_core = {};
  rig->run(200ms);
  EXPECT_EQ(rig->krc.correction_deg(), held);
  EXPECT_LE(replies.most(1), kWireDeg / kRsiCycleS);
  rig->make_referenced();
}

// ---- damaged packets -------------------------------------------------------------------------------

TEST_F(InconsistentPackets, ADamagedPacketAtFullSpeedIsNoStepInSpeed) {
  rig->begin(MoveKind::kTransit, rig->moved_by(1, -60));
  int cycle = 0;
  rig->before_core = [&] {
    ++cycle;
    if (cycle % 7 != 0) return;
    if (cycle % 14 == 0) {
      rig->packet.replace(rig->packet.find("<AIPos"), 6, "<Other");
    } else {
      rig->packet.replace(rig->packet.find("A1=\"") + 4, 3, "nan");
    }
  };
  const CoreResult result = rig->finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kArrived) << words(result);
  EXPECT_GT(replies.most(1), 99.0);
  expect_within_limits(replies);
  EXPECT_EQ(rig->krc.late(), 0u);
}

TEST_F(InconsistentPackets, ADamagedPacketThatCountsALateReplyDoesNotAdvanceTheMove) {
  for (const std::string axes : {"nan", "none"}) {
    SCOPED_TRACE(axes);
    make(rig_config());
    rig->begin(MoveKind::kTransit, rig->moved_by(1, -60));
    rig->run(400ms);
    rig->to_krc = false;
    rig->cycle();
    rig->to_krc = true;
    const auto held = *(replies.said.end() - 2);
    rig->before_core = [&] {
      if (axes == "nan") return void(rig->packet.replace(rig->packet.find("A1=\"") + 4, 3, "nan"));
      rig->packet.replace(rig->packet.find("<AIPos"), 6, "<Other");
    };
    rig->cycle();
    EXPECT_EQ(replies.said.back(), held);
    EXPECT_EQ(facts().late, 1u);
    rig->before_core = {};
    EXPECT_EQ(rig->finish().outcome, MoveOutcome::kArrived);
    EXPECT_EQ(rig->krc.late(), 1u);
  }
}

TEST_F(InconsistentPackets, AnImpossibleDelayInADamagedPacketIsIgnored) {
  for (const double by : {-1.0, 2.0, 90.0}) {
    SCOPED_TRACE(by);
    make(rig_config());
    // A late reply at rest, so that Delay can fall.
    rig->to_krc = false;
    rig->cycle();
    rig->to_krc = true;
    rig->run(100ms);
    ASSERT_EQ(rig->krc.late(), 1u);
    rig->begin(MoveKind::kTransit, rig->moved_by(1, -60));
    int cycle = 0;
    rig->before_core = [&] {
      if (++cycle % 7 != 0) return;
      shift("Delay", "D", by, 0);
      rig->packet.replace(rig->packet.find("A1=\"") + 4, 3, "nan");
    };
    EXPECT_EQ(rig->finish().outcome, MoveOutcome::kArrived);
    EXPECT_GT(replies.most(1), 99.0);
    expect_within_limits(replies);
    EXPECT_EQ(facts().late, 1u);
    replies.said.clear();
  }
}

// Without ASPos the counters alone show which correction the controller holds.
TEST_F(InconsistentPackets, TheCorrectionIsKeptAfterDamagedPacketsAndALossOfTheLink) {
  for (const bool legible : {true, false}) {
    for (const bool late : {true, false}) {
      SCOPED_TRACE(legible);
      SCOPED_TRACE(late);
      sim::ControllerConfig krc = waiting_krc();
      krc.send_setpoint = false;
      rig = std::make_unique<Rig>(krc, rig_config());
      rig->run(300ms);  // silence before the session: it is a new one
      rig->make_ready();
      ASSERT_EQ(rig->move(MoveKind::kTransit, rig->moved_by(1, -12)).outcome,
                MoveOutcome::kArrived);
      rig->begin(MoveKind::kTransit, rig->moved_by(1, -40));
      rig->run(300ms);
      rig->to_krc = !late;
      rig->before_core = [&] {
        rig->packet.replace(rig->packet.find("<AIPos"), 6, "<Other");
        if (!legible) rig->packet.replace(rig->packet.find("<Delay"), 6, "<Later");
      };
      rig->run(80ms);
      rig->before_core = {};
      rig->to_krc = true;
      rig->to_pc = false;
      rig->run(250ms);
      const std::vector<double> held = rig->krc.correction_deg();
      rig->to_pc = true;
      double jump_deg = 0.0;
      rig->after_cycle = [&] {
        for (std::size_t i = 0; i < held.size(); ++i)
          jump_deg = std::max(jump_deg, std::abs(rig->krc.correction_deg()[i] - held[i]));
      };
      rig->run(1s);
      // Replies that were not taken may have been ahead by their way.
      EXPECT_LT(jump_deg, 100.0 * 0.02) << "held " << held[1];
      rig->after_cycle = {};
    }
  }
}

TEST_F(InconsistentPackets, PacketsThatAreAllDamagedBringTheArmToRestWithinItsLimits) {
  for (const int damaged : {2, 3, 200}) {
    SCOPED_TRACE(damaged);
    make(rig_config());
    rig->begin(MoveKind::kTransit, rig->moved_by(1, -60));
    rig->run(400ms);
    int left = damaged;
    rig->before_core = [&] {
      if (left-- > 0) rig->packet.replace(rig->packet.find("<AIPos"), 6, "<Other");
    };
    const auto ended = begun_move_ends();
    ASSERT_TRUE(ended);
    expect_within_limits(replies);
    replies.said.clear();
    if (damaged == 2) {
      EXPECT_EQ(ended->outcome, MoveOutcome::kArrived) << words(*ended);
      continue;
    }
    EXPECT_EQ(ended->outcome, MoveOutcome::kRobotSilent);
    expect_cause(ended->cause, cause::DamagedPackets{3});
    EXPECT_TRUE(has(said(words(*ended)), "3 damaged packets")) << words(*ended);
    EXPECT_EQ(facts().link == RobotLink::kLost, damaged == 200);
  }
}

// ---- IPOC --------------------------------------------------------------------------------------------

TEST_F(InconsistentPackets, AnIpocThatGoesBackWithinTheSilenceLimitIsNamed) {
  RsiConfig config = rig_config();
  config.silence_cycles = 10;
  make(config);
  rig->begin(MoveKind::kTransit, rig->moved_by(1, -60));
  rig->run(300ms);
  rig->before_core = [&] { shift_ipoc(-40); };
  const auto ended = begun_move_ends(60ms);
  ASSERT_TRUE(ended) << "it went on without a word";
  EXPECT_EQ(ended->outcome, MoveOutcome::kRobotSilent);
  ASSERT_TRUE(is<cause::SessionRestarted>(ended->cause)) << words(*ended);
  EXPECT_EQ(std::get<cause::SessionRestarted>(ended->cause).sign,
            cause::SessionRestarted::Sign::kIpoc);
}

TEST_F(InconsistentPackets, ALinkThatIsLostNeverSaysThatNothingCameForNoTime) {
  rig->to_pc = false;
  while (facts().link != RobotLink::kLost) rig->cycle();
  EXPECT_TRUE(has(said(rig->core.state().words), "no packet for 16 ms")) << rig->core.state().words;
  // The same packet repeatedly: not a new one.
  rig->to_pc = true;
  rig->run(100ms);
  rig->make_referenced();
  rig->begin(MoveKind::kTransit, rig->moved_by(1, -60));
  rig->cycle();
  while (facts().link == RobotLink::kReady) {
    rig->now += 4ms;
    rig->core.on_datagram(rig->packet, rig->now);
  }
  EXPECT_TRUE(has(said(rig->core.state().words), "no packet for 20")) << rig->core.state().words;
}

// ---- the last line -----------------------------------------------------------------------------------

const std::vector<AxisLimit> kLimits(2, {-9, 9, 100 * kDeg, 400 * kDeg, 4000 * kDeg});

TEST(ReplyBoundary, LetsNoReplyBeyondSpeedAccelerationOrJerkAndKeepsWhatWasSaidLast) {
  using Of = cause::ReplyBeyondLimit::Of;
  ReplyBound bound(kLimits);
  const auto said = [&](double a2_deg, bool stops = false) {
    return bound.admit({0.0, a2_deg * kDeg}, kRsiCycleS, stops);
  };
  bound.rest_at({0.0, 12 * kDeg});
  EXPECT_FALSE(said(12.0));
  const auto jump = said(13.0);
  ASSERT_TRUE(jump);
  EXPECT_EQ(jump->of, Of::kSpeed);
  EXPECT_EQ(jump->axis, 1);
  EXPECT_NEAR(jump->value, 250.0, 1e-6);
  EXPECT_NEAR(jump->limit, 100.0, 1e-6);
  ASSERT_TRUE(said(12.0 + 0.0066));
  EXPECT_EQ(said(12.0 + 0.0066)->of, Of::kAcceleration) << "412 deg/s2";
  EXPECT_EQ(said(12.0 + 0.0003)->of, Of::kJerk);
  EXPECT_FALSE(said(12.0 + 0.00025)) << "3906 deg/s3";
  EXPECT_TRUE(said(std::nan("")));
}

TEST(ReplyBoundary, AStopIsNeverTooHardAndAnArmStoppedByLateRepliesStartsFromRest) {
  ReplyBound bound(kLimits);
  bound.rest_at({0.0, 0.0});
  const PathMove path({0.0, 0.0}, {0.0, 60 * kDeg}, kLimits, 0.0);
  double t_s = 0.0;
  while (t_s < 0.4) ASSERT_FALSE(bound.admit(path.at(t_s += kRsiCycleS), kRsiCycleS, false)) << t_s;
  const AxisAngles last = path.at(t_s);
  for (const bool taken : {false, true}) {
    ReplyBound again = bound;
    again.stopped(taken);
    EXPECT_EQ(again.admit(last, kRsiCycleS, false).has_value(), !taken);
    EXPECT_TRUE(again.admit(path.at(t_s + kRsiCycleS), kRsiCycleS, false)) << "at full speed";
    const AxisAngles held = taken ? last : path.at(t_s - kRsiCycleS);
    EXPECT_FALSE(again.admit({0.0, held[1] + 0.00025 * kDeg}, kRsiCycleS, false));
  }
  ReplyBound late = bound;
  EXPECT_TRUE(late.admit(last, kRsiCycleS, false)) << "from 100 deg/s to none";
  EXPECT_FALSE(bound.admit(last, kRsiCycleS, true)) << "unless it is a stop";
  EXPECT_TRUE(bound.admit(path.at(t_s + kRsiCycleS), kRsiCycleS, true))
      << "and no going on at once";
}

}  // namespace
}  // namespace cellcal::drivers
