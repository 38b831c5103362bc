// Corrections in space in a session: contact, stops, silence, takeovers. Same guarantees as axis
// corrections.

#include "drivers/error.h"
#include "drivers/kuka/rsi/rsi_setpoint.h"
#include "tests/drivers/kuka/allocation_count.h"
#include "tests/drivers/kuka/rsi/correction/space_rig.h"
#include "tests/drivers/said.h"

namespace cellcal::drivers {
namespace {

constexpr std::uint16_t kArm = 7;

/// All axes move: A1 by 2 deg in 10 s, about 5 mm/s.
AxisAngles search_target(const Rig& rig) {
  AxisAngles target = rig.commanded();
  const double by_deg[] = {2.0, -0.7, 1.1, 1.5, -0.9, 1.2};
  for (std::size_t i = 0; i < 6; ++i) target[i] += by_deg[i] * kDeg;
  return target;
}

class SpaceSearch : public ::testing::Test {
 protected:
  void search(Duration into = 1s) {
    rig.make_ready();
    AxisAngles away = rig.commanded();
    const double by_deg[] = {20, 10, -12, 25, -15, 30};
    for (std::size_t i = 0; i < 6; ++i) away[i] += by_deg[i] * kDeg;
    ASSERT_EQ(rig.move(MoveKind::kTransit, away).outcome, MoveOutcome::kArrived);
    rig.guard.arm(kArm);
    rig.begin(MoveKind::kSearch, search_target(rig), 10.0, kArm);
    rig.run(into);
    ASSERT_TRUE(rig.core.state().moving);
  }
  Rig rig{space_krc(), space_config()};
};

TEST_F(SpaceSearch, TripFreezesTheVeryReplyAndContactLatches) {
  search();
  rig.network_delay = [] { return Duration(50us); };
  const AxisAngles before = rig.commanded();
  const std::string last = said(rig.reply);
  const TimePoint edge = rig.now + 1500us;
  const std::vector<double> truth = rig.krc.actual_rad_at(edge);
  rig.guard.trip(kArm, edge);
  rig.cycle();
  EXPECT_EQ(said(rig.reply), last) << "the very same RKorr";
  rig.run(20ms);
  rig.guard.push(ContactEventKind::kContact, kArm, edge, 3);
  rig.guard.touch(true);
  const CoreResult result = rig.finish();
  ASSERT_EQ(result.outcome, MoveOutcome::kContact) << words(result);
  EXPECT_EQ(said(rig.reply), last);
  ASSERT_TRUE(result.latch);
  EXPECT_NEAR(result.latch->reaction_s, 2.55e-3, 1e-6);
  for (std::size_t i = 0; i < 6; ++i) {
    // As with axis corrections: four transmitted decimals, and the travel within the smallest
    // delay.
    EXPECT_NEAR(result.latch->contact_rad[i], truth[i], 1.2e-4 * kDeg) << i;
    EXPECT_NEAR(result.latch->settled_rad[i], before[i], 4e-4 * kDeg) << i;
  }
  // And back, initially still in contact.
  rig.guard.touch(false);
  EXPECT_EQ(rig.move(MoveKind::kRetreat, rig.moved_by(0, -1)).outcome, MoveOutcome::kArrived);
}

TEST_F(SpaceSearch, StopFreezesInTheNextReply) {
  search();
  const std::string last = said(rig.reply);
  rig.core.stop();
  rig.cycle();
  EXPECT_EQ(said(rig.reply), last);
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kStopped);
}

TEST_F(SpaceSearch, SilenceEndsTheMoveAndNothingMovesAfterItUntilReferenced) {
  search();
  rig.to_pc = false;
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kRobotSilent);
  EXPECT_EQ(rig.core.state().link, RobotLink::kLost);
  rig.to_pc = true;
  const sim::KukaFrame held = rig.krc.cartesian_correction();
  rig.run(500ms);
  EXPECT_EQ(rig.krc.cartesian_correction(), held) << "the very correction that is held";
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 1)).outcome, MoveOutcome::kRefused);
  EXPECT_EQ(rig.krc.cartesian_correction(), held);
  rig.core.rereference();
  ASSERT_TRUE(rig.run_until([&] { return rig.core.state().link == RobotLink::kReady; }, 2s));
  EXPECT_EQ(rig.krc.cartesian_correction(), held) << "a reference moves nothing either";
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, -1)).outcome, MoveOutcome::kArrived);
}

