#include "drivers/error.h"
#include "tests/drivers/kuka/allocation_count.h"
#include "tests/drivers/kuka/rsi/rig.h"
#include "tests/drivers/said.h"

namespace cellcal::drivers {
namespace {

TEST(RsiLink, FirstPacketIsAnsweredWithZeroAndItsOwnIpoc) {
  Rig rig;
  rig.krc.rsi_on();
  rig.cycle();
  EXPECT_EQ(rig.reply,
            "<Sen Type=\"ImFree\"><AK A1=\"0.000000\" A2=\"0.000000\" A3=\"0.000000\" "
            "A4=\"0.000000\" A5=\"0.000000\" A6=\"0.000000\"/><Stop>0</Stop><IPOC>" +
                std::to_string(rig.krc.ipoc()) + "</IPOC></Sen>");
  rig.run(1s);
  EXPECT_EQ(rig.krc.late(), 0U);
  EXPECT_EQ(rig.core.state().link, RobotLink::kNotReferenced);
}

TEST(RsiLink, NothingMovesBeforeTheReference) {
  Rig rig;
  rig.krc.rsi_on();
  rig.run(500ms);
  const std::vector<double> before = rig.krc.setpoint_rad();
  const CoreResult result = rig.move(MoveKind::kTransit, rig.moved_by(0, 5));
  EXPECT_EQ(result.outcome, MoveOutcome::kRefused);
  EXPECT_TRUE(is<cause::NotReferenced>(result.cause)) << words(result);
  rig.run(500ms);
  EXPECT_EQ(rig.krc.setpoint_rad(), before);
}

TEST(RsiLink, ReferenceAskedForWithoutPacketsIsForgotten) {
  Rig rig;
  rig.core.rereference();
  rig.run(100ms);
  rig.krc.rsi_on();
  rig.run(1s);
  EXPECT_EQ(rig.core.state().link, RobotLink::kNotReferenced);
}

TEST(RsiLink, CycleIsLearntFromIpocOrArrivals) {
  for (const auto& [cycle_ms, step] : {std::pair{4, 0}, {12, 0}, {4, 1}, {12, 1}}) {
    sim::ControllerConfig krc;
    krc.cycle_ms = cycle_ms;
    krc.ipoc_step = step;
    Rig rig(krc);
    rig.make_ready();
    EXPECT_NEAR(rig.core.state().cycle_s, 1e-3 * cycle_ms, 1e-9) << cycle_ms << " " << step;
    EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 3)).outcome, MoveOutcome::kArrived);
  }
}

TEST(RsiLink, CycleOutsideOfReasonIsNotTrusted) {
  sim::ControllerConfig krc;
  krc.cycle_ms = 60;
  Rig rig(krc);
  rig.krc.rsi_on();
  rig.run(5s);
  rig.core.rereference();
  rig.run(5s);
  EXPECT_EQ(rig.core.state().link, RobotLink::kNotReferenced);
  EXPECT_TRUE(has(said(rig.core.state().words), "2 to 40 ms")) << rig.core.state().words;
}

TEST(RsiLink, CoarseAnglesAreRefusedAndNamed) {
  for (const int precision : {0, 1, 2}) {
    sim::ControllerConfig krc;
    krc.precision = precision;
    Rig rig(krc);
    rig.krc.rsi_on();
    rig.run(500ms);
    rig.core.rereference();
    rig.run(1s);
    EXPECT_EQ(rig.core.state().link, RobotLink::kNotReferenced);
    EXPECT_TRUE(has(said(rig.core.state().words), "Precision")) << rig.core.state().words;
    EXPECT_EQ(rig.krc.late(), 0U) << "answered all the same";
  }
  sim::ControllerConfig krc;
  krc.precision = 3;
  Rig rig(krc);
  rig.make_ready();
}

TEST(RsiLink, NoPacketAtAllBringsTheChecklist) {
  Rig rig;
  rig.run(5s);
  const RobotState state = rig.core.state();
  EXPECT_EQ(state.link, RobotLink::kDown);
  EXPECT_TRUE(has(said(state.words), "no packet for 5.0 s")) << state.words;
  for (const char* hint :
       {"49152", "RSI", "PORT", "cable", "firewall", "other program", "hardware address"}) {
    EXPECT_TRUE(has(said(state.words), hint)) << hint;
  }
  const CoreResult result = rig.move(MoveKind::kTransit, rig.commanded());
  EXPECT_EQ(result.outcome, MoveOutcome::kRefused);
  EXPECT_TRUE(is<cause::NoPackets>(result.cause)) << words(result);
}

