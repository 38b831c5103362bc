// Other simulators, as far as they differ from a controller: each peer is written for this test and
// reproduces one difference.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/drivers/kuka/rsi/foreign_packet.h"
#include "tests/drivers/kuka/rsi/rig.h"
#include "tests/drivers/kuka/wire/sen_frame.h"
#include "tests/drivers/said.h"

namespace cellcal::drivers {
namespace {

/// Differences of a peer from a KUKA controller.
struct Habits {
  double cycle_s = 0.004;
  unsigned first_ipoc = 0, ipoc_step = 1;
  double retry_s = 0.04;          ///< until it repeats an unanswered packet
  bool waits_for_reply = true;    ///< repeats the packet until it is answered
  bool capitals = true;           ///< TYPE=, and blanks before "/>"
  int fixed_decimals = -1;        ///< < 0: as few as the value needs, at least one, maybe "4e-06"
  bool setpoint = true;           ///< ASPos is sent ...
  bool setpoint_follows = false;  ///< ... and includes the correction
  bool delay = true;
  bool adds_up = false;     ///< takes corrections as increments
  std::string_view more{};  ///< unknown elements
};

class ForeignPeer {
 public:
  explicit ForeignPeer(Habits habits) : h(habits), ipoc(h.first_ipoc) { restart_adapter(); }

  void restart_adapter() { adapter = std::make_unique<RsiCore>(rig_config(), &guard); }
  /// Its program is restarted, with the arm at its fixed start.
  void restart() {
    ipoc = h.first_ipoc;
    actual_deg = start_deg;
  }
  /// Idle for a while.
  void pause(Duration duration) {
    for (const TimePoint end = now + duration; now < end; now += 1ms) core().on_tick(now);
  }

  void cycle() {
    const double wait_s = answered || !h.waits_for_reply ? h.cycle_s : h.retry_s;
    for (const TimePoint next =
             now + std::chrono::duration_cast<Duration>(std::chrono::duration<double>(wait_s));
         now < next; now = std::min(now + Duration(1ms), next))
      core().on_tick(now);
    core().on_tick(now);
    const std::string reply(core().on_datagram(packet(), now));
    const auto frame = read_sen(reply);
    answered = frame && frame->ipoc == std::to_string(ipoc);
    if (answered) {
      for (std::size_t i = 0; i < 6; ++i)
        actual_deg[i] = (h.adds_up ? actual_deg[i] : start_deg[i]) + frame->axes_deg[i];
    } else {
      ++unanswered;
    }
    if (answered || !h.waits_for_reply) ipoc += h.ipoc_step;
  }

  bool run_until(const std::function<bool()>& done, int cycles = 20000) {
    while (cycles-- > 0) {
      cycle();
      if (done()) return true;
    }
    return false;
  }
  bool make_ready() {
    run_until([&] { return core().core_state().cycle_s > 0.0; }, 100);
    core().rereference();
    return run_until([&] { return core().state().link == RobotLink::kReady; }, 200);
  }
  CoreResult move(MoveKind kind, double a1_deg, double cruise_s = 0.0, std::uint16_t arm_id = 0) {
    AxisAngles target = core().state().commanded_rad;
    target[0] += a1_deg * kDeg;
    core().begin({++last_id, kind, target, cruise_s, arm_id});
    std::optional<CoreResult> result;
    EXPECT_TRUE(run_until([&] { return (result = core().next_result()).has_value(); })) << words();
    return result.value_or(CoreResult{});
  }
  RsiCore& core() const { return *adapter; }
  std::string words() const { return said(core().state().words); }

  Habits h;
  ScriptedGuard guard;
  std::unique_ptr<RsiCore> adapter;
  unsigned ipoc;
  SixAngles start_deg{0, -90, 90, 0, 90, 0}, actual_deg = start_deg;
  int unanswered = 0;
  bool answered = true;

