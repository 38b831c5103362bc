// The emulated controller with its EKI programs, with manual commands.

#include "sim/krc/eki_controller.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <stdexcept>

#include "drivers/kuka/krl/krl_files.h"
#include "drivers/kuka/wire/eki_codec.h"
#include "drivers/units.h"

namespace cellcal::sim {
namespace {

using namespace std::chrono_literals;
using drivers::EkiOutcome;
using drivers::EkiProgress;

EkiControllerConfig usual() {
  EkiControllerConfig config;
  config.files = drivers::eki_files({});
  config.max_speed_rad_s.assign(6, 200 * drivers::kRadPerDeg);
  config.max_acceleration_rad_s2 = 400 * drivers::kRadPerDeg;
  return config;
}

/// The TCP by lengths of its own: X is A1 in degrees.
struct LongArm : CartesianArm {
  KukaFrame frame(std::span<const double> rad) const override {
    return {1000.0 + rad[0] / drivers::kRadPerDeg, 2.0, 3.0, 4.0, 5.0, 6.0};
  }
  std::optional<std::vector<double>> axes(const KukaFrame&,
                                          const std::vector<double>&) const override {
    return std::nullopt;
  }
  std::optional<std::vector<double>> corrected(std::span<const double>, const KukaFrame&,
                                               CorrectionFrame,
                                               const std::vector<double>&) const override {
    return std::nullopt;
  }
};

class EkiKrc : public ::testing::Test {
 protected:
  void TearDown() override {
    if (krc) {
      EXPECT_EQ(krc->fault(), "");
    }
  }
  void make(const EkiControllerConfig& config = usual()) {
    krc = std::make_unique<EkiController>(config);
    krc->start_program();
    run(40ms);
    ASSERT_TRUE(krc->connect());
    send(1);
    run(40ms);
    ASSERT_EQ(state.session, 5u);
  }
  void tick() {
    now += krc->cycle();
    krc->tick(now);
    if (after_tick) after_tick();
    drivers::EkiFramer framer;
    for (const char c : krc->drain_output()) {
      if (framer.push(c) != drivers::EkiFramer::Event::kDocument) continue;
      ++states;
      ASSERT_EQ(parser.parse_state(framer.document(), state), drivers::EkiError::kNone)
          << framer.document();
    }
  }
  void run(drivers::Duration duration, bool beats = true) {
    for (const auto end = now + duration; now < end;) {
      tick();
      if (beats && krc->connected() && now - last_sent > 40ms) send(2);
    }
  }
  void run_to_rest() {
    for (int i = 0; i < 10000; ++i) {
      tick();
      if (krc->connected() && now - last_sent > 40ms) send(2);
      if (state.progress == EkiProgress::kDone && state.move_id == id) return;
    }
    ADD_FAILURE() << "no end";
  }
  void send(int type,
            const std::string& axes =
                "<Axis A1=\"0\" A2=\"-90\" A3=\"90\" A4=\"0\" "
                "A5=\"90\" A6=\"0\"/>",
            const std::string& move = "Guard=\"0\" Path=\"1\" Percent=\"50\" Duration=\"0\"") {
    if (type == 3) ++id;
    krc->receive("<RobotCommand Session=\"5\" Seq=\"" + std::to_string(++seq) + "\" Type=\"" +
                 std::to_string(type) + "\" Id=\"" + std::to_string(id) + "\">" + axes + "<Move " +
                 move + "/></RobotCommand>");
    last_sent = now;
  }
  void go(double a1_deg,
          const std::string& move = "Guard=\"0\" Path=\"1\" Percent=\"50\" Duration=\"0\"") {
    send(3,
         "<Axis A1=\"" + std::to_string(a1_deg) +
             "\" A2=\"-90\" A3=\"90\" A4=\"0\" A5=\"90\" A6=\"0\"/>",
         move);
  }
  double a1_deg() const { return krc->actual_rad_at(now)[0] / drivers::kRadPerDeg; }

