// Peers that are paced by sleeping, count packets and wait for answers: treatment of their time and
// their silence.

#include <gtest/gtest.h>

#include <cmath>

#include "drivers/kuka/rsi/rsi_core.h"
#include "tests/drivers/kuka/rsi/rig.h"
#include "tests/drivers/kuka/rsi/sleepy_peer.h"
#include "tests/drivers/said.h"

namespace cellcal::drivers {
namespace {

constexpr Duration kStep = 250us;

class SleepyRig {
 public:
  explicit SleepyRig(const SleepyHabits& habits)
      : peer(habits, {0.0, -90 * kDeg, 90 * kDeg, 0.0, 90 * kDeg, 0.0}) {
    new_adapter();
  }

  void new_adapter() { core = std::make_unique<RsiCore>(rig_config(), &guard); }
  /// Without an adapter.
  void leave(Duration duration) {
    core.reset();
    run(duration);
  }

  void step() {
    now += kStep;
    const std::string packet = peer.tick(now);
    if (!core) return;
    core->on_tick(now + 40us);
    if (packet.empty() || deaf) return;
    const std::string reply(core->on_datagram(packet, now + 40us));
    if (!reply.empty()) peer.receive(reply, now + 80us);
  }
  void run(Duration duration) {
    for (const TimePoint end = now + duration; now < end;) step();
  }
  bool run_until(const std::function<bool()>& done, Duration limit) {
    for (const TimePoint end = now + limit; now < end;) {
      step();
      if (done()) return true;
    }
    return false;
  }
  /// As in a session: requested once, as soon as there are packets.
  bool make_ready() {
    const auto link = [&] { return core->state().link; };
    if (!run_until([&] { return link() == RobotLink::kNotReferenced; }, 3s)) return false;
    core->rereference();
    return run_until([&] { return link() == RobotLink::kReady || link() == RobotLink::kLost; },
                     5s) &&
           link() == RobotLink::kReady;
  }
  CoreResult move(MoveKind kind, double a1_deg, double cruise_s = 0.0, std::uint16_t arm_id = 0) {
    begin(kind, a1_deg, cruise_s, arm_id);
    return finish();
  }
  void begin(MoveKind kind, double a1_deg, double cruise_s = 0.0, std::uint16_t arm_id = 0) {
    AxisAngles target = core->state().commanded_rad;
    target[0] += a1_deg * kDeg;
    core->begin({++last_id, kind, target, cruise_s, arm_id});
  }
  CoreResult finish() {
    std::optional<CoreResult> result;
    EXPECT_TRUE(run_until([&] { return (result = core->next_result()).has_value(); }, 60s))
        << words();
    return result.value_or(CoreResult{});
  }
  std::string words() const { return said(core->state().words); }

