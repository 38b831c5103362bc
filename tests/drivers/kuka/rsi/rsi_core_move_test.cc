#include <algorithm>
#include <limits>

#include "drivers/error.h"
#include "tests/drivers/kuka/rsi/rig.h"

namespace cellcal::drivers {
namespace {

// The six transmitted decimals of a degree.
constexpr double kWire = 1e-6 * kDeg;

TEST(RsiMove, ArrivesWhereItWasCommandedToBeforeTheArmsLastThousandths) {
  Rig rig;
  rig.make_ready();
  AxisAngles target = rig.commanded();
  for (std::size_t i = 0; i < 6; ++i) target[i] += (i % 2 == 0 ? 7.0 : -4.0) * kDeg;
  const CoreResult result = rig.move(MoveKind::kTransit, target);
  EXPECT_EQ(result.outcome, MoveOutcome::kArrived) << words(result);
  EXPECT_TRUE(is<cause::None>(result.cause)) << words(result);
  EXPECT_EQ(result.at_rad, target);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_NEAR(rig.krc.setpoint_rad()[i], target[i], 2e-4 * kDeg);
    EXPECT_NEAR(rig.krc.actual_rad_at(rig.now)[i], target[i], 5e-3 * kDeg);
  }
  EXPECT_EQ(rig.krc.late_ever(), 0U);
  EXPECT_FALSE(rig.core.state().moving);
}

TEST(RsiMove, TheEndOfASearchIsRest) {
  Rig rig;
  rig.make_ready();
  AxisAngles target = rig.commanded();
  for (std::size_t i = 0; i < 6; ++i) target[i] += (i % 2 == 0 ? 0.7 : -0.4) * kDeg;
  rig.guard.arm(7);
  const CoreResult result = rig.move(MoveKind::kSearch, target, 1.0, 7);
  EXPECT_EQ(result.outcome, MoveOutcome::kArrived) << words(result);
  for (std::size_t i = 0; i < 6; ++i)
    EXPECT_NEAR(rig.krc.actual_rad_at(rig.now)[i], target[i], 1e-3 * kDeg);
}

TEST(RsiMove, EachCyclesStepKeepsTheAxisSpeed) {
  const RsiConfig config = rig_config();
  Rig rig({}, config);
  rig.make_ready();
  std::vector<double> before = rig.krc.setpoint_rad();
  double fastest = 0.0;
  rig.after_cycle = [&] {
    const std::vector<double> now = rig.krc.setpoint_rad();
    for (std::size_t i = 0; i < 6; ++i) {
      fastest = std::max(fastest, std::abs(now[i] - before[i]) / 0.004);
    }
    before = now;
  };
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 60)).outcome, MoveOutcome::kArrived);
  EXPECT_LE(fastest, 100 * kDeg);
  EXPECT_GE(fastest, 99.99 * kDeg);
}

// The controller's own limits are the axis limits: transmission rounding must not exceed them.
TEST(RsiMove, AtFullSpeedTheControllerFindsNoAxisTooFast) {
  for (const CorrectionMode mode : {CorrectionMode::kAbsolute, CorrectionMode::kRelative}) {
    for (const int decimals : {4, 6}) {
      RsiConfig config = rig_config();
      config.mode = mode;
      config.hold_on = mode == CorrectionMode::kAbsolute;
      config.decimals = decimals;
      sim::ControllerConfig krc;
      krc.hold_on = config.hold_on;
      krc.mode = config.hold_on ? sim::RsiMode::kAbsolute : sim::RsiMode::kRelative;
      const double speeds_deg_s[] = {154.0, 153.7, 228.1, 343.33, 384.0, 721.9};
      for (std::size_t i = 0; i < 6; ++i) {
        config.limits[i].max_speed_rad_s = speeds_deg_s[i] * kDeg;
        krc.max_speed_rad_s.push_back(config.limits[i].max_speed_rad_s);
      }
      Rig rig(krc, config);
      rig.make_ready();
      for (const std::size_t axis : {0, 2, 3, 4, 5}) {
        for (const double deg : {77.7, -77.7}) {
          const CoreResult result = rig.move(MoveKind::kTransit, rig.moved_by(axis, deg));
          ASSERT_EQ(result.outcome, MoveOutcome::kArrived)
              << words(result) << " pendant: " << rig.krc.message();
        }
      }
      EXPECT_EQ(rig.krc.phase(), sim::RsiPhase::kRunning) << rig.krc.message();
    }
  }
}