TEST_F(SpaceSearch, LateRepliesEndTheMove) {
  search();
  for (int i = 0; i < 3; ++i) {
    rig.to_krc = false;
    rig.cycle();
    rig.to_krc = true;
    rig.run(40ms);
  }
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kRobotSilent) << words(result);
  EXPECT_TRUE(is<cause::LateReplies>(result.cause)) << words(result);
}

TEST_F(SpaceSearch, EndOfTheSessionStopsTheControllersProgram) {
  search();
  rig.core.close();
  ASSERT_TRUE(rig.run_until([&] { return rig.krc.phase() == sim::RsiPhase::kEnded; }, 5s));
  EXPECT_EQ(rig.krc.message(), "RSI_MOVECORR ended (STOP)");
}

TEST_F(SpaceSearch, DamagedAndRepeatedPacketsAreAnsweredWithTheHeldValue) {
  search();
  const std::string last = said(rig.reply);
  const std::string again(rig.core.on_datagram(rig.packet, rig.now + 200us));
  EXPECT_EQ(said(again), last);
}

// ---- takeovers ---------------------------------------------------------------------------------

/// A controller with an adapter that has moved all axes of its arm.
class SpaceSessionTakeover {
 public:
  explicit SpaceSessionTakeover(sim::ControllerConfig config = space_krc())
      : krc(std::move(config)) {
    core = std::make_unique<RsiCore>(space_config(), nullptr);
    run(300ms);
    krc.rsi_on();
    run(300ms);
    EXPECT_TRUE(moved());
    held = krc.cartesian_correction();
    held_axes = krc.setpoint_rad();
  }
  bool moved() {
    core->rereference();
    run(500ms);
    AxisAngles target = core->state().commanded_rad;
    const double by_deg[] = {12, -6, 8, 14, -10, 16};
    const double way = ++moves % 2 == 1 ? 1.0 : -1.0;
    for (std::size_t i = 0; i < 6; ++i) target[i] += way * by_deg[i] * kDeg;
    core->begin({1, MoveKind::kTransit, target, 0.0, 0});
    run(3s);
    const auto result = core->next_result();
    EXPECT_TRUE(result && result->outcome == MoveOutcome::kArrived)
        << (result ? words(*result) : core->state().words);
    return result && result->outcome == MoveOutcome::kArrived;
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
      for (std::size_t i = 0; i < 6 && !held_axes.empty(); ++i) {
        jump_deg = std::max(jump_deg, std::abs(krc.setpoint_rad()[i] - held_axes[i]) / kDeg);
      }
    }
  }
  void restart_adapter() { core = std::make_unique<RsiCore>(space_config(), nullptr); }
  void watch() {
    jump_deg = 0.0;
    replies = 0;
  }

  TimePoint now{500s};
  sim::Controller krc;
  std::unique_ptr<RsiCore> core;
  sim::KukaFrame held{};
  std::vector<double> held_axes;
  double jump_deg = 0.0;
  int replies = 0, moves = 0;
};

TEST(RsiSpaceOffset, NewAdapterInARunningSessionKeepsQuietForItsFrameMayBeAnother) {
  SpaceSessionTakeover takeover;
  takeover.restart_adapter();
  takeover.watch();
  takeover.run(200ms);
  EXPECT_EQ(takeover.krc.phase(), sim::RsiPhase::kRunning);
  EXPECT_EQ(takeover.replies, 0);
  EXPECT_LT(takeover.jump_deg, 1e-9);
  EXPECT_FALSE(takeover.core->state().words.empty());
}

TEST(RsiSpaceOffset, AfterSilenceAnArmThatStandsALittleAsideIsNotLedFurther) {
  // A controller with a slightly longer tool interprets each frame slightly differently.
  sim::ControllerConfig config = space_krc();
  calib::Cell cell = torch_cell();
  cell.tool.tcp.translation() *= 1.001;
  config.arm = sim::make_cartesian_arm(cell);
  SpaceSessionTakeover takeover(config);
  for (int hiccup = 0; hiccup < 5; ++hiccup) {
    takeover.run(100ms, false);
    takeover.run(300ms);
  }
  EXPECT_EQ(takeover.krc.cartesian_correction(), takeover.held);
  EXPECT_LT(takeover.jump_deg, 1e-9);
}

TEST(RsiSpaceOffset, AfterSilenceARunningSessionGetsTheVeryCorrectionThatItHolds) {
  for (const bool aspos : {true, false}) {
    sim::ControllerConfig config = space_krc();
    config.noise_sigma_deg = 0.0005;
    config.send_setpoint = aspos;
    SpaceSessionTakeover takeover(config);
    takeover.run(200ms, false);
    takeover.watch();
    takeover.run(1s);
    EXPECT_GT(takeover.replies, 200) << takeover.core->state().words;
    EXPECT_EQ(takeover.krc.cartesian_correction(), takeover.held) << aspos;
    EXPECT_TRUE(takeover.moved()) << aspos;
  }
}