  SleepyPeer peer;
  ScriptedGuard guard;
  std::unique_ptr<RsiCore> core;
  TimePoint now{1000s};
  bool deaf = false;
  std::uint32_t last_id = 0;
};

SleepyHabits habits(double sleep_s, unsigned ipoc_step = 1) {
  SleepyHabits h;
  h.sleep_s = sleep_s;
  h.ipoc_step = ipoc_step;
  return h;
}

/// One touch during a search at `speed_deg_s`; the latch's error [s], and its stated uncertainty.
struct Touch {
  double error_s = 0.0, sigma_s = 0.0;
};
Touch touch(SleepyRig& rig, double speed_deg_s, std::uint16_t arm) {
  rig.guard.arm(arm);
  rig.begin(MoveKind::kSearch, 3.0, 3.0 / speed_deg_s, arm);
  rig.run(1500ms);
  const TimePoint edge = rig.now + 110us;
  const double truth = rig.peer.actual_rad_at(edge)[0];
  rig.run(1ms);
  rig.guard.trip(arm, edge);
  rig.guard.push(ContactEventKind::kContact, arm, edge);
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kContact) << drivers::words(result);
  if (!result.latch) return {HUGE_VAL, 0.0};
  EXPECT_EQ(rig.move(MoveKind::kRetreat, -2.0).outcome, MoveOutcome::kArrived) << rig.words();
  return {(result.latch->contact_rad[0] - truth) / (speed_deg_s * kDeg),
          result.latch->time_sigma_s};
}

TEST(RsiSleepyPeer, ContactsAreLatchedWhereTheyWereHoweverItsPaceDrifts) {
  // With extrapolation by IPOC they were 20 to 100 ms off after a while, or outside the record.
  for (const auto& h : {habits(0.0025), habits(0.004), habits(0.004, 4), habits(0.012),
                        habits(0.025), habits(0.030)}) {
    SleepyRig rig(h);
    ASSERT_TRUE(rig.make_ready()) << h.sleep_s << ": " << rig.words();
    for (std::uint16_t k = 1; k <= 8; ++k) {
      const Touch one = touch(rig, 0.1, k);
      // Its arm does not move straight between two packets, and packets contain microdegrees.
      EXPECT_LT(std::abs(one.error_s), 0.45 * h.sleep_s + 1e-3) << h.sleep_s << " touch " << k;
      EXPECT_GT(one.sigma_s, 0.3 * h.sleep_s) << "between two packets nobody knows";
      EXPECT_LT(one.sigma_s, 2.0 * h.sleep_s);
    }
  }
}

TEST(RsiSleepyPeer, AnArmThatJumpsFromReplyToReplyIsWithinWhatTheLatchSaysOfItself) {
  for (const double sleep_s : {0.0025, 0.012, 0.030}) {
    SleepyHabits h = habits(sleep_s);
    h.lag_s = 0.0;
    SleepyRig rig(h);
    ASSERT_TRUE(rig.make_ready()) << rig.words();
    for (std::uint16_t k = 1; k <= 8; ++k) {
      const Touch one = touch(rig, 0.1, k);
      EXPECT_LT(std::abs(one.error_s), 2.0 * one.sigma_s) << sleep_s << " touch " << k;
    }
  }
}

TEST(RsiSleepyPeer, TheCycleFollowsItsPace) {
  SleepyHabits h = habits(0.010);
  h.drift = 0.4;
  SleepyRig rig(h);
  ASSERT_TRUE(rig.make_ready()) << rig.words();
  double least = HUGE_VAL, most = 0.0, worst_step = 0.0, last = rig.core->state().cycle_s;
  rig.run_until(
      [&] {
        const double cycle_s = rig.core->state().cycle_s;
        least = std::min(least, cycle_s);
        most = std::max(most, cycle_s);
        worst_step = std::max(worst_step, std::abs(cycle_s - last) / last);
        last = cycle_s;
        return false;
      },
      20s);
  EXPECT_LT(least, 0.009);
  EXPECT_GT(most, 0.013);
  EXPECT_LT(worst_step, 0.011) << "no step in a move's speed";
}

TEST(RsiSleepyPeer, ASecondSessionFindsTheCorrectionThatItHolds) {
  // The unanswered packet is repeated after a second, and the arm is not at its start.
  for (const bool counts_on : {false, true}) {
    SleepyHabits h = habits(0.004);
    h.counts_on = counts_on;
    SleepyRig rig(h);
    for (int session = 0; session < 3; ++session) {
      const double largest = rig.peer.largest_step_rad();
      ASSERT_TRUE(rig.make_ready()) << session << ": " << rig.words();
      EXPECT_LE(rig.peer.largest_step_rad(), std::max(largest, 1e-6)) << "no jump";
      EXPECT_EQ(rig.move(MoveKind::kTransit, 3.0).outcome, MoveOutcome::kArrived) << rig.words();
      EXPECT_NEAR(rig.peer.held_rad(0), 3.0 * (session + 1) * kDeg, 1e-6);
      rig.core->close();
      rig.run(500ms);
      rig.leave(1700ms);
      rig.new_adapter();
    }
  }
}

TEST(RsiSleepyPeer, ItsSilenceWhileNobodyAnswersDoesNotSayThatItHasJustBegun) {
  // No ASPos, and Delay counts seconds: the correction cannot be determined, and zero would be a
  // jump.
  SleepyHabits h = habits(0.004);
  h.setpoint = false;
  SleepyRig rig(h);
  ASSERT_TRUE(rig.make_ready()) << "from IPOC 0 on it holds nothing: " << rig.words();
  ASSERT_EQ(rig.move(MoveKind::kTransit, 3.0).outcome, MoveOutcome::kArrived);
  rig.leave(1300ms);
  const std::uint64_t replies = rig.peer.replies();
  rig.new_adapter();
  EXPECT_FALSE(rig.make_ready());
  EXPECT_EQ(rig.peer.replies(), replies);
  EXPECT_NEAR(rig.peer.held_rad(0), 3.0 * kDeg, 1e-6) << "the arm stays";
  EXPECT_NE(rig.words().find("start it again"), std::string::npos) << rig.words();
}

TEST(RsiSleepyPeer, ThisComputersOwnPauseIsNotItsSilence) {
  // This thread was delayed by 0.4 s during the move; the peer and its arm waited meanwhile.
  SleepyRig rig(habits(0.004));
  ASSERT_TRUE(rig.make_ready()) << rig.words();
  rig.begin(MoveKind::kTransit, 5.0);
  rig.run(200ms);
  const std::unique_ptr<RsiCore> held_up = std::move(rig.core);
  std::string packet;
  while (packet.empty()) packet = rig.peer.tick(rig.now += kStep);
  rig.now += 400ms;
  rig.peer.receive(held_up->on_datagram(packet, rig.now), rig.now);
  EXPECT_EQ(held_up->state().link, RobotLink::kReady) << held_up->state().words;
  EXPECT_TRUE(held_up->state().moving);
}

TEST(RsiSleepyPeer, WhileThisThreadIsHeldUpNothingIsItsSilenceAndAfterwardsItIsAgain) {
  SleepyRig rig(habits(0.004));
  ASSERT_TRUE(rig.make_ready()) << rig.words();
  // Called every 30 ms, with a packet not read meanwhile: undecided.
  const auto tick_on = [&](Duration each, Duration whole) {
    for (const TimePoint end = rig.now + whole; rig.now < end;) rig.core->on_tick(rig.now += each);
    return rig.core->core_state().link;
  };
  EXPECT_EQ(tick_on(30ms, 1s), RobotLink::kReady);
  const std::uint64_t heard = rig.core->core_state().packets;
  ASSERT_TRUE(rig.run_until([&] { return rig.core->core_state().packets > heard; }, 3s));
  rig.run(100ms);
  EXPECT_EQ(rig.core->core_state().link, RobotLink::kReady) << rig.words();
  // Called as often as required: the peer is silent, regardless of earlier events.
  EXPECT_EQ(tick_on(15ms, 180ms), RobotLink::kReady);
  EXPECT_EQ(tick_on(15ms, 60ms), RobotLink::kLost);
}

TEST(RsiSleepyPeer, ThatIsNotAnsweredMayBeSilentForTwoAndAHalfSeconds) {
  SleepyHabits h = habits(0.004);
  h.setpoint = false;
  SleepyRig rig(h);
  ASSERT_TRUE(rig.make_ready()) << rig.words();
  ASSERT_EQ(rig.move(MoveKind::kTransit, 3.0).outcome, MoveOutcome::kArrived);
  rig.new_adapter();
  const auto link = [&] { return rig.core->core_state().link; };
  ASSERT_TRUE(rig.run_until([&] { return link() == RobotLink::kNotReferenced; }, 3s));
  rig.deaf = true;
  rig.run(2400ms);
  EXPECT_EQ(link(), RobotLink::kNotReferenced);
  rig.run(200ms);
  EXPECT_EQ(link(), RobotLink::kLost);
}

TEST(RsiSleepyPeer, ThatFallsSilentInAMoveIsLost) {
  SleepyRig rig(habits(0.004));
  ASSERT_TRUE(rig.make_ready()) << rig.words();
  rig.begin(MoveKind::kTransit, 20.0);
  rig.run(200ms);
  rig.deaf = true;
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kRobotSilent);
}