TEST(RsiMove, BelowTheControllersOwnLimitsSpeedsAreWhatTheyAreSetTo) {
  RsiConfig config = rig_config();
  config.full_speed_rad_s.assign(6, 200 * kDeg);
  EXPECT_EQ(limits_within_wire(config)[0].max_speed_rad_s, 100 * kDeg);
  config.full_speed_rad_s[3] = 100 * kDeg;
  EXPECT_LT(limits_within_wire(config)[3].max_speed_rad_s, 100 * kDeg);
  EXPECT_GT(limits_within_wire(config)[3].max_speed_rad_s, 99.99 * kDeg);
  config.full_speed_rad_s.pop_back();
  EXPECT_THROW(RsiCore(config, nullptr), ConfigError);
}

TEST(RsiMove, ThroughWayPointsNoReplyExceedsAnyLimitWhereverItEnds) {
  for (int stop_after_ms = 0; stop_after_ms < 1400; stop_after_ms += 36) {
    Rig rig;
    rig.make_ready();
    Move move{++rig.last_id, MoveKind::kTransit, rig.commanded(), 0.0, 0};
    AxisAngles at = rig.commanded();
    for (const double deg : {12.0, -9.0, 7.0}) {
      at[0] += 15 * kDeg;
      at[1] -= deg * kDeg;
      at[3] += 2 * deg * kDeg;
      move.via.push_back({at, 0.5, 0.5});
    }
    at[0] -= 5 * kDeg;
    move.target_rad = at;
    std::vector<std::vector<double>> seen{rig.krc.setpoint_rad()};
    rig.after_cycle = [&] { seen.push_back(rig.krc.setpoint_rad()); };
    rig.core.begin(move);
    rig.run(std::chrono::milliseconds(stop_after_ms));
    if (stop_after_ms > 0) rig.core.stop();
    const CoreResult result = rig.finish();
    EXPECT_TRUE(result.outcome == MoveOutcome::kStopped || result.outcome == MoveOutcome::kArrived)
        << words(result);
    EXPECT_TRUE(result.at_rad == move.target_rad || result.outcome == MoveOutcome::kStopped);
    constexpr double kCycle = 0.004;
    for (std::size_t k = 3; k < seen.size(); ++k) {
      for (std::size_t i = 0; i < 6; ++i) {
        const double speed = (seen[k][i] - seen[k - 1][i]) / kCycle;
        const double change =
            (seen[k][i] - 2 * seen[k - 1][i] + seen[k - 2][i]) / (kCycle * kCycle);
        ASSERT_LE(std::abs(speed), 100 * kDeg) << stop_after_ms << " A" << i + 1;
        // Up to probing speed a stop is a freeze.
        const double freeze = speed == 0.0 ? 0.035 / kCycle : 0.0;
        ASSERT_LE(std::abs(change), 400 * kDeg + 4 * kWire / (kCycle * kCycle) + freeze)
            << stop_after_ms << " A" << i + 1;
      }
    }
  }
}

TEST(RsiMove, NoReplyExceedsTheAccelerationOfAnyAxisWhateverEndsTheMove) {
  for (const int ending : {0, 1, 2, 3}) {
    Rig rig;
    rig.make_ready();
    AxisAngles target = rig.commanded();
    target[0] += 50 * kDeg;
    target[1] -= 20 * kDeg;
    target[4] += 5 * kDeg;
    std::vector<std::vector<double>> at{rig.krc.setpoint_rad()};
    rig.after_cycle = [&] { at.push_back(rig.krc.setpoint_rad()); };
    rig.begin(MoveKind::kTransit, target);
    rig.run(350ms);
    if (ending == 1) rig.core.stop();
    if (ending == 2) rig.guard.touch(true);
    if (ending == 3) rig.core.close();
    rig.finish();
    for (std::size_t k = 2; k < at.size(); ++k) {
      for (std::size_t i = 0; i < 6; ++i) {
        const double speed = (at[k][i] - at[k - 1][i]) / 0.004;
        const double change = (at[k][i] - 2 * at[k - 1][i] + at[k - 2][i]) / (0.004 * 0.004);
        ASSERT_LE(std::abs(speed), 100 * kDeg) << ending << " A" << i + 1;
        ASSERT_LE(std::abs(change), 400 * kDeg + 4 * kWire / (0.004 * 0.004))
            << ending << " A" << i + 1;
      }
    }
  }
}