TEST(RsiLink, WrongSentypeIsDiagnosed) {
  RsiConfig config = rig_config();
  config.sentype = "KROSHU";
  Rig rig({}, config);
  rig.krc.rsi_on();
  rig.run(200ms);
  const RobotState state = rig.core.state();
  EXPECT_TRUE(has(said(state.words), "SENTYPE") && has(said(state.words), "KROSHU")) << state.words;
  rig.core.rereference();
  rig.run(100ms);
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 1)).outcome, MoveOutcome::kRefused);
}

TEST(RsiLink, RepliesThatWereRefusedAreStillNamedOnceTheControllerGaveUp) {
  for (const int timeout_cycles : {5, 10}) {  // KUKA's default is 10
    sim::ControllerConfig krc;
    krc.timeout_cycles = timeout_cycles;
    RsiConfig config = rig_config();
    config.sentype = "KROSHU";
    Rig rig(krc, config);
    rig.krc.rsi_on();
    rig.run(3s);
    ASSERT_EQ(rig.krc.phase(), sim::RsiPhase::kFaulted);
    const RobotState state = rig.core.state();
    EXPECT_EQ(state.link, RobotLink::kLost);
    EXPECT_TRUE(has(said(state.words), "No reply accepted")) << state.words;
    EXPECT_TRUE(has(said(state.words), "KROSHU")) << state.words;
  }
}

TEST(RsiLink, ASessionThatWasAcceptedIsNotSaidToBeRefusedWhenItIsLost) {
  Rig rig;
  rig.krc.rsi_on();
  rig.run(100ms);
  rig.to_krc = false;
  rig.run(3s);
  EXPECT_EQ(rig.core.state().link, RobotLink::kLost);
  EXPECT_FALSE(has(said(rig.core.state().words), "SENTYPE")) << rig.core.state().words;
}

TEST(RsiLink, WhatCameInsteadOfPacketsIsShown) {
  Rig rig;
  rig.run(2s);
  rig.core.on_datagram("GET / HTTP/1.1\r\n", rig.now);
  rig.core.on_tick(rig.now);
  const RobotState state = rig.core.state();
  EXPECT_EQ(state.link, RobotLink::kDown);
  EXPECT_TRUE(has(said(state.words), "no packet for 2.0 s")) << state.words;
  EXPECT_TRUE(has(said(state.words), "GET / HTTP/1.1..")) << state.words;
}

TEST(RsiLink, LateRepliesAreWarnedOf) {
  Rig rig;
  rig.make_ready();
  EXPECT_FALSE(has(said(rig.core.state().words), "late"));
  rig.to_krc = false;
  rig.cycle();
  rig.to_krc = true;
  rig.run(50ms);
  EXPECT_EQ(rig.core.state().link, RobotLink::kReady);
  EXPECT_TRUE(has(said(rig.core.state().words), "of the replies late")) << rig.core.state().words;
}

TEST(RsiLink, SilenceEndsTheMoveAndNothingMovesAfterItUntilReferenced) {
  sim::ControllerConfig krc;
  krc.timeout_cycles = 1000;
  Rig rig(krc);
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 40));
  rig.run(300ms);
  rig.to_pc = false;
  const TimePoint unplugged = rig.now;
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kRobotSilent);
  EXPECT_TRUE(is<cause::Silence>(result.cause)) << words(result);
  EXPECT_LE(rig.now - unplugged, 16ms);
  EXPECT_EQ(rig.core.state().link, RobotLink::kLost);
  rig.run(500ms);

  const std::vector<double> before = rig.krc.setpoint_rad();
  rig.to_pc = true;
  rig.run(1s);
  EXPECT_EQ(rig.core.state().link, RobotLink::kNotReferenced);
  EXPECT_EQ(rig.krc.setpoint_rad(), before) << "the offset that the controller held is held";
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 1)).outcome, MoveOutcome::kRefused);
  rig.core.rereference();
  rig.run(500ms);
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 1)).outcome, MoveOutcome::kArrived);
}

TEST(RsiLink, SilenceIsNoticedByThePacketThatEndsIt) {
  Rig rig;
  rig.make_ready();
  const std::string late(rig.krc.tick(rig.now + 4ms));
  rig.core.on_datagram(late, rig.now + 17ms);  // no tick in between: this thread was delayed
  EXPECT_EQ(rig.core.state().link, RobotLink::kNotReferenced);
}

