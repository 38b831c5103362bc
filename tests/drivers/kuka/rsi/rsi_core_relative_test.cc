// RSI_ON(#RELATIVE), HOLDON=0: increments instead of corrections.

#include <algorithm>

#include "drivers/kuka/rsi/rsi_setpoint.h"
#include "tests/drivers/kuka/rsi/rig.h"
#include "tests/drivers/kuka/wire/sen_frame.h"
#include "tests/drivers/said.h"

namespace cellcal::drivers {
namespace {

constexpr double kUnitDeg = 1e-6;  // last transmitted decimal

RsiConfig relative_config() {
  RsiConfig config = rig_config();
  config.mode = CorrectionMode::kRelative;
  config.hold_on = false;
  return config;
}

/// The emulated controller with RSI_ON(#RELATIVE).
sim::ControllerConfig relative(sim::ControllerConfig config) {
  config.mode = sim::RsiMode::kRelative;
  config.hold_on = false;
  return config;
}

class RelativeRig : public Rig {
 public:
  explicit RelativeRig(sim::ControllerConfig krc_config = {}, RsiConfig config = relative_config())
      : Rig(relative(std::move(krc_config)), std::move(config)) {
    to_krc_as = [this](const std::string& text) { return heard(text); };
  }
  /// Records the increments of a reply in transit.
  const std::string& heard(const std::string& text) {
    const auto frame = read_sen(text);
    if (!frame) return text;
    increments_deg = frame->axes_deg;
    for (const double increment : increments_deg)
      largest_deg = std::max(largest_deg, std::abs(increment));
    return text;
  }
  bool still() const {
    return std::all_of(increments_deg.begin(), increments_deg.end(),
                       [](double deg) { return deg == 0.0; });
  }

  std::vector<double> increments_deg = std::vector<double>(6, 0.0);  ///< of the newest reply
  double largest_deg = 0.0;                                          ///< of all so far
};

TEST(RsiRelative, ArrivesByIncrementsOfAtMostOneCyclesTravel) {
  RelativeRig rig;
  rig.make_ready();
  EXPECT_TRUE(rig.still());
  EXPECT_EQ(rig.largest_deg, 0.0) << "nothing before the first move";
  AxisAngles target = rig.commanded();
  target[0] += 40 * kDeg;
  target[2] -= 10 * kDeg;
  const CoreResult result = rig.move(MoveKind::kTransit, target);
  EXPECT_EQ(result.outcome, MoveOutcome::kArrived) << words(result);
  EXPECT_LE(rig.largest_deg, 100 * 0.004 + 2 * kUnitDeg);
  EXPECT_GE(rig.largest_deg, 99 * 0.004);
  EXPECT_TRUE(rig.still());
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_NEAR(rig.krc.setpoint_rad()[i], target[i], 1.5e-4 * kDeg) << "the reference's decimals";
  }
  rig.run(1s);
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, -40)).outcome, MoveOutcome::kArrived);
  EXPECT_NEAR(rig.krc.correction_deg()[0], 0.0, 2 * kUnitDeg);
}

TEST(RsiRelative, WhatIsRoundedAwayIsSentWithTheNextReply) {
  RsiConfig config = relative_config();
  config.decimals = 4;
  RelativeRig rig({}, config);
  rig.make_ready();
  // 0.03 deg/s are 0.00012 deg per cycle: one or two units each.
  const CoreResult result = rig.move(MoveKind::kTransit, rig.moved_by(0, 0.3), 10.0);
  EXPECT_EQ(result.outcome, MoveOutcome::kArrived) << words(result);
  EXPECT_NEAR(rig.krc.correction_deg()[0], 0.3, 1.01e-4);
}