  std::unique_ptr<EkiController> krc;
  drivers::EkiParser parser;
  drivers::EkiState state;
  drivers::TimePoint now{1000s}, last_sent{};
  std::function<void()> after_tick;
  std::uint32_t seq = 0, id = 0;
  int states = 0;
};

TEST_F(EkiKrc, SendsFiftyStatesASecond) {
  make();
  states = 0;
  run(2s);
  EXPECT_EQ(states, 100);
}

TEST_F(EkiKrc, TakesTheLoadOfAnyNumber) {
  drivers::EkiFilesConfig files;
  files.load = 3;
  EkiControllerConfig config = usual();
  config.files = drivers::eki_files(files);
  make(config);
  run(40ms);
  EXPECT_TRUE(krc->ready());
}

TEST_F(EkiKrc, TellsItsLongestPassWhileSomebodyIsObeyedAndIsSlowerOtherwise) {
  make();
  run(200ms);
  EXPECT_EQ(state.pass_ms, 12U) << "20 ms, in steps of $TIMER";
  krc->halt_submit(true);
  run(100ms);
  krc->halt_submit(false);
  run(20ms);
  EXPECT_GE(state.pass_ms, 96U);
  run(40ms);
  EXPECT_EQ(state.pass_ms, 12U);
  send(5);  // bye
  run(40ms);
  states = 0;
  run(240ms);
  EXPECT_EQ(states, 10);
}

TEST_F(EkiKrc, SendsItsTcpOnceItsProgramHasSetToolAndBaseAndAsTheModelHasIt) {
  EkiControllerConfig config = usual();
  config.arm = config.states = std::make_shared<LongArm>();
  krc = std::make_unique<EkiController>(config);
  run(40ms);
  ASSERT_TRUE(krc->connect());
  send(1);
  run(40ms);
  EXPECT_TRUE(state.sends_tcp);
  EXPECT_FALSE(state.tcp) << "after a cold start $POS_ACT would halt the submit interpreter";
  krc->start_program();
  run(100ms);
  ASSERT_TRUE(state.tcp);
  EXPECT_EQ(*state.tcp, (drivers::EkiFrameValues{1000, 2, 3, 4, 5, 6}));
  go(30);
  run_to_rest();
  run(200ms);
  ASSERT_TRUE(state.tcp);
  EXPECT_NEAR((*state.tcp)[0], 1030.0, 1e-3);
}

TEST_F(EkiKrc, MovesAtThePercentItIsToldAndRampsAtBothEnds) {
  make();
  double fastest = 0.0, steepest = 0.0, speed = 0.0,
         last = krc->setpoint_rad()[0] / drivers::kRadPerDeg;
  after_tick = [&] {
    const double at = krc->setpoint_rad()[0] / drivers::kRadPerDeg;
    const double here = (at - last) / 0.004;
    steepest = std::max(steepest, std::abs(here - speed) / 0.004);
    speed = here;
    fastest = std::max(fastest, speed);
    last = at;
  };
  go(90);
  run_to_rest();
  EXPECT_EQ(state.outcome, EkiOutcome::kArrived);
  run(200ms);  // the arm after its setpoint
  EXPECT_NEAR(a1_deg(), 90.0, 0.02);
  EXPECT_NEAR(fastest, 100.0, 0.1);
  EXPECT_LE(steepest, 401.0 * 2) << "the last step may be shorter than a cycle";
}

TEST_F(EkiKrc, LinTakesTheDurationItIsTold) {
  make();
  const drivers::TimePoint begun = now;
  go(2, "Guard=\"0\" Path=\"2\" Percent=\"1\" Duration=\"2.0\"");
  run_to_rest();
  EXPECT_NEAR(std::chrono::duration<double>(now - begun).count(), 2.0, 0.1);
}

TEST_F(EkiKrc, StopsAtItsInputWithARampAndLatchesWhereTheInputCame) {
  EkiControllerConfig config = usual();
  config.input_delay_s = config.input_sample_s = 0.0;
  make(config);
  double at_edge = 0.0;
  after_tick = [&] {
    if (at_edge == 0.0 && a1_deg() > 30.0) {
      const drivers::TimePoint edge = now + 1ms;
      at_edge = krc->actual_rad_at(edge)[0] / drivers::kRadPerDeg;
      krc->input(edge, true);
    }
  };
  go(90, "Guard=\"1\" Path=\"1\" Percent=\"50\" Duration=\"0\"");
  run_to_rest();
  EXPECT_EQ(state.outcome, EkiOutcome::kInput);
  EXPECT_EQ(state.latch_id, id);
  EXPECT_NEAR(state.latch_deg[0], at_edge, 1e-5);
  run(200ms);
  // 100 deg/s, at most 12 ms to the interrupt, 20 ms of lag, a ramp of 800 deg/s^2.
  const double ramp = 100.0 * 100.0 / (2 * 800.0);
  EXPECT_GT(a1_deg() - at_edge, ramp - 0.5);
  EXPECT_LT(a1_deg() - at_edge, ramp + 100.0 * 0.040);
}

TEST_F(EkiKrc, AMeasuringTouchBrakesOnItsOwnRampAndAStopTelegramAsShortAsItCan) {
  // From 4 deg/s to rest, in the middle of a LIN.
  const auto ramp_deg = [&](bool touch) {
    make();
    go(20, "Guard=\"1\" Path=\"2\" Percent=\"1\" Duration=\"5.0\"");
    run(2s);
    if (touch) {
      krc->input(now, true);
    } else {
      send(4);
    }
    const double cruise_rad = 4.0 * drivers::kRadPerDeg * 0.004;
    double way_rad = 0.0;
    while (!krc->at_rest()) {
      const double before = krc->setpoint_rad()[0];
      tick();
      const double step = krc->setpoint_rad()[0] - before;
      if (step < 0.999 * cruise_rad) way_rad += step;
    }
    run_to_rest();
    EXPECT_EQ(state.outcome, touch ? EkiOutcome::kInput : EkiOutcome::kStop);
    return way_rad / drivers::kRadPerDeg;
  };
  // $ACC.CP, at 1 m.
  EXPECT_NEAR(ramp_deg(true), 4.0 * 4.0 / (2 * 0.5 / drivers::kRadPerDeg), 0.02);
  EXPECT_NEAR(ramp_deg(false), 4.0 * 4.0 / (2 * 800.0), 0.02);
}

TEST_F(EkiKrc, RefusesAGuardedMoveWhoseInputIsOn) {
  make();
  krc->input(now, true);
  run(40ms);
  go(10, "Guard=\"1\" Path=\"1\" Percent=\"50\" Duration=\"0\"");
  run_to_rest();
  EXPECT_EQ(state.outcome, EkiOutcome::kInputAtStart);
  EXPECT_EQ(krc->moves(), 0u);
}

TEST_F(EkiKrc, StopsWhenItHearsNothing) {
  make();
  go(170);
  run(200ms);
  ASSERT_FALSE(krc->at_rest());
  run(1500ms, false);
  EXPECT_TRUE(krc->at_rest());
  EXPECT_EQ(state.outcome, EkiOutcome::kDeadMan);
  EXPECT_LT(a1_deg(), 90.0);
}

TEST_F(EkiKrc, ObeysTheSessionOfTheNewestHelloAlone) {
  make();
  krc->receive(
      "<RobotCommand Session=\"4\" Seq=\"1\" Type=\"3\" Id=\"9\"><Axis A1=\"9\" A2=\"-90\" "
      "A3=\"90\" A4=\"0\" A5=\"90\" A6=\"0\"/><Move Guard=\"0\" Path=\"1\" Percent=\"50\" "
      "Duration=\"0\"/></RobotCommand>");
  run(200ms);
  EXPECT_EQ(krc->moves(), 0u);
  EXPECT_EQ(state.move_id, 0u);
}

TEST_F(EkiKrc, TakesEachMoveOnce) {
  make();
  go(5);
  run_to_rest();
  --id;
  go(50);  // the same id again
  run(500ms);
  EXPECT_EQ(krc->moves(), 1u);
  EXPECT_NEAR(a1_deg(), 5.0, 0.02);
}

TEST_F(EkiKrc, ATelegramWithAMissingElementIsCountedAndMovesNothing) {
  make();
  krc->receive(
      "<RobotCommand Session=\"5\" Seq=\"99\" Type=\"3\" Id=\"1\"><Axis A1=\"9\"/>"
      "</RobotCommand>");
  send(2);  // read in the same pass
  run(100ms);
  EXPECT_EQ(state.bad, 1u);
  EXPECT_EQ(krc->moves(), 0u);
  go(5);
  run_to_rest();
  EXPECT_EQ(state.outcome, EkiOutcome::kArrived) << "the queues are in step again";
}

TEST_F(EkiKrc, ATelegramThatIsMissingInTheCountStopsTheArm) {
  make();
  go(170);
  run(200ms);
  ASSERT_FALSE(krc->at_rest());
  ++seq;  // unreadable: it may have been a stop
  run(600ms);
  EXPECT_TRUE(krc->at_rest());
  EXPECT_EQ(state.outcome, EkiOutcome::kDeadMan);
  EXPECT_EQ(state.bad, 1u);
  go(5);
  run_to_rest();
  EXPECT_EQ(state.outcome, EkiOutcome::kArrived);
}

TEST_F(EkiKrc, ATelegramWithoutItsNumberStopsTheArmAndShiftsNoOther) {
  make();
  go(170);
  run(200ms);
  ++seq;
  krc->receive(
      "<RobotCommand Session=\"5\" Type=\"2\" Id=\"1\"><Axis A1=\"0\" A2=\"-90\" A3=\"90\" A4=\"0\" A5=\"90\" "
      "A6=\"0\"/><Move Guard=\"0\" Path=\"1\" Percent=\"50\" Duration=\"0\"/></RobotCommand>");
  run(600ms);
  EXPECT_TRUE(krc->at_rest());
  EXPECT_EQ(state.bad, 1u);
  go(5);
  run_to_rest();
  EXPECT_EQ(state.outcome, EkiOutcome::kArrived);
  run(200ms);
  EXPECT_NEAR(a1_deg(), 5.0, 0.02);
}

TEST_F(EkiKrc, T1IsSlow) {
  make();
  krc->mode(drivers::OperatingMode::kT1);
  krc->start_program();
  double fastest = 0.0, last = a1_deg();
  after_tick = [&] {
    fastest = std::max(fastest, std::abs(a1_deg() - last) / 0.004);
    last = a1_deg();
  };
  go(20);
  run_to_rest();
  EXPECT_EQ(state.outcome, EkiOutcome::kArrived);
  EXPECT_LT(fastest, 15.0);
}

TEST_F(EkiKrc, AnEmergencyStopEndsTheProgramForGood) {
  make();
  go(170);
  run(300ms);
  krc->emergency_stop(true);
  run(500ms);
  EXPECT_TRUE(krc->at_rest());
  EXPECT_EQ(state.outcome, EkiOutcome::kAborted);
  EXPECT_FALSE(state.ready);
  const double rest = a1_deg();
  krc->emergency_stop(false);
  krc->start_program();
  run(1s);
  EXPECT_TRUE(state.ready);
  EXPECT_NEAR(a1_deg(), rest, 1e-3);
}

// Actions of the controller itself, without the submit program.

TEST_F(EkiKrc, AProgramThatStandsGoesOnWithItsMotionWhenItIsStarted) {
  make();
  go(90);
  run(200ms);
  krc->halt_submit(true);
  krc->drives(false);
  run(500ms);
  const double rest = a1_deg();
  ASSERT_TRUE(krc->at_rest());
  ASSERT_LT(rest, 80.0);
  krc->drives(true);
  krc->start_program();
  EXPECT_FALSE(krc->at_rest()) << "that is why the submit program has to cancel it";
}

TEST_F(EkiKrc, AMoveThatAnEmergencyStopInterruptedIsUnderWayUntilItIsCancelled) {
  make();
  go(170);
  run(300ms);
  krc->emergency_stop(true);
  bool gone = false;
  double rest = 0.0;
  after_tick = [&] {
    if (state.progress == EkiProgress::kMoving) {
      EXPECT_FALSE(gone);
      rest = a1_deg();
    }
    if (state.progress == EkiProgress::kDone) gone = true;
    if (!gone) return;
    krc->emergency_stop(false);
    krc->start_program();
    EXPECT_NEAR(a1_deg(), rest, 0.1);
  };
  run(1s);
  EXPECT_TRUE(gone);
}

TEST_F(EkiKrc, StartedAgainBeforeItCouldBeCancelledTheArmStopsAtOnce) {
  make();
  go(170);
  run(300ms);
  krc->emergency_stop(true);
  run(20ms);  // the submit program has asked for STOP ...
  krc->halt_submit(true);
  for (int i = 0; i < 1000 && !krc->at_rest(); ++i) tick();
  krc->emergency_stop(false);
  krc->start_program();
  ASSERT_FALSE(krc->at_rest());
  krc->halt_submit(false);  // ... and comes too late for CANCEL
  run(500ms);
  EXPECT_TRUE(krc->at_rest());
  EXPECT_EQ(state.outcome, EkiOutcome::kAborted);
  EXPECT_LT(a1_deg(), 60.0);
}

TEST_F(EkiKrc, ASubmitInterpreterThatHaltsStopsTheArm) {
  make();
  go(170);
  run(200ms);
  krc->halt_submit(true);
  run(1s);
  EXPECT_TRUE(krc->at_rest());
  EXPECT_LT(a1_deg(), 70.0);
}

TEST_F(EkiKrc, AnotherProgramIsNotReadyAndIsNotCancelled) {
  make();
  krc->cancel_program();
  krc->start_other_program();
  run(100ms);
  EXPECT_FALSE(state.ready);
  go(5);
  run(200ms);
  EXPECT_EQ(krc->moves(), 0u);
  EXPECT_EQ(state.outcome, EkiOutcome::kAborted);
  krc->cancel_program();
  krc->start_program();
  run(100ms);
  EXPECT_TRUE(state.ready);
}

TEST_F(EkiKrc, ReadyIsNotLeftOverFromAProgramThatWasDeselected) {
  make();
  ASSERT_TRUE(state.ready);
  krc->cancel_program();
  run(40ms);
  EXPECT_FALSE(state.ready);
}

TEST_F(EkiKrc, OpensItsPortAgainAfterAClientHasGone) {
  make();
  krc->disconnect();
  EXPECT_TRUE(krc->connect()) << "the program has not noticed yet";
  krc->disconnect();
  run(20ms);
  EXPECT_FALSE(krc->connect());
  run(200ms);
  EXPECT_TRUE(krc->connect());
  EXPECT_EQ(krc->session(), 0u);
}

TEST_F(EkiKrc, MakesAChannelAnewThatTheControllerDeletedWhileNobodyWasConnected) {
  make();
  krc->disconnect();
  run(300ms);
  krc->reconfigure_io();
  run(100ms);
  EXPECT_FALSE(krc->connect());
  run(4s);
  EXPECT_TRUE(krc->connect());
}

TEST_F(EkiKrc, StopsTheArmWhereItsChannelIsDeletedAndListensAgain) {
  make();
  go(170);
  run(200ms);
  ASSERT_FALSE(krc->at_rest());
  krc->reconfigure_io();
  run(500ms);
  EXPECT_TRUE(krc->at_rest());
  EXPECT_LT(a1_deg(), 90.0);
  EXPECT_EQ(krc->session(), 0u);
  EXPECT_TRUE(krc->connect());
}

TEST_F(EkiKrc, GivesTheSameBitsForTheSameSeed) {
  EkiControllerConfig config = usual();
  config.noise_sigma_deg = 0.001;
  std::string text[2];
  for (std::string& one : text) {
    EkiController fresh(config);
    fresh.start_program();
    fresh.connect();
    for (int i = 0; i < 100; ++i) {
      fresh.tick(drivers::TimePoint{1000s} + i * 4ms);
      one += fresh.drain_output();
    }
  }
  EXPECT_FALSE(text[0].empty());
  EXPECT_EQ(text[0], text[1]);
}

TEST(EkiKrcConfig, ThatMakesNoSenseIsRefused) {
  EkiControllerConfig config = usual();
  config.interrupt_ms = 13;
  EXPECT_THROW(EkiController{config}, std::invalid_argument);
  config = usual();
  config.files["CellcalEki.xml"] = "<ETHERNETKRL/>";
  EXPECT_THROW(EkiController{config}, std::invalid_argument);
}

}  // namespace
}  // namespace cellcal::sim