 private:
  std::string packet() const {
    ForeignPacket text{actual_deg, {}, {}, ipoc, h.capitals, h.fixed_decimals, h.more};
    if (h.setpoint) text.setpoint_deg = h.setpoint_follows ? actual_deg : start_deg;
    if (h.delay) text.delay = 0;
    return text_of(text);
  }

  TimePoint now{1000s};
  std::uint32_t last_id = 0;
};

/// The elements of a session: a transit, a search without contact, and the return.
void expect_moves(ForeignPeer& peer) {
  ASSERT_TRUE(peer.make_ready()) << peer.words();
  const CoreResult there = peer.move(MoveKind::kTransit, 2.0);
  EXPECT_EQ(there.outcome, MoveOutcome::kArrived) << words(there);
  EXPECT_NEAR(peer.actual_deg[0], 2.0, 1e-4);
  peer.guard.arm(7);
  const CoreResult search = peer.move(MoveKind::kSearch, 0.3, 1.0, 7);
  EXPECT_EQ(search.outcome, MoveOutcome::kArrived) << words(search);
  EXPECT_EQ(peer.move(MoveKind::kTransit, -2.3).outcome, MoveOutcome::kArrived);
  EXPECT_NEAR(peer.actual_deg[0], 0.0, 1e-4);
}

TEST(RsiForeignPeer, CountsPacketsFromZeroWaitsForRepliesAndPrintsAsFewDecimalsAsItNeeds) {
  ForeignPeer peer({.cycle_s = 0.0022});
  expect_moves(peer);
  EXPECT_EQ(peer.unanswered, 0);
}

TEST(RsiForeignPeer, WithoutSetpointItsFirstPacketIsAnsweredAtOnce) {
  // It repeats its first packet until it is answered; no other process can have answered.
  ForeignPeer peer({.cycle_s = 0.040, .setpoint = false});
  expect_moves(peer);
  EXPECT_EQ(peer.unanswered, 0);
}

TEST(RsiForeignPeer, WithoutSetpointMetInMidSessionIsNotAnsweredAndMovesAreRefused) {
  ForeignPeer peer({.first_ipoc = 900, .setpoint = false});
  EXPECT_FALSE(peer.make_ready());
  EXPECT_TRUE(has(peer.words(), "start it again")) << peer.words();
  EXPECT_EQ(peer.move(MoveKind::kTransit, 2.0).outcome, MoveOutcome::kRefused);
  EXPECT_EQ(peer.actual_deg, peer.start_deg);
}

TEST(RsiForeignPeer, StartedAnewAfterItsArmHasMovedIsAnsweredAgain) {
  // Rest is not observable if each packet waits for the answer to the preceding one.
  for (const double retry_s : {0.04, 1.0}) {
    ForeignPeer peer({.retry_s = retry_s});
    expect_moves(peer);
    EXPECT_EQ(peer.move(MoveKind::kTransit, 3.0).outcome, MoveOutcome::kArrived);
    peer.pause(1s);
    peer.restart();
    expect_moves(peer);
  }
}

TEST(RsiForeignPeer, HoldingACorrectionOfAnEarlierAdapterIsTakenOverWithoutAJump) {
  for (const double retry_s : {0.04, 1.0}) {
    ForeignPeer peer({.retry_s = retry_s});
    ASSERT_TRUE(peer.make_ready());
    EXPECT_EQ(peer.move(MoveKind::kTransit, 3.0).outcome, MoveOutcome::kArrived);
    peer.restart_adapter();
    ASSERT_TRUE(peer.make_ready()) << peer.words();
    EXPECT_NEAR(peer.actual_deg[0], 3.0, 1e-4);
    EXPECT_EQ(peer.move(MoveKind::kTransit, 1.0).outcome, MoveOutcome::kArrived);
    EXPECT_NEAR(peer.actual_deg[0], 4.0, 1e-4);
  }
}

TEST(RsiForeignPeer, WithoutSetpointAPauseOfItsDoesNotThrowTheArmBack) {
  ForeignPeer peer({.setpoint = false});
  ASSERT_TRUE(peer.make_ready());
  EXPECT_EQ(peer.move(MoveKind::kTransit, 3.0).outcome, MoveOutcome::kArrived);
  peer.pause(700ms);
  ASSERT_TRUE(peer.make_ready()) << peer.words();
  EXPECT_NEAR(peer.actual_deg[0], 3.0, 1e-4);
  EXPECT_EQ(peer.move(MoveKind::kTransit, -3.0).outcome, MoveOutcome::kArrived);
}

TEST(RsiForeignPeer, PausesAsProgramsDoAndIsNotLostByThat) {
  ForeignPeer peer({.cycle_s = 0.0022});
  ASSERT_TRUE(peer.make_ready());
  peer.pause(150ms);
  EXPECT_EQ(peer.core().state().link, RobotLink::kReady) << peer.words();
  peer.pause(100ms);
  EXPECT_EQ(peer.core().state().link, RobotLink::kLost);
}

TEST(RsiForeignPeer, CyclesAtTheEdgesOfTwoAndFortyMillisecondsAreTaken) {
  for (const double cycle_s : {0.00195, 0.002, 0.0401, 0.0405}) {
    ForeignPeer peer({.cycle_s = cycle_s, .waits_for_reply = false});
    expect_moves(peer);
  }
}

TEST(RsiForeignPeer, WithoutDelayAndWithElementsNobodyAskedFor) {
  ForeignPeer peer({.delay = false,
                    .more = "<GearTorque A1=\"0.0\" A2=\"0.0\" /><OvPro R=\"100.0\" />"
                            "<Tech C11=\"0\" /><DiL>0</DiL><EStr>what</EStr>"});
  expect_moves(peer);
}

TEST(RsiForeignPeer, SetpointThatHoldsTheCorrectionIsUnderstood) {
  ForeignPeer peer({.first_ipoc = 123456,
                    .ipoc_step = 4,
                    .waits_for_reply = false,
                    .capitals = false,
                    .fixed_decimals = 4,
                    .setpoint_follows = true});
  expect_moves(peer);
}

TEST(RsiForeignPeer, RoundingShowsWithTheFirstChangeAndStopsTheMove) {
  ForeignPeer peer({.fixed_decimals = 1});
  ASSERT_TRUE(peer.make_ready()) << "-90.0 may be exact: " << peer.words();
  const CoreResult result = peer.move(MoveKind::kTransit, 5.0);
  EXPECT_EQ(result.outcome, MoveOutcome::kNotFollowing);
  expect_cause(result.cause, cause::TooCoarse{1});
  EXPECT_LT(peer.actual_deg[0], 1.0) << "braked from the first change on";
  peer.core().rereference();
  EXPECT_FALSE(peer.run_until([&] { return peer.core().state().link == RobotLink::kReady; }, 500));
  EXPECT_TRUE(has(peer.words(), "Precision")) << peer.words();
}

TEST(RsiForeignPeer, CountsMillisecondsAndPrintsAsFewDecimalsAsItNeeds) {
  ForeignPeer peer({.first_ipoc = 123456, .ipoc_step = 4, .waits_for_reply = false});
  expect_moves(peer);
}

TEST(RsiForeignPeer, RoundingInAControllersTextIsRefusedBeforeAnythingMoves) {
  ForeignPeer peer({.first_ipoc = 123456, .ipoc_step = 4, .capitals = false, .fixed_decimals = 2});
  EXPECT_FALSE(peer.make_ready());
  EXPECT_TRUE(has(peer.words(), "Precision")) << peer.words();
}

TEST(RsiForeignPeer, TakingCorrectionsAsIncrementsIsNoticedAndTheArmIsHeld) {
  ForeignPeer peer({.adds_up = true});
  ASSERT_TRUE(peer.make_ready()) << peer.words();
  EXPECT_EQ(peer.move(MoveKind::kTransit, 5.0).outcome, MoveOutcome::kNotFollowing);
}

}  // namespace
}  // namespace cellcal::drivers