TEST(RsiLink, RepliesThatWereNeverGivenWereNotLate) {
  // A session of another adapter, without ASPos: it is received and not answered, and Delay counts.
  sim::ControllerConfig krc;
  krc.send_setpoint = false;
  Rig rig(krc);
  rig.krc.rsi_on();
  rig.run(200ms);
  EXPECT_GT(rig.krc.late(), 25U);
  EXPECT_EQ(rig.core.state().quality.replies, 0U);
  EXPECT_EQ(rig.core.state().late, 0U);
  const std::string words = said(rig.core.state().words);
  EXPECT_EQ(words.find("replies late"), std::string::npos) << words;
  EXPECT_NE(words.find("not answering"), std::string::npos) << words;
}

TEST(RsiLink, ANetworkThatBecameSlowerMovesNoContactAndShowsInItsSigma) {
  Rig rig;
  rig.make_ready();
  rig.guard.arm(kArm);
  rig.begin(MoveKind::kSearch, rig.moved_by(0, 2.0), 10.0, kArm);
  rig.run(2s);
  rig.network_delay = [] { return Duration(7ms); };
  rig.run(800ms);
  const TimePoint edge = rig.now + 1500us;
  const double truth = rig.krc.actual_rad_at(edge)[0];
  rig.guard.trip(kArm, edge);
  rig.guard.push(ContactEventKind::kContact, kArm, edge);
  const CoreResult result = rig.finish();
  ASSERT_EQ(result.outcome, MoveOutcome::kContact) << drivers::words(result);
  EXPECT_NEAR(result.latch->contact_rad[0], truth, 1.5e-4 * kDeg);
  EXPECT_NEAR(result.latch->time_sigma_s, 6.9e-3, 1e-4);
}

TEST(RsiLink, CycleLearntWhileThisComputerStalledIsTheControllersOwn) {
  // Regression: some of the first packets came late, in a burst: 5 ms were taken for the cycle, for
  // the whole session, and contacts were located outside the record.
  Rig rig;
  int n = 0;
  constexpr int kFirst = 16, kLast = 32;
  rig.network_delay = [&] {
    ++n;
    if (n < kFirst || n > kLast) return Duration(100us);
    return Duration((kLast - n) * 4ms + (n - kFirst) * 100us);
  };
  rig.krc.rsi_on();
  rig.run(500ms);
  EXPECT_EQ(rig.core.state().cycle_s, 0.004);
}

}  // namespace
}  // namespace cellcal::drivers