TEST(RsiMove, RepliesDoNotDependOnWhereTheArmIsSeenToBe) {
  const auto replies = [](double lag_s, double noise_deg) {
    sim::ControllerConfig krc;
    krc.lag_s = lag_s;
    krc.noise_sigma_deg = noise_deg;
    Rig rig(krc);
    rig.make_ready();
    rig.begin(MoveKind::kTransit, rig.moved_by(0, 20));
    std::vector<double> corrections;
    for (int i = 0; i < 100; ++i) {
      rig.cycle();
      corrections.push_back(rig.krc.correction_deg()[0]);
    }
    return corrections;
  };
  const std::vector<double> steady = replies(0.01, 0.0), noisy = replies(0.04, 0.002);
  for (std::size_t i = 0; i < steady.size(); ++i) EXPECT_NEAR(steady[i], noisy[i], 2e-6) << i;
}

TEST(RsiMove, CruiseTimeIsKept) {
  Rig rig;
  rig.make_ready();
  const TimePoint begun = rig.now;
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(5, 1.0), 3.0).outcome, MoveOutcome::kArrived);
  const double took_s = std::chrono::duration<double>(rig.now - begun).count();
  EXPECT_GT(took_s, 3.0);
  EXPECT_LT(took_s, 3.5);
}

TEST(RsiMove, SettlesInSpiteOfEncoderNoise) {
  sim::ControllerConfig krc;
  krc.noise_sigma_deg = 0.0005;
  Rig rig(krc);
  rig.make_ready();
  const CoreResult result = rig.move(MoveKind::kTransit, rig.moved_by(1, -10));
  EXPECT_EQ(result.outcome, MoveOutcome::kArrived);
  EXPECT_TRUE(is<cause::None>(result.cause)) << words(result);
}

TEST(RsiMove, WorksAtTwelveMilliseconds) {
  sim::ControllerConfig krc;
  krc.cycle_ms = 12;
  Rig rig(krc);
  krc.lag_s = 0.04;
  rig.krc.rsi_on();
  rig.run(1s);
  rig.core.rereference();
  rig.run(1s);
  ASSERT_EQ(rig.core.state().link, RobotLink::kReady);
  EXPECT_EQ(rig.core.state().cycle_s, 0.012);
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(2, 12)).outcome, MoveOutcome::kArrived);
}

TEST(RsiMove, TargetBeyondAnAxisLimitIsRefusedWithAxisValueAndLimit) {
  Rig rig;
  rig.make_ready();
  AxisAngles target = rig.commanded();
  target[1] = 66 * kDeg;
  const std::vector<double> before = rig.krc.setpoint_rad();
  const CoreResult result = rig.move(MoveKind::kTransit, target);
  EXPECT_EQ(result.outcome, MoveOutcome::kRefused);
  expect_cause(result.cause, cause::AboveLimit{1, 66.0, 65.0});
  rig.run(200ms);
  EXPECT_EQ(rig.krc.setpoint_rad(), before);
}

TEST(RsiMove, CorrectionBeyondItsLimitIsRefusedWithAxisValueAndLimit) {
  RsiConfig config = rig_config();
  config.correction_limit_deg[3] = 5.0;
  Rig rig({}, config);
  rig.make_ready();
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(3, 4.9)).outcome, MoveOutcome::kArrived);
  const CoreResult result = rig.move(MoveKind::kTransit, rig.moved_by(3, 0.2));
  EXPECT_EQ(result.outcome, MoveOutcome::kRefused) << "corrections add up over a session";
  expect_cause(result.cause, cause::CorrectionLimit{3, 5.1, 5.0}, 5e-5);
  // A reference does not change what the controller holds, nor the limit.
  rig.core.rereference();
  rig.run(500ms);
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(3, 0.2)).outcome, MoveOutcome::kRefused);
}

TEST(RsiMove, NonsenseIsRefused) {
  Rig rig;
  rig.make_ready();
  AxisAngles target = rig.commanded();
  target[4] = std::numeric_limits<double>::quiet_NaN();
  expect_cause(rig.move(MoveKind::kTransit, target).cause, cause::NotFinite{4, target[4]});
  target[4] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(rig.move(MoveKind::kTransit, target).outcome, MoveOutcome::kRefused);
  expect_cause(rig.move(MoveKind::kTransit, {0.0, 0.0}).cause, cause::AxisCount{2, 6});
  expect_cause(rig.move(MoveKind::kTransit, rig.commanded(), -1.0).cause, cause::BadCruise{-1.0});
}

