// The correction held by the controller when the adapter joins a running session.

#include <memory>

#include "tests/drivers/kuka/rsi/rig.h"
#include "tests/drivers/said.h"

namespace cellcal::drivers {
namespace {

// Above noise and rounding, far below any movement here.
constexpr double kNoJumpDeg = 0.02;

/// A controller with an adapter whose predecessor has moved the arm by 12 deg.
class Takeover {
 public:
  explicit Takeover(sim::ControllerConfig config = {}) : krc(config) {
    core = std::make_unique<RsiCore>(rig_config(), nullptr);
    run(300ms);
    krc.rsi_on();
    run(300ms);
    core->rereference();
    run(300ms);
    AxisAngles target = core->state().commanded_rad;
    target[0] += 12 * kDeg;
    core->begin({1, MoveKind::kTransit, target, 0.0, 0});
    run(2s);
    EXPECT_EQ(core->next_result()->outcome, MoveOutcome::kArrived);
    held_deg = krc.correction_deg()[0];
  }

  void run(Duration duration, bool connected = true) {
    for (const TimePoint end = now + duration; now < end;) {
      now += krc.cycle();
      const std::string packet(krc.tick(now));
      core->on_tick(now);
      if (!packet.empty() && connected) {
        const std::string_view reply = core->on_datagram(packet, now + 100us);
        if (!reply.empty()) ++replies;
        krc.receive(reply);
      }
      worst_jump_deg = std::max(worst_jump_deg, std::abs(krc.correction_deg()[0] - held_deg));
    }
  }
  void restart_adapter() { core = std::make_unique<RsiCore>(rig_config(), nullptr); }
  void watch() {
    worst_jump_deg = 0.0;
    replies = 0;
  }
  std::string words() const { return said(core->state().words); }
  bool usable() {
    core->rereference();
    run(500ms);
    if (core->state().link != RobotLink::kReady) return false;
    core->begin({2, MoveKind::kTransit, core->state().commanded_rad, 0.0, 0});
    run(500ms);
    const auto result = core->next_result();
    return result && result->outcome == MoveOutcome::kArrived;
  }