TEST(RsiLink, StopOfTheControllerInAMoveIsSilence) {
  sim::ControllerConfig krc;
  krc.max_speed_rad_s.assign(6, 20 * kDeg);  // below the adapter's configuration
  Rig rig(krc);
  rig.make_ready();
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 40)).outcome, MoveOutcome::kRobotSilent);
  EXPECT_TRUE(has(rig.krc.message(), "Command velocity A1"));
}

TEST(RsiLink, ADamagedPacketIsACycleAllTheSameAndTheMoveGoesOnByIt) {
  Rig rig;
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 40));
  rig.run(300ms);
  const std::string before = rig.reply;
  rig.before_core = [&] {  // AIPos is lost, IPOC is readable
    rig.packet.replace(rig.packet.find("<AIPos"), 6, "<<<<<<");
  };
  rig.cycle();
  rig.before_core = {};
  const auto a1_deg = [](const std::string& reply) {
    return std::stod(reply.substr(reply.find("A1=\"") + 4));
  };
  EXPECT_NEAR(a1_deg(rig.reply) - a1_deg(before), 100 * 0.004, 0.02) << "at the speed that it had";
  EXPECT_TRUE(has(rig.reply, std::to_string(rig.krc.ipoc())));
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kArrived);
  EXPECT_EQ(rig.krc.late(), 0U);
  EXPECT_TRUE(has(said(rig.core.state().words), "damaged")) << rig.core.state().words;
}

TEST(RsiLink, OnlyDamagedPacketsAreSilence) {
  Rig rig;
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 40));
  rig.run(300ms);
  rig.before_core = [&] {
    if (!rig.packet.empty()) rig.packet.replace(rig.packet.find("<AIPos"), 6, "<<<<<<");
  };
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kRobotSilent);
}

TEST(RsiLink, RepeatedAndOvertakenPacketsDoNotAdvanceTheArm) {
  Rig rig;
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 40));
  rig.run(300ms);
  const std::string older = rig.packet;
  rig.cycle();
  const std::string newest = rig.packet, answer = rig.reply;
  EXPECT_EQ(rig.core.on_datagram(newest, rig.now), answer);
  EXPECT_EQ(rig.core.on_datagram(older, rig.now), "");
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kArrived);
}

TEST(RsiLink, PacketsThatAreMissingAreCounted) {
  Rig rig;
  rig.make_ready();
  EXPECT_EQ(rig.core.core_state().gaps, 0U);
  for (int i = 0; i < 3; ++i) {
    rig.to_pc = false;
    rig.cycle();
    rig.to_pc = true;
    rig.run(40ms);
  }
  EXPECT_EQ(rig.core.core_state().gaps, 3U);
  EXPECT_EQ(rig.core.state().link, RobotLink::kReady);
}

TEST(RsiLink, FirstFrameOfRsi2IsAnswered) {
  sim::ControllerConfig krc;
  krc.first_frame_only_ipoc = true;
  krc.send_setpoint = krc.send_delay = false;
  krc.cycle_ms = 12;
  Rig rig(krc);
  rig.make_ready();
  EXPECT_EQ(rig.krc.late(), 0U);
}

TEST(RsiLink, IpocMayWrap) {
  sim::ControllerConfig krc;
  krc.ipoc_start = 0xFFFFFFFFULL - 600;
  Rig rig(krc);
  rig.make_ready();
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 40)).outcome, MoveOutcome::kArrived);
  EXPECT_GT(rig.krc.ipoc(), 0xFFFFFFFFULL);
}

TEST(RsiLink, EndOfTheSessionStopsTheControllersProgram) {
  Rig rig;
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 40));
  rig.run(300ms);
  rig.core.close();
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kStopped);
  ASSERT_TRUE(rig.run_until([&] { return rig.krc.phase() == sim::RsiPhase::kEnded; }, 2s));
  EXPECT_TRUE(rig.core.end_sent());
  EXPECT_EQ(rig.krc.late(), 0U);
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 1)).outcome, MoveOutcome::kRefused);
}