TEST(RsiRelative, AReplyThatIsLostEndsTheMoveByNameAndIsNeverCaughtUp) {
  for (const bool packet_lost : {false, true}) {
    RelativeRig rig;
    rig.make_ready();
    rig.begin(MoveKind::kTransit, rig.moved_by(0, 60));
    rig.run(400ms);
    (packet_lost ? rig.to_pc : rig.to_krc) = false;
    rig.cycle();
    rig.to_pc = rig.to_krc = true;
    const CoreResult result = rig.finish();
    EXPECT_EQ(result.outcome, MoveOutcome::kRobotSilent);
    EXPECT_TRUE(is<cause::IncrementLost>(result.cause)) << words(result);
    EXPECT_LE(rig.largest_deg, 100 * 0.004 + 2 * kUnitDeg);
    EXPECT_TRUE(rig.still());
    EXPECT_EQ(rig.core.state().link, RobotLink::kNotReferenced);
    EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 1)).outcome, MoveOutcome::kRefused);

    // The reference comes from the measured position, not from the sent correction.
    const std::vector<double> held = rig.krc.correction_deg();
    rig.core.rereference();
    ASSERT_TRUE(rig.run_until([&] { return rig.core.state().link == RobotLink::kReady; }, 2s));
    EXPECT_EQ(rig.krc.correction_deg(), held) << "a reference moves nothing";
    EXPECT_NEAR(rig.commanded()[0], rig.krc.actual_rad_at(rig.now)[0], 2e-4 * kDeg);
    const AxisAngles target = rig.moved_by(0, -3);
    EXPECT_EQ(rig.move(MoveKind::kTransit, target).outcome, MoveOutcome::kArrived);
    EXPECT_NEAR(rig.krc.setpoint_rad()[0], target[0], 2e-4 * kDeg);
  }
}

TEST(RsiRelative, ALossThatWasDealtWithDoesNotEndTheMovesBehindIt) {
  RelativeRig rig;
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 60));
  rig.run(400ms);
  rig.to_krc = false;
  rig.cycle();
  rig.to_krc = true;
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kRobotSilent);
  EXPECT_EQ(rig.core.state().interruption, Interruption::kLateReplies);
  EXPECT_EQ(rig.core.state().link, RobotLink::kNotReferenced);
  rig.make_referenced();
  for (const double deg : {5.0, -5.0}) {
    EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, deg)).outcome, MoveOutcome::kArrived);
    EXPECT_EQ(rig.core.state().link, RobotLink::kReady) << "nothing was lost in this one";
  }
}

TEST(RsiRelative, AMoveThatIsRefusedMeanwhileLosesNothing) {
  RelativeRig rig;
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 10));
  rig.run(100ms);
  rig.core.begin({99, MoveKind::kTransit, rig.moved_by(0, 5), 0.0, 0});
  const auto refused = rig.core.next_result();
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->id, 99u);
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kArrived);
  EXPECT_EQ(rig.core.state().link, RobotLink::kReady);
}

TEST(RsiRelative, WhereDelayIsSentNoLongerTheReferenceIsGoneAtOnceAlsoAtRest) {
  for (const bool moving : {false, true}) {
    RelativeRig rig;
    rig.make_ready();
    if (moving) rig.begin(MoveKind::kTransit, rig.moved_by(0, 30));
    rig.run(200ms);
    rig.before_core = [&] {
      const auto at = rig.packet.find("<Delay ");
      if (at != std::string::npos) rig.packet.erase(at, rig.packet.find("/>", at) + 2 - at);
    };
    rig.cycle();
    EXPECT_EQ(rig.core.core_state().link, moving ? RobotLink::kReady : RobotLink::kNotReferenced);
    if (!moving) continue;
    const CoreResult ended = rig.finish();
    EXPECT_EQ(ended.outcome, MoveOutcome::kRobotSilent);
    EXPECT_EQ(ended.interruption, Interruption::kOther);
    EXPECT_EQ(rig.core.core_state().link, RobotLink::kNotReferenced);
  }
}