TEST(RsiSpaceOffset, AfterSilenceAFreshSessionBeginsAtZero) {
  for (const bool aspos : {true, false}) {
    sim::ControllerConfig config = space_krc();
    config.send_setpoint = aspos;
    SpaceSessionTakeover takeover(config);
    takeover.run(2s, false);
    takeover.krc.rsi_on();
    takeover.run(1s, true);
    EXPECT_EQ(takeover.krc.cartesian_correction(), sim::KukaFrame{}) << aspos;
    EXPECT_TRUE(takeover.moved()) << aspos;
  }
}

TEST(RsiSpaceOffset, WithoutAsposANewAdapterKeepsQuietAndSaysWhy) {
  sim::ControllerConfig config = space_krc();
  config.send_setpoint = false;
  SpaceSessionTakeover takeover(config);
  takeover.restart_adapter();
  takeover.watch();
  takeover.run(200ms);
  EXPECT_EQ(takeover.replies, 0);
  EXPECT_NE(said(takeover.core->state().words).find("DEF_ASPos"), std::string::npos);
  EXPECT_LT(takeover.jump_deg, 1e-9);
}

TEST(RsiSpaceOffset, FirstFrameOfRsi2IsAnsweredInSpace) {
  sim::ControllerConfig config = space_krc();
  config.first_frame_only_ipoc = true;
  Rig rig(config, space_config());
  rig.krc.rsi_on();
  rig.cycle();
  EXPECT_NE(rig.reply.find("<RKorr X=\"0.000000\" Y=\"0.000000\" Z=\"0.000000\" A=\"0.000000\" "
                           "B=\"0.000000\" C=\"0.000000\"/>"),
            std::string::npos)
      << rig.reply;
}

// ---- held corrections, packet by packet ---------------------------------------------------------

/// A session that has commanded A1 by 2 deg, followed by packets after a silence.
struct SpaceSetpoint : testing::Test {
  static constexpr double kStart[] = {0, -90, 90, 0, 60, 0};

  static RobFrame packet(const AxisAngles& actual_deg, const AxisAngles& setpoint_deg) {
    RobFrame frame;
    frame.axes_deg = actual_deg;
    frame.setpoint_axes_deg = setpoint_deg;
    return frame;
  }
  static AxisAngles pose(double a1_deg = 0.0, double a2_deg = 0.0) {
    AxisAngles deg(std::begin(kStart), std::end(kStart));
    deg[0] += a1_deg;
    deg[1] += a2_deg;
    return deg;
  }
  static AxisAngles rad(const AxisAngles& deg) { return axes_of(deg, {}, WireAxes(6, false)); }
  bool find(const AxisAngles& actual_deg, const AxisAngles& setpoint_deg) {
    RobFrame frame = packet(actual_deg, setpoint_deg);
    frame.ipoc.value = 5000;
    return setpoint.find(frame, rad(actual_deg), TimePoint{1000s}, true);
  }
  std::vector<double> held() {
    const auto values = setpoint.hold();
    return {values.begin(), values.end()};
  }
  void come_back(double a1_deg) {
    OffsetMemory link;
    link.ipoc = 5000;
    link.step = 1;
    link.seconds_per_ipoc = 0.004;
    link.counts_packets = true;
    link.t_rx = TimePoint{1000s};
    link.actual_rad = rad(pose(a1_deg));
    setpoint.remember(link);
    setpoint.begin_session(0.1);
  }
  void SetUp() override {
    ASSERT_TRUE(find(pose(), pose()));
    const AxisAngles from = setpoint.commanded_rad();
    constexpr int kSteps = 2000;  // slower than any limit
    for (int i = 0; i <= kSteps; ++i) {
      const double u = static_cast<double>(i) / kSteps;
      for (std::size_t k = 0; k < from.size(); ++k)
        setpoint.commanded_rad()[k] = from[k] + u * u * (3 - 2 * u) * (rad(pose(2.0))[k] - from[k]);
      setpoint.next(0.004, false);
      ASSERT_FALSE(setpoint.beyond()) << i;
    }
    sent = held();
    ASSERT_EQ(sent.size(), 6u);
    ASSERT_GT(std::abs(sent[0]) + std::abs(sent[1]), 1.0);
  }