TEST(RsiMove, AShareOfTheSpeedThatIsNoneIsRefused) {
  Rig rig;
  rig.make_ready();
  for (const double share : {0.0, -0.5, 1.01, std::numeric_limits<double>::infinity()}) {
    Move move{++rig.last_id, MoveKind::kTransit, rig.moved_by(0, 10), 0.0, 0};
    move.speed_share = share;
    rig.core.begin(move);
    expect_cause(rig.finish().cause, cause::BadShare{share, 1.0});
  }
}

TEST(RsiMove, OneAtATime) {
  Rig rig;
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 10));
  rig.run(50ms);
  rig.core.begin({77, MoveKind::kTransit, rig.commanded(), 0.0, 0});
  const auto refused = rig.core.next_result();
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->id, 77U);
  EXPECT_EQ(refused->outcome, MoveOutcome::kRefused);
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kArrived) << "the first one goes on";
}

TEST(RsiMove, StopAtSpeedBrakesOnTheLineWithinTheLimits) {
  Rig rig;
  rig.make_ready();
  const AxisAngles from = rig.commanded();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 60));
  rig.run(400ms);
  std::vector<double> setpoints{rig.krc.setpoint_rad()[0]};
  rig.after_cycle = [&] { setpoints.push_back(rig.krc.setpoint_rad()[0]); };
  rig.core.stop();
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kStopped);
  EXPECT_GT(result.at_rad[0] - from[0], 10 * kDeg);
  EXPECT_LT(result.at_rad[0] - from[0], 59 * kDeg);
  for (std::size_t i = 2; i < setpoints.size(); ++i) {
    const double change = setpoints[i] - 2 * setpoints[i - 1] + setpoints[i - 2];
    EXPECT_LE(std::abs(change) / (0.004 * 0.004), 400 * kDeg + 4 * kWire / (0.004 * 0.004));
  }
  EXPECT_NEAR(result.at_rad[0], rig.krc.setpoint_rad()[0], 2e-4 * kDeg);
}

TEST(RsiMove, StopAtProbingSpeedFreezesInTheNextReply) {
  Rig rig;
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 5), 5.0);  // 1 deg/s
  rig.run(1s);
  const AxisAngles before = rig.commanded();
  rig.core.stop();
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kStopped);
  EXPECT_EQ(result.at_rad, before);
}

TEST(RsiMove, StopBeforeTheFirstCycleMovesNothing) {
  Rig rig;
  rig.make_ready();
  const AxisAngles before = rig.commanded();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 5));
  rig.core.stop();
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kStopped);
  EXPECT_EQ(rig.commanded(), before);
}

TEST(RsiMove, ArmThatDoesNotFollowIsHeldAndNamed) {
  Rig rig;
  rig.make_ready();
  rig.krc.block_drives(true);
  const CoreResult result = rig.move(MoveKind::kTransit, rig.moved_by(2, 30), 10.0);
  EXPECT_EQ(result.outcome, MoveOutcome::kNotFollowing);
  ASSERT_TRUE(is<cause::AxisStands>(result.cause)) << words(result);
  EXPECT_EQ(std::get<cause::AxisStands>(result.cause).axis, 2);
  EXPECT_LT(std::abs(rig.krc.correction_deg()[2]), 1.5) << "3 deg/s, held within half a second";
  EXPECT_EQ(rig.core.state().link, RobotLink::kNotReferenced);
  const std::vector<double> held = rig.krc.correction_deg();
  rig.run(500ms);
  EXPECT_EQ(rig.krc.correction_deg(), held);
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(2, 1)).outcome, MoveOutcome::kRefused);
}