TEST(RsiRelative, AReplyThatIsLostAfterTheStopIsNoticedAsWell) {
  RelativeRig rig;
  rig.make_ready();
  rig.guard.arm(kArm);
  rig.begin(MoveKind::kSearch, rig.moved_by(0, 2), 10.0, kArm);
  rig.run(1s);
  // The last increment before the stop is lost; its loss is counted in the packet of the trip.
  rig.to_krc = false;
  rig.cycle();
  rig.to_krc = true;
  rig.guard.trip(kArm, rig.now);
  rig.guard.push(ContactEventKind::kContact, kArm, rig.now);
  rig.finish();
  EXPECT_EQ(rig.core.state().link, RobotLink::kNotReferenced);
}

TEST(RsiRelative, AReplyThatIsLostAtRestLosesNothing) {
  RelativeRig rig;
  rig.make_ready();
  rig.to_krc = false;
  rig.cycle();
  rig.to_krc = true;
  rig.run(100ms);
  EXPECT_EQ(rig.core.state().late, 1U);
  EXPECT_EQ(rig.core.state().link, RobotLink::kReady);
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 5)).outcome, MoveOutcome::kArrived);
}

TEST(RsiRelative, PacketsThatWereMissedAreAnsweredByOneIncrement) {
  RsiConfig config = relative_config();
  config.silence_cycles = 20;
  RelativeRig rig({}, config);
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 60));
  rig.run(400ms);
  rig.to_pc = false;
  for (int i = 0; i < 10; ++i) rig.cycle();
  rig.to_pc = true;
  rig.cycle();
  EXPECT_GT(rig.increments_deg[0], 0.0);
  EXPECT_LE(rig.increments_deg[0], 100 * 0.004 + 2 * kUnitDeg);
}

TEST(RsiRelative, TheSamePacketTwiceIsAnsweredAlikeAndCountedOnce) {
  RelativeRig rig;
  rig.make_ready();
  const AxisAngles target = rig.moved_by(0, 5);
  rig.begin(MoveKind::kTransit, target);
  rig.run(200ms);
  const std::string answer = rig.reply;
  EXPECT_FALSE(rig.still());
  EXPECT_EQ(rig.core.on_datagram(rig.packet, rig.now + 200us), answer);
  // Damaged on its second transmission, and readable except for the angles.
  std::string damaged = rig.packet;
  damaged.replace(damaged.find("<AIPos"), 6, "<<<<<<");
  EXPECT_EQ(rig.core.on_datagram(damaged, rig.now + 300us), answer);
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kArrived);
  EXPECT_NEAR(rig.krc.setpoint_rad()[0], target[0], 2e-4 * kDeg);
}

TEST(RsiRelative, ADamagedPacketIsAnsweredByTheIncrementOfItsCycle) {
  RelativeRig rig;
  rig.make_ready();
  const AxisAngles target = rig.moved_by(0, 40);
  rig.begin(MoveKind::kTransit, target);
  rig.run(300ms);
  rig.before_core = [&] { rig.packet.replace(rig.packet.find("<AIPos"), 6, "<<<<<<"); };
  rig.cycle();
  rig.before_core = {};
  EXPECT_FALSE(rig.still());
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kArrived);
  EXPECT_NEAR(rig.krc.setpoint_rad()[0], target[0], 2e-4 * kDeg);
  EXPECT_EQ(rig.krc.late(), 0U);
}

TEST(RsiRelative, TripIsAnsweredWithZerosAndContactLatches) {
  RelativeRig rig;
  rig.make_ready();
  rig.guard.arm(kArm);
  rig.begin(MoveKind::kSearch, rig.moved_by(0, 2), 10.0, kArm);
  rig.run(1s);
  EXPECT_FALSE(rig.still());
  const double truth = rig.krc.actual_rad_at(rig.now)[0];
  rig.guard.trip(kArm, rig.now);
  rig.guard.push(ContactEventKind::kContact, kArm, rig.now);
  rig.cycle();
  EXPECT_TRUE(rig.still()) << "the very reply";
  const CoreResult result = rig.finish();
  ASSERT_EQ(result.outcome, MoveOutcome::kContact) << words(result);
  EXPECT_NEAR(result.latch->contact_rad[0], truth, 2e-4 * kDeg);
  EXPECT_EQ(rig.core.state().link, RobotLink::kReady);
}

