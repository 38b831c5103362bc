// The whole adapter with corrections in space on its socket, with the emulated controller and the
// ethernet file generated for them. Independent of timing.

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>

#include "drivers/io_thread.h"
#include "drivers/kuka/krl/krl_files.h"
#include "drivers/kuka/rsi/rsi_robot.h"
#include "sim/krc/krc_udp.h"
#include "tests/drivers/kuka/eventually.h"
#include "tests/drivers/kuka/rsi/correction/space_rig.h"

namespace cellcal::drivers {
namespace {

constexpr std::uint16_t kUdpArm = 3;

sim::ControllerConfig controller(CorrectionFrame frame) {
  sim::ControllerConfig config = space_krc(
      frame == CorrectionFrame::kTool ? sim::CorrectionFrame::kTool : sim::CorrectionFrame::kBase);
  RsiFilesConfig files;
  files.pc_address = "10.0.0.5";
  files.space.on = true;
  files.space.frame = frame;
  config.channel = sim::RsiChannelConfig::parse(rsi_files(files).at("cellcal_rsi_ethernet.xml"));
  config.timeout_cycles = 1000;
  return config;
}

class SpaceOverUdp : public ::testing::TestWithParam<CorrectionFrame> {
 protected:
  SpaceOverUdp() : io(IoThreadOptions{.realtime = false}) { io.start(); }

  static RsiConfig loopback(CorrectionFrame frame) {
    RsiConfig config = space_config(frame);
    config.bind_address = "127.0.0.1";
    config.port = 0;
    config.silence_cycles = 50;  // tolerates a loaded machine
    config.late_replies_limit = 1'000'000;
    return config;
  }
  static MoveResult move(RsiRobot& robot, MoveKind kind, const AxisAngles& by_deg, double cruise_s,
                         std::uint32_t id) {
    Move move{id, kind, robot.state().commanded_rad, cruise_s, kUdpArm};
    for (std::size_t i = 0; i < by_deg.size(); ++i) move.target_rad[i] += by_deg[i] * kDeg;
    robot.begin(move);
    std::optional<MoveResult> result;
    EXPECT_TRUE(eventually([&] { return (result = robot.poll()).has_value(); }));
    return result.value_or(MoveResult{});
  }

  IoThread io;
};

TEST_P(SpaceOverUdp, GoesSearchesTouchesRetreatsAndEndsTheSession) {
  ScriptedGuard guard;  // used on the robot's thread
  RsiRobot robot(io.context(), loopback(GetParam()), &guard);
  robot.open();
  sim::KrcUdpOptions to;
  to.pc_port = robot.port();
  // The surface: A1 passes 21 deg. Trip, its confirmation, and the level while it lasts.
  std::atomic<bool> searching{false};
  const double surface = 21 * kDeg;
  bool touched = false;
  sim::KrcUdp krc(controller(GetParam()), to, [&](sim::Controller& c, TimePoint now) {
    const bool in = c.actual_rad_at(now)[0] > surface;
    if (!searching || in == touched) return;
    touched = in;
    boost::asio::post(io.context(), [&guard, in, now] {
      guard.touch(in);
      if (!in) return;
      guard.trip(kUdpArm, now);
      guard.push(ContactEventKind::kContact, kUdpArm, now, 1);
    });
  });
  krc.start();
  ASSERT_TRUE(eventually([&] { return robot.state().link == RobotLink::kNotReferenced; }));
  ASSERT_TRUE(eventually([&] {
    robot.rereference();
    return eventually([&] { return robot.state().link == RobotLink::kReady; });
  })) << robot.state().words;

  const MoveResult there = move(robot, MoveKind::kTransit, {20, 8, -10, 20, -15, 25}, 0.0, 1);
  ASSERT_EQ(there.outcome, MoveOutcome::kArrived) << there.detail;
  asked_on(io.context(), [&] {
    guard.arm(kUdpArm);
    return 0;
  });
  searching = true;
  const MoveResult touch = move(robot, MoveKind::kSearch, {3, -1, 1, 1, -1, 1}, 3.0, 2);
  ASSERT_EQ(touch.outcome, MoveOutcome::kContact) << touch.detail;
  ASSERT_TRUE(touch.latch);
  EXPECT_NEAR(touch.latch->contact_rad[0], surface, 0.02 * kDeg);
  const MoveResult back = move(robot, MoveKind::kRetreat, {-3, 1, -1, -1, 1, -1}, 1.0, 3);
  EXPECT_EQ(back.outcome, MoveOutcome::kArrived) << back.detail;
  krc.with([&](sim::Controller& c) {
    EXPECT_NE(c.cartesian_correction(), sim::KukaFrame{});
    EXPECT_EQ(c.correction_deg(), std::vector<double>(6, 0.0)) << "no axis corrections";
  });
  robot.close();
  EXPECT_TRUE(eventually([&] {
    sim::RsiPhase phase{};
    krc.with([&](sim::Controller& c) { phase = c.phase(); });
    return phase == sim::RsiPhase::kEnded;
  }));
  EXPECT_TRUE(eventually([&] { return robot.port() == 0; }));
  krc.stop();
}

INSTANTIATE_TEST_SUITE_P(, SpaceOverUdp,
                         ::testing::Values(CorrectionFrame::kBase, CorrectionFrame::kTool),
                         [](const auto& one) {
                           return one.param == CorrectionFrame::kBase ? "Base" : "Tool";
                         });

}  // namespace
}  // namespace cellcal::drivers