TEST(RsiMove, SilentClampOfTheControllerIsNoticedWithinATenthOfASecond) {
  for (const double lag_s : {0.01, 0.02, 0.04}) {
    for (const double speed_deg_s : {0.2, 1.0, 20.0}) {
      sim::ControllerConfig krc;
      krc.clamp_deg = 5.0;
      krc.noise_sigma_deg = 0.0003;
      Rig rig(krc);
      rig.make_ready();
      ASSERT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 4.5)).outcome, MoveOutcome::kArrived);
      rig.begin(MoveKind::kTransit, rig.moved_by(0, 8.0), 8.0 / speed_deg_s);
      const bool at_limit = rig.run_until([&] { return rig.krc.correction_deg()[0] >= 5.0; }, 10s);
      ASSERT_TRUE(at_limit) << speed_deg_s;
      const TimePoint clamped = rig.now;
      const AxisAngles before = rig.commanded();
      TimePoint last_step = rig.now;
      AxisAngles commanded = before;
      rig.after_cycle = [&] {
        if (rig.commanded() != commanded) last_step = rig.now;
        commanded = rig.commanded();
      };
      const CoreResult result = rig.finish();
      EXPECT_EQ(result.outcome, MoveOutcome::kNotFollowing) << speed_deg_s;
      ASSERT_TRUE(is<cause::AxisStands>(result.cause)) << words(result);
      EXPECT_EQ(std::get<cause::AxisStands>(result.cause).axis, 0);
      // Above probing speed the brake adds its time.
      if (speed_deg_s < 2.0) {
        EXPECT_LE(last_step - clamped, 100ms) << lag_s << " " << speed_deg_s;
      }
    }
  }
}

TEST(RsiMove, LongestUsualLagIsNotMistakenForAnArmThatDoesNotFollow) {
  sim::ControllerConfig krc;
  krc.lag_s = 0.04;
  krc.noise_sigma_deg = 0.0005;
  Rig rig(krc);
  rig.make_ready();
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 80)).outcome, MoveOutcome::kArrived);
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, -80)).outcome, MoveOutcome::kArrived);
}

TEST(RsiMove, RepliesThatAreNotHeardAnyMoreAreNamedAndNotTheArmThatStaysBehind) {
  Rig rig;
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 30));
  rig.run(300ms);
  rig.to_krc = false;
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kRobotSilent) << words(result);
  EXPECT_TRUE(is<cause::LateReplies>(result.cause)) << words(result);
}

TEST(RsiMove, RepliesThatAreHeardAgainDoNotThrowTheArmAhead) {
  for (const int unheard : {1, 2, 4, 20, 80}) {
    for (const bool search : {false, true}) {
      Rig rig;
      rig.make_ready();
      rig.guard.arm(7);
      rig.begin(search ? MoveKind::kSearch : MoveKind::kTransit, rig.moved_by(0, 60), 0.0, 7);
      rig.run(400ms);  // at full speed
      double largest = 0.0, step = 100 * kDeg * 0.004, taken_up = 0.0;
      std::vector<double> before = rig.krc.setpoint_rad();
      rig.after_cycle = [&] {
        const double last = step;
        step = std::abs(rig.krc.setpoint_rad()[0] - before[0]);
        largest = std::max(largest, step);
        taken_up = std::max(taken_up, step - last);
        before = rig.krc.setpoint_rad();
      };
      rig.to_krc = false;
      for (int i = 0; i < unheard; ++i) rig.cycle();
      rig.to_krc = true;
      const CoreResult result = rig.finish();
      EXPECT_EQ(result.outcome, unheard < 3 ? MoveOutcome::kArrived : MoveOutcome::kRobotSilent)
          << words(result);
      rig.run(8ms);
      EXPECT_LE(largest, 100 * kDeg * 0.004 + 2 * kWire) << unheard;
      EXPECT_LE(taken_up, 400 * kDeg * 0.004 * 0.004 + 2 * kWire) << unheard;
      EXPECT_NEAR(result.at_rad[0], rig.krc.setpoint_rad()[0], 2e-4 * kDeg);
    }
  }
}

TEST(RsiMove, ThatWasStoppedForLateRepliesTakesNoStepWhenTheyAreHeardAgain) {
  for (const int unheard : {4, 20, 80}) {
    Rig rig;
    rig.make_ready();
    rig.begin(MoveKind::kTransit, rig.moved_by(0, 60));
    rig.run(400ms);  // at full speed
    rig.to_krc = false;
    for (int i = 0; i < unheard; ++i) rig.cycle();
    const double stopped_rad = rig.krc.setpoint_rad()[0];
    rig.to_krc = true;
    EXPECT_EQ(rig.finish().outcome, MoveOutcome::kRobotSilent);
    rig.run(200ms);
    EXPECT_NEAR(rig.krc.setpoint_rad()[0], stopped_rad, 2 * kWire) << unheard;
    EXPECT_NEAR(rig.core.state().commanded_rad[0], stopped_rad, 2 * kWire) << unheard;
    EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 1)).outcome, MoveOutcome::kArrived);
  }
}