TEST(RsiRelative, StopAtSpeedBrakesOnTheLineWithinTheLimits) {
  RelativeRig rig;
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 60));
  rig.run(400ms);
  std::vector<double> increments{rig.increments_deg[0]};
  rig.after_cycle = [&] { increments.push_back(rig.increments_deg[0]); };
  rig.core.stop();
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kStopped);
  for (std::size_t i = 1; i < increments.size(); ++i) {
    EXPECT_LE(std::abs(increments[i] - increments[i - 1]) / (0.004 * 0.004),
              400 + 4 * kUnitDeg / (0.004 * 0.004));
  }
}

TEST(RsiRelative, ASilentClampIsNoticed) {
  sim::ControllerConfig krc;
  krc.clamp_deg = 5.0;
  RelativeRig rig(krc);
  rig.make_ready();
  const CoreResult result = rig.move(MoveKind::kTransit, rig.moved_by(0, 8), 1.0);
  EXPECT_EQ(result.outcome, MoveOutcome::kNotFollowing);
  EXPECT_TRUE(is<cause::AxisStands>(result.cause)) << words(result);
}

TEST(RsiRelative, WithoutDelayItIsNotDriven) {
  sim::ControllerConfig krc;
  krc.send_delay = false;
  RelativeRig rig(krc);
  rig.krc.rsi_on();
  rig.run(500ms);
  rig.core.rereference();
  rig.run(500ms);
  EXPECT_EQ(rig.core.state().link, RobotLink::kNotReferenced);
  EXPECT_TRUE(has(said(rig.core.state().words), "DEF_Delay")) << rig.core.state().words;
  EXPECT_EQ(rig.krc.late(), 0U) << "answered all the same";
}

TEST(RsiRelative, WhereDelayIsSentNoLongerItIsNotDrivenOn) {
  for (const bool anew : {false, true}) {
    RelativeRig rig;
    rig.make_ready();
    rig.begin(MoveKind::kTransit, rig.moved_by(0, 30));
    rig.run(300ms);
    if (anew) {
      ASSERT_EQ(rig.finish().outcome, MoveOutcome::kArrived);
    }
    rig.before_core = [&] {
      const auto at = rig.packet.find("<Delay ");
      if (at != std::string::npos) rig.packet.erase(at, rig.packet.find("/>", at) + 2 - at);
    };
    if (anew) {
      rig.to_pc = false;
      rig.run(300ms);
      rig.to_pc = true;
      rig.krc.rsi_on();
      rig.run(300ms);
    } else {
      const CoreResult result = rig.finish();
      EXPECT_EQ(result.outcome, MoveOutcome::kRobotSilent) << words(result);
      EXPECT_TRUE(is<cause::DelayGone>(result.cause)) << words(result);
    }
    EXPECT_EQ(rig.core.state().link, RobotLink::kNotReferenced);
    rig.core.rereference();
    rig.run(500ms);
    EXPECT_EQ(rig.core.state().link, RobotLink::kNotReferenced);
    EXPECT_TRUE(has(said(rig.core.state().words), "DEF_Delay")) << rig.core.state().words;
  }
}