  RsiConfig config = space_config();
  RsiSetpoint setpoint{config};
  std::vector<double> sent;
};

TEST_F(SpaceSetpoint, AnArmThatStandsBesideWhatWasSentByLittleIsHeldByTheVeryFrameThatWasSent) {
  come_back(2.0);
  ASSERT_TRUE(find(pose(2.049), pose()));
  EXPECT_EQ(held(), sent);
}
TEST_F(SpaceSetpoint, FartherAsideTheControllerMayHoldAnother) {
  come_back(2.0);
  EXPECT_FALSE(find(pose(2.051), pose()));
  EXPECT_FALSE(setpoint.known());
  EXPECT_FALSE(setpoint.waits_for_rest());
}
TEST_F(SpaceSetpoint, OfASessionThatIsNotKnownToBeTheOneBeforeNothingIsTakenOver) {
  setpoint.begin_session(0.0);
  EXPECT_FALSE(find(pose(2.0), pose()));
  EXPECT_FALSE(setpoint.known());
}
TEST_F(SpaceSetpoint, FromAnotherStartTheSameDifferenceIsAnotherFrame) {
  come_back(2.0);
  EXPECT_FALSE(find(pose(2.0, 1.0), pose(0.0, 1.0)));
  EXPECT_FALSE(setpoint.known());
}
TEST_F(SpaceSetpoint, ASetpointThatHoldsTheCorrectionSaysNothingOfTheStart) {
  ASSERT_FALSE(setpoint.start_pose_moved(packet(pose(2.0), pose(2.0)), rad(pose(2.0)), true));
  come_back(2.0);
  ASSERT_FALSE(setpoint.start_pose_moved(packet(pose(2.0), pose(2.0)), rad(pose(2.0)), false));
  ASSERT_TRUE(find(pose(2.0), pose(2.0)));
  EXPECT_EQ(held(), sent);
}
TEST_F(SpaceSetpoint, AFreshSessionHoldsNoneAndCountsFromItsOwnStart) {
  setpoint.begin_session(0.0);
  ASSERT_TRUE(find(pose(0.0, 1.0), pose(0.0, 1.0)));
  for (const double value : held()) EXPECT_NEAR(value, 0.0, 1e-9);
}

TEST(RsiSpaceConfig, WhatCannotBeDrivenIsRefusedByName) {
  const auto complaint = [](const std::function<void(RsiConfig&)>& spoil) {
    return complaint_of(space_config(), spoil);
  };
  EXPECT_EQ(complaint([](RsiConfig&) {}), "");
  const std::pair<const char*, std::function<void(RsiConfig&)>> cases[] = {
      {"RELATIVE",
       [](RsiConfig& c) {
         c.mode = CorrectionMode::kRelative;
         c.hold_on = false;
       }},
      {"7 axes",
       [](RsiConfig& c) {
         c.limits.push_back(c.limits.front());
         c.correction_limit_deg.push_back(10.0);
       }},
      {"geometry", [](RsiConfig& c) { c.space.geometry = nullptr; }},
      {"cart_tag", [](RsiConfig& c) { c.space.tag = "R Korr"; }},
      {"correction_limit_mm", [](RsiConfig& c) { c.space.limit_mm = 0.0; }},
      {"correction_turn_limit_deg", [](RsiConfig& c) { c.space.turn_limit_deg = NAN; }},
  };
  for (const auto& [words, spoil] : cases)
    EXPECT_NE(complaint(spoil).find(words), std::string::npos) << complaint(spoil);
}

TEST(RsiSpaceCycle, DoesNotAllocate) {
  Rig rig(space_krc(), space_config());
  rig.make_ready();
  rig.guard.arm(kArm);
  rig.begin(MoveKind::kSearch, search_target(rig), 1.0, kArm);
  std::array<char, 2048> packet{};
  long before = 0, during = 0;
  int cycles = 0;
  for (; cycles < 600; ++cycles) {
    rig.now += 4ms;
    const std::string_view sent = rig.krc.tick(rig.now);
    const std::size_t size = sent.copy(packet.data(), packet.size());
    before = allocation_count();
    rig.core.on_tick(rig.now);
    const std::string_view reply = rig.core.on_datagram({packet.data(), size}, rig.now);
    const auto result = rig.core.next_result();
    during += allocation_count() - before;
    rig.krc.receive(std::string(reply));
    if (result) break;
  }
  EXPECT_GT(cycles, 250);
  EXPECT_EQ(during, 0);
}

}  // namespace
}  // namespace cellcal::drivers