TEST(RsiMove, ThatWasStoppedWherePacketsAreLostDoesNotTurnBack) {
  Rig rig;
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 60));
  rig.run(400ms);
  double least = 0.0;
  std::vector<double> before = rig.krc.setpoint_rad();
  rig.after_cycle = [&] {
    least = std::min(least, rig.krc.setpoint_rad()[0] - before[0]);
    before = rig.krc.setpoint_rad();
  };
  for (int i = 0; i < 60; ++i) {  // every second packet of the controller
    rig.to_pc = i % 2 == 0;
    rig.cycle();
  }
  rig.to_pc = true;
  rig.run(200ms);
  EXPECT_GT(least, -2 * kWire);
}

TEST(RsiMove, ThatWasStoppedAfterADamagedDelayDoesNotTurnBack) {
  Rig rig;
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 60));
  rig.run(400ms);
  double least = 0.0;
  std::vector<double> before = rig.krc.setpoint_rad();
  rig.after_cycle = [&] {
    least = std::min(least, rig.krc.setpoint_rad()[0] - before[0]);
    before = rig.krc.setpoint_rad();
  };
  rig.to_krc = false;
  rig.cycle();
  rig.before_core = [&] {
    rig.packet.insert(rig.packet.find('"', rig.packet.find("<Delay")) + 1, "x");
  };
  rig.to_krc = true;
  rig.cycle();  // this reply is accepted, and the next Delay counts the one before it
  rig.before_core = nullptr;
  rig.to_krc = false;
  rig.cycle();
  rig.cycle();
  rig.to_krc = true;
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kRobotSilent);
  EXPECT_GT(least, -2 * kWire);
}

TEST(RsiMove, EndsWhereTheSamePacketComesOverAndOver) {
  Rig rig;
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 40));
  rig.run(300ms);
  const auto repeat = [&] {
    const TimePoint end = rig.now + 500ms;
    std::optional<CoreResult> result;
    while (rig.now < end && !result) {
      rig.now += 4ms;
      rig.core.on_datagram(rig.packet, rig.now);
      rig.core.on_tick(rig.now);
      result = rig.core.next_result();
    }
    return result;
  };
  const auto moving = repeat();
  ASSERT_TRUE(moving) << "the arm is not known to move on";
  EXPECT_EQ(moving->outcome, MoveOutcome::kRobotSilent);
  EXPECT_NE(rig.core.state().link, RobotLink::kReady);
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 1)).outcome, MoveOutcome::kRefused);
  rig.core.rereference();
  ASSERT_TRUE(rig.run_until([&] { return rig.core.state().link == RobotLink::kReady; }, 2s))
      << rig.core.state().words;
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 1));
  const auto waiting = repeat();
  ASSERT_TRUE(waiting) << "one that has not begun has a result, too";
  EXPECT_EQ(waiting->outcome, MoveOutcome::kRefused);
}

TEST(RsiMove, MissedPacketsAreNeverCaughtUp) {
  RsiConfig config = rig_config();
  config.silence_cycles = 6;
  Rig rig({}, config);
  rig.make_ready();
  std::vector<double> before = rig.krc.setpoint_rad();
  double largest = 0.0;
  int cycle = 0;
  rig.after_cycle = [&] {
    largest = std::max(largest, std::abs(rig.krc.setpoint_rad()[0] - before[0]));
    before = rig.krc.setpoint_rad();
    // Every thirtieth packet, and the one after it, does not reach the PC.
    rig.to_pc = ++cycle % 30 > 1;
  };
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 30));
  const CoreResult result = rig.finish();
  // Two late replies at a time soon end the move; until then no step is doubled.
  EXPECT_EQ(result.outcome, MoveOutcome::kRobotSilent) << words(result);
  EXPECT_TRUE(is<cause::LateReplies>(result.cause)) << words(result);
  EXPECT_LE(largest, 100 * kDeg * 0.004 + 2 * kWire);
  EXPECT_EQ(rig.core.state().link, RobotLink::kReady);
}

}  // namespace
}  // namespace cellcal::drivers