TEST(RsiRelative, ARunningSessionIsHeldWithZerosAndItsSumIsReadFromAspos) {
  RsiConfig config = relative_config();
  config.correction_limit_deg[0] = 20.0;
  for (const bool setpoint : {true, false}) {
    sim::ControllerConfig krc;
    krc.send_setpoint = setpoint;
    RelativeRig rig(krc, config);
    rig.run(300ms);
    rig.make_ready();
    ASSERT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 15)).outcome, MoveOutcome::kArrived);
    // Another process takes over.
    const std::vector<double> held = rig.krc.correction_deg();
    RsiCore fresh(config, &rig.guard);
    std::optional<CoreResult> result;
    const auto run = [&](int cycles) {
      for (int i = 0; i < cycles && !result; ++i) {
        rig.now += rig.krc.cycle();
        const std::string packet(rig.krc.tick(rig.now));
        fresh.on_tick(rig.now);
        const std::string reply(fresh.on_datagram(packet, rig.now + 100us));
        ASSERT_FALSE(reply.empty()) << "always answered: increments of zero move nothing";
        rig.krc.receive(rig.heard(std::string(reply)));
        result = fresh.next_result();
      }
    };
    run(100);
    fresh.rereference();
    run(100);
    EXPECT_EQ(rig.krc.correction_deg(), held);
    EXPECT_EQ(rig.krc.late(), 0U);
    if (!setpoint) {
      EXPECT_EQ(fresh.state().link, RobotLink::kNotReferenced);
      EXPECT_TRUE(has(said(fresh.state().words), "DEF_ASPos")) << fresh.state().words;
      continue;
    }
    ASSERT_EQ(fresh.state().link, RobotLink::kReady) << fresh.state().words;
    AxisAngles target = fresh.state().commanded_rad;
    target[0] += 6 * kDeg;
    fresh.begin({1, MoveKind::kTransit, target, 0.0, 0});
    run(10);
    ASSERT_TRUE(result);
    EXPECT_EQ(result->outcome, MoveOutcome::kRefused) << "15 and 6 are more than 20";
    expect_cause(result->cause, cause::CorrectionLimit{0, 21.0, 20.0}, 1e-3);
  }
}

TEST(RsiRelative, AfterSilenceNothingMovesUntilReferenced) {
  sim::ControllerConfig krc;
  krc.timeout_cycles = 1000;
  RelativeRig rig(krc);
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 40));
  rig.run(300ms);
  rig.to_pc = false;
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kRobotSilent);
  rig.run(500ms);
  const std::vector<double> before = rig.krc.correction_deg();
  rig.to_pc = true;
  rig.run(1s);
  EXPECT_EQ(rig.core.state().link, RobotLink::kNotReferenced);
  EXPECT_EQ(rig.krc.correction_deg(), before);
  rig.core.rereference();
  rig.run(500ms);
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 1)).outcome, MoveOutcome::kArrived);
}

TEST(CorrectionAccumulator, CapsEachIncrementAndNeverSendsMoreThanIsMissing) {
  CorrectionAccumulator accumulator(CorrectionMode::kRelative, 6, WireAxes(2, false));
  accumulator.set({0.0, 1.0 * kDeg});
  const AxisAngles wanted{1.0 * kDeg, 1.0 * kDeg}, step{0.4 * kDeg, 0.4 * kDeg};
  double sum = 0.0;
  for (int i = 0; i < 5; ++i) {
    const auto sent = accumulator.next_deg(wanted, step);
    EXPECT_LE(sent[0], 0.4 + 1.5e-6);
    EXPECT_EQ(sent[1], 0.0);
    sum += sent[0];
  }
  EXPECT_NEAR(sum, 1.0, 1e-9);
  EXPECT_EQ(accumulator.hold_deg()[0], 0.0);
  EXPECT_NEAR(accumulator.held_rad()[0], 1.0 * kDeg, 1e-9);
}

TEST(CorrectionAccumulator, AbsoluteIsWhatIsWanted) {
  CorrectionAccumulator accumulator(CorrectionMode::kAbsolute, 6, WireAxes(1, false));
  accumulator.set({2.0 * kDeg});
  EXPECT_NEAR(accumulator.hold_deg()[0], 2.0, 1e-12);
  EXPECT_NEAR(accumulator.next_deg({3.0 * kDeg}, {0.0})[0], 3.0, 1e-12);
  EXPECT_NEAR(accumulator.again_deg()[0], 3.0, 1e-12);
}

}  // namespace
}  // namespace cellcal::drivers