TEST(RsiLink, StopIsSeenLowBeforeItRises) {
  Rig rig;
  rig.core.close();  // before the first packet
  rig.krc.rsi_on();
  rig.cycle();
  EXPECT_TRUE(has(rig.reply, "<Stop>0</Stop>")) << rig.reply;
  rig.cycle();
  EXPECT_TRUE(has(rig.reply, "<Stop>1</Stop>")) << rig.reply;
  ASSERT_TRUE(rig.run_until([&] { return rig.krc.phase() == sim::RsiPhase::kEnded; }, 1s));
}

TEST(RsiLink, EndOfTheSessionInATransitBrakesRestsAndThenRaisesStopOnce) {
  Rig rig;
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 40));
  rig.run(300ms);
  rig.core.close();
  double speed = 0.0, last = rig.krc.setpoint_rad()[0];
  int rises = 0, unanswered = 0;
  bool high = false;
  rig.after_cycle = [&] {
    speed = (rig.krc.setpoint_rad()[0] - last) / 0.004;
    last = rig.krc.setpoint_rad()[0];
    unanswered += !rig.packet.empty() && rig.reply.empty();
    const bool now_high = has(rig.reply, "<Stop>1</Stop>");
    if (now_high && !high) {
      ++rises;
      EXPECT_EQ(speed, 0.0) << "at rest";
    }
    high = now_high || (high && rig.reply.empty());
  };
  ASSERT_TRUE(rig.run_until([&] { return rig.krc.phase() == sim::RsiPhase::kEnded; }, 3s));
  EXPECT_EQ(rises, 1);
  EXPECT_EQ(unanswered, 0) << "replies until the controller is silent";
}

TEST(RsiLink, BadConfigurationIsRefusedAtOnce) {
  RsiConfig config = rig_config();
  config.hold_on = false;
  EXPECT_THROW(RsiCore(config, nullptr), ConfigError);
}

TEST(RsiCycleOfAPath, NeitherPlanningNorBrakingAllocates) {
  Rig rig;
  rig.make_ready();
  Move move{++rig.last_id, MoveKind::kTransit, rig.moved_by(1, -20), 0.0, 0};
  for (const double deg : {5.0, -5.0, 5.0, -5.0}) {
    move.via.push_back({rig.moved_by(0, deg), 0.5, 0.5});
  }
  rig.core.begin(move);
  std::array<char, 2048> packet{};
  long during = 0;
  std::optional<CoreResult> result;
  for (int cycles = 0; cycles < 600 && !result; ++cycles) {
    rig.now += 4ms;
    const std::string_view sent = rig.krc.tick(rig.now);
    const std::size_t size = sent.copy(packet.data(), packet.size());
    const long before = allocation_count();
    if (cycles == 100) rig.core.stop();
    rig.core.on_tick(rig.now);
    const std::string_view reply = rig.core.on_datagram({packet.data(), size}, rig.now);
    result = rig.core.next_result();
    during += allocation_count() - before;
    rig.krc.receive(std::string(reply));
  }
  ASSERT_TRUE(result);
  EXPECT_EQ(result->outcome, MoveOutcome::kStopped);
  EXPECT_EQ(during, 0);
}

class RsiCycle : public ::testing::TestWithParam<CorrectionMode> {};

TEST_P(RsiCycle, DoesNotAllocate) {
  RsiConfig config = rig_config();
  config.mode = GetParam();
  config.hold_on = GetParam() == CorrectionMode::kAbsolute;
  sim::ControllerConfig krc;
  krc.hold_on = config.hold_on;
  if (GetParam() == CorrectionMode::kRelative) krc.mode = sim::RsiMode::kRelative;
  Rig rig(krc, config);
  rig.make_ready();
  rig.guard.arm(1);
  rig.begin(MoveKind::kSearch, rig.moved_by(0, 0.2), 1.0, 1);
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
    rig.krc.receive(rig.to_krc_as(std::string(reply)));
    if (result) break;
    if (cycles % 50 == 49) {  // damaged ones as well
      before = allocation_count();
      rig.core.on_datagram({packet.data(), size / 2}, rig.now);
      during += allocation_count() - before;
    }
  }
  EXPECT_GT(cycles, 250);
  EXPECT_EQ(during, 0);
}

INSTANTIATE_TEST_SUITE_P(, RsiCycle,
                         ::testing::Values(CorrectionMode::kAbsolute, CorrectionMode::kRelative),
                         [](const auto& mode) {
                           return mode.param == CorrectionMode::kAbsolute ? "Absolute" : "Relative";
                         });

}  // namespace
}  // namespace cellcal::drivers