  TimePoint now{500s};
  sim::Controller krc;
  std::unique_ptr<RsiCore> core;
  double held_deg = 0.0, worst_jump_deg = 0.0;
  int replies = 0;
};

TEST(RsiOffset, NewAdapterInARunningSessionHoldsTheVeryOffset) {
  sim::ControllerConfig config;
  config.noise_sigma_deg = 0.0005;
  Takeover takeover(config);
  takeover.restart_adapter();
  takeover.watch();
  takeover.run(1s);
  EXPECT_EQ(takeover.krc.phase(), sim::RsiPhase::kRunning);
  EXPECT_LT(takeover.worst_jump_deg, kNoJumpDeg);
  EXPECT_LE(takeover.krc.late(), 5U) << "a few packets to see that the arm rests, no more";
  EXPECT_TRUE(takeover.usable());
  EXPECT_LT(takeover.worst_jump_deg, kNoJumpDeg);
}

TEST(RsiOffset, NewAdapterWaitsForAMovingArmToRest) {
  sim::ControllerConfig config;
  config.lag_s = 0.04;
  Takeover takeover(config);
  AxisAngles target = takeover.core->state().commanded_rad;
  target[0] += 30 * kDeg;
  takeover.core->begin({5, MoveKind::kTransit, target, 0.0, 0});
  takeover.run(300ms);  // in full motion
  takeover.restart_adapter();
  takeover.held_deg = takeover.krc.correction_deg()[0];
  takeover.run(8ms);
  takeover.held_deg = takeover.krc.correction_deg()[0];
  takeover.watch();
  takeover.run(1s);
  EXPECT_LT(takeover.worst_jump_deg, 0.1) << "rest is near the offset held by the controller";
  EXPECT_EQ(takeover.krc.phase(), sim::RsiPhase::kRunning);
  EXPECT_TRUE(takeover.usable());
}

TEST(RsiOffset, WithoutAsposANewAdapterKeepsQuietAndSaysWhy) {
  sim::ControllerConfig config;
  config.send_setpoint = false;
  Takeover takeover(config);
  takeover.restart_adapter();  // so fast that no reply is missing: Delay is still 0
  takeover.watch();
  takeover.run(300ms);
  EXPECT_EQ(takeover.replies, 0);
  EXPECT_NE(takeover.words().find("not answering"), std::string::npos) << takeover.words();
  takeover.run(1s);
  EXPECT_EQ(takeover.krc.phase(), sim::RsiPhase::kFaulted);
  EXPECT_EQ(takeover.worst_jump_deg, 0.0) << "the arm has not moved";
  takeover.krc.rsi_on();
  takeover.run(500ms);
  EXPECT_TRUE(takeover.usable()) << takeover.words();
}

TEST(RsiOffset, AfterSilenceARunningSessionGetsWhatItHolds) {
  for (const bool setpoint : {true, false}) {
    sim::ControllerConfig config;
    config.send_setpoint = setpoint;
    Takeover takeover(config);
    takeover.watch();
    takeover.run(200ms, false);
    takeover.run(500ms);
    EXPECT_EQ(takeover.core->state().link, RobotLink::kNotReferenced);
    EXPECT_GT(takeover.replies, 100) << setpoint;
    EXPECT_LT(takeover.worst_jump_deg, 1e-6) << "exactly what was sent last";
    EXPECT_TRUE(takeover.usable());
  }
}

TEST(RsiOffset, AfterSilenceAFreshSessionBeginsAtZero) {
  for (const bool setpoint : {true, false}) {
    sim::ControllerConfig config;
    config.send_setpoint = setpoint;
    Takeover takeover(config);
    takeover.run(1s, false);
    ASSERT_EQ(takeover.krc.phase(), sim::RsiPhase::kFaulted);
    takeover.krc.rsi_on();
    takeover.held_deg = 0.0;
    takeover.watch();
    takeover.run(500ms);
    EXPECT_GT(takeover.replies, 100) << setpoint;
    EXPECT_EQ(takeover.worst_jump_deg, 0.0);
    EXPECT_LE(takeover.krc.late(), 5U);
    EXPECT_TRUE(takeover.usable());
  }
}

TEST(RsiOffset, WithoutAsposAndDelayASilenceCannotBeJudged) {
  sim::ControllerConfig config;
  config.send_setpoint = config.send_delay = false;
  config.first_frame_only_ipoc = true;  // the only sign of the start of such a session
  Takeover takeover(config);
  takeover.watch();
  takeover.run(100ms, false);
  takeover.run(300ms);
  EXPECT_EQ(takeover.replies, 0);
  EXPECT_EQ(takeover.worst_jump_deg, 0.0);
  EXPECT_NE(takeover.words().find("not answering"), std::string::npos) << takeover.words();
}

TEST(RsiOffset, RestartWithinTheSilenceLimitIsNoticedByIpoc) {
  Takeover takeover;
  // The same packet, as from a controller whose counter restarted.
  const std::string other =
      "<Rob Type=\"KUKA\"><AIPos A1=\"12.0000\" A2=\"-90.0000\" A3=\"90.0000\" A4=\"0.0000\" "
      "A5=\"90.0000\" A6=\"0.0000\"/><ASPos A1=\"12.0000\" A2=\"-90.0000\" A3=\"90.0000\" "
      "A4=\"0.0000\" A5=\"90.0000\" A6=\"0.0000\"/><Delay D=\"0\"/><IPOC>40</IPOC></Rob>";
  EXPECT_TRUE(takeover.core->on_datagram(other, takeover.now + 4ms).empty())
      << "not before the difference is seen to be at rest";
  EXPECT_EQ(takeover.core->state().link, RobotLink::kNotReferenced);
}

TEST(RsiOffset, RestartThatOnlyDelayOrAsposBetraysIsNoticed) {
  for (const bool setpoint : {true, false}) {
    sim::ControllerConfig config;
    config.send_setpoint = setpoint;
    Takeover takeover(config);
    takeover.run(8ms, false);  // two late replies, then a new session without any silence
    takeover.run(100ms);
    takeover.krc.rsi_on();
    takeover.held_deg = 0.0;
    takeover.watch();
    takeover.run(300ms);
    EXPECT_EQ(takeover.core->state().link, RobotLink::kNotReferenced);
    EXPECT_EQ(takeover.replies, 0) << "one field against all others";
    EXPECT_EQ(takeover.worst_jump_deg, 0.0) << setpoint;
    takeover.run(500ms);
    ASSERT_EQ(takeover.krc.phase(), sim::RsiPhase::kFaulted) << "it gave up";
    takeover.krc.rsi_on();
    takeover.run(200ms);
    EXPECT_TRUE(takeover.usable()) << takeover.words();
    EXPECT_EQ(takeover.worst_jump_deg, 0.0) << setpoint;
  }
}

TEST(RsiOffset, RestartWhileAMoveSettlesIsNotTakenForASetpointThatFollows) {
  // A new session at the arm's position: its ASPos is the pose commanded by the last replies, and
  // its correction is 0.
  Takeover takeover;
  AxisAngles target = takeover.core->state().commanded_rad;
  target[0] += 5 * kDeg;
  takeover.core->begin({5, MoveKind::kTransit, target, 0.0, 0});
  while (takeover.core->state().commanded_rad != target) takeover.run(4ms);
  takeover.run(40ms);
  ASSERT_TRUE(takeover.core->state().moving) << "all but there, and not yet arrived";
  ASSERT_EQ(takeover.krc.late(), 0U);
  takeover.krc.rsi_on();
  takeover.held_deg = 0.0;
  takeover.watch();
  takeover.run(300ms);
  EXPECT_EQ(takeover.worst_jump_deg, 0.0);
  EXPECT_EQ(takeover.core->state().link, RobotLink::kNotReferenced);
  EXPECT_EQ(takeover.core->next_result()->outcome, MoveOutcome::kRobotSilent);
  EXPECT_EQ(takeover.replies, 0);
  takeover.run(500ms);
  takeover.krc.rsi_on();
  takeover.run(200ms);
  EXPECT_TRUE(takeover.usable());
  EXPECT_EQ(takeover.worst_jump_deg, 0.0);
}

}  // namespace
}  // namespace cellcal::drivers
