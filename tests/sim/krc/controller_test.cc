#include "sim/krc/controller.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "drivers/kuka/krl/krl_files.h"
#include "drivers/kuka/wire/rsi_codec.h"
#include "drivers/units.h"

namespace cellcal::sim {
namespace {

using namespace std::chrono_literals;

class Krc : public ::testing::Test {
 protected:
  void make(ControllerConfig config = {}) {
    krc = std::make_unique<Controller>(config);
    krc->rsi_on();
    sentype = config.sentype;
  }
  drivers::RobFrame tick() {
    now += krc->cycle();
    packet = std::string(krc->tick(now));
    drivers::RobFrame frame;
    if (!packet.empty()) error = parser.parse_rob(packet, frame);
    return frame;
  }
  void answer(double a1_deg, std::optional<int> stop = 0, long ipoc_error = 0) {
    const double correction[6] = {a1_deg, 0, 0, 0, 0, 0};
    std::array<char, drivers::kRsiBuffer> buffer{};
    const std::string ipoc = std::to_string(static_cast<long>(krc->ipoc()) + ipoc_error);
    krc->receive(drivers::format_sen({.sentype = sentype, .contact_tag = ""}, correction, 6, stop,
                                     ipoc, buffer));
  }
  void cycles(int n, double a1_deg) {
    for (int i = 0; i < n; ++i) {
      tick();
      answer(a1_deg);
    }
  }

  std::unique_ptr<Controller> krc;
  drivers::RsiParser parser;
  drivers::WireError error = drivers::WireError::kNone;
  drivers::TimePoint now{100s};
  std::string packet, sentype;
};

TEST_F(Krc, ClockRunsWhetherAnsweredOrNotAndLateRepliesAreCounted) {
  make();
  const std::uint64_t first = krc->ipoc();
  for (int i = 1; i <= 10; ++i) {
    const drivers::RobFrame frame = tick();
    EXPECT_EQ(krc->ipoc(), first + 4 * static_cast<std::uint64_t>(i));
    EXPECT_EQ(frame.delay, i - 1);
  }
}

TEST_F(Krc, TimeoutStopsWithKss29002AndSilence) {
  ControllerConfig config;
  config.timeout_cycles = 10;
  make(config);
  for (int i = 0; i < 11; ++i) tick();
  EXPECT_EQ(krc->phase(), RsiPhase::kRunning);
  tick();
  EXPECT_EQ(krc->phase(), RsiPhase::kFaulted);
  EXPECT_NE(krc->message().find("KSS29002"), std::string::npos);
  EXPECT_TRUE(packet.empty());
  tick();
  EXPECT_TRUE(packet.empty());
}

TEST_F(Krc, TimeoutCountsInARowOrInTotalAsConfigured) {
  for (const bool total : {false, true}) {
    ControllerConfig config;
    config.timeout_cycles = 10;
    config.timeout_counts_total = total;
    make(config);
    for (int i = 0; i < 40; ++i) {
      tick();
      if (i % 2 == 0) answer(0);
    }
    EXPECT_EQ(krc->phase(), total ? RsiPhase::kFaulted : RsiPhase::kRunning);
  }
}

TEST_F(Krc, WrongSentypeIpocAndGarbageAreDiscardedWithoutAWord) {
  make();
  cycles(2, 0);
  tick();
  answer(5, 0, 4);
  krc->receive("<Sen Type=\"ImFree\"><AK A1=\"5\"/>");
  krc->receive("");
  EXPECT_EQ(tick().delay, 1U);
  sentype = "Other";
  answer(5);
  EXPECT_EQ(tick().delay, 2U);
  EXPECT_EQ(krc->correction_deg()[0], 0.0);
}

TEST_F(Krc, HoldonDecidesWhatALateReplyDoes) {
  for (const bool hold : {true, false}) {
    ControllerConfig config;
    config.hold_on = hold;
    make(config);
    cycles(5, 2.0);
    tick();
    EXPECT_EQ(krc->correction_deg()[0], 2.0);
    tick();  // that packet was not answered
    EXPECT_EQ(krc->correction_deg()[0], hold ? 2.0 : 0.0);
  }
}

TEST_F(Krc, CorrectionsAreClampedInSilence) {
  ControllerConfig config;
  config.clamp_deg = 5.0;
  make(config);
  cycles(100, 8.0);
  EXPECT_EQ(krc->correction_deg()[0], 5.0);
  EXPECT_EQ(krc->phase(), RsiPhase::kRunning);
  EXPECT_EQ(krc->message(), "");
}

TEST_F(Krc, CorrectionsEndAtTheFenceThatTheProgramSetsFromWhereTheArmStands) {
  ControllerConfig config;
  config.clamp_deg = 20.0;
  config.start_rad.assign(6, 0.0);
  config.start_rad[0] = 100.0 * drivers::kRadPerDeg;
  drivers::RsiFilesConfig files;
  files.pc_address = "10.0.0.5";
  files.correction_limit_deg = config.clamp_deg;
  files.ranges_deg.assign(6, {-110.0, 110.0});
  config.program = drivers::rsi_files(files).at("cellcal_rsi.src");
  make(config);
  cycles(100, 30.0);
  EXPECT_NEAR(krc->correction_deg()[0], 10.1, 1e-5) << "110 deg and 0.1 for the measured angle";
  make(config);
  cycles(100, -30.0);
  EXPECT_EQ(krc->correction_deg()[0], -20.0);
  config.start_rad[0] = 112.0 * drivers::kRadPerDeg;
  make(config);
  EXPECT_EQ(krc->phase(), RsiPhase::kFaulted);
  EXPECT_TRUE(krc->message().starts_with("cellcal_rsi.src:") && krc->message().ends_with(": HALT"))
      << krc->message();
}

TEST_F(Krc, MonitorStopsAndNamesItself) {
  ControllerConfig config;
  config.monitor_deg = 6.0;
  make(config);
  cycles(3, 6.5);
  EXPECT_EQ(krc->phase(), RsiPhase::kFaulted);
  EXPECT_NE(krc->message().find("KSS29000"), std::string::npos);
}

TEST_F(Krc, StepFasterThanAnAxisIsACommandVelocityFault) {
  ControllerConfig config;
  config.max_speed_rad_s.assign(6, 100 * drivers::kRadPerDeg);
  make(config);
  cycles(3, 0.39);
  EXPECT_EQ(krc->phase(), RsiPhase::kRunning);
  cycles(2, 0.80);
  EXPECT_EQ(krc->phase(), RsiPhase::kFaulted);
  EXPECT_EQ(krc->message(), "Command velocity A1");
}

TEST_F(Krc, ArmFollowsTheSetpointAsAFirstOrderLag) {
  ControllerConfig config;
  config.lag_s = 0.02;
  config.precision = 6;
  make(config);
  cycles(1, 1.0);  // accepted now, in force from the next tick on
  const drivers::RobFrame in_force = tick();
  EXPECT_EQ(in_force.axes_deg[0], 0.0);
  EXPECT_NEAR(krc->setpoint_rad()[0], 1.0 * drivers::kRadPerDeg, 1e-12);
  for (const auto t : {0us, 1000us, 2500us, 4000us}) {
    const double s = std::chrono::duration<double>(t).count();
    EXPECT_NEAR(krc->actual_rad_at(now + t)[0], (1 - std::exp(-s / 0.02)) * drivers::kRadPerDeg,
                1e-12);
  }
  const std::vector<double> ahead = krc->actual_rad_at(now + 4ms);
  answer(1.0);
  const drivers::RobFrame next = tick();
  EXPECT_NEAR(next.axes_deg[0], ahead[0] / drivers::kRadPerDeg, 1e-6)
      << "what was foreseen came true";
  EXPECT_EQ(next.setpoint_axes_deg[0], 0.0) << "ASPos does not contain the correction";
  cycles(200, 1.0);
  EXPECT_NEAR(tick().axes_deg[0], 1.0, 1e-6);
}

TEST_F(Krc, NoiseIsInTheReportAlone) {
  ControllerConfig config;
  config.noise_sigma_deg = 0.01;
  config.precision = 6;
  make(config);
  double sum = 0.0, squares = 0.0;
  constexpr int kPackets = 4000;
  for (int i = 0; i < kPackets; ++i) {
    const double a1 = tick().axes_deg[0];
    answer(0);
    sum += a1;
    squares += a1 * a1;
    EXPECT_EQ(krc->actual_rad_at(now)[0], 0.0);
  }
  EXPECT_NEAR(sum / kPackets, 0.0, 0.001);
  EXPECT_NEAR(std::sqrt(squares / kPackets), 0.01, 0.0005);
}

TEST_F(Krc, SameSeedGivesTheSameBytes) {
  ControllerConfig config;
  config.noise_sigma_deg = 0.01;
  std::string texts[2];
  for (std::string& text : texts) {
    make(config);
    now = drivers::TimePoint(100s);
    for (int i = 0; i < 50; ++i) {
      tick();
      answer(0.01 * i);
      text += packet;
    }
  }
  EXPECT_EQ(texts[0], texts[1]);
}

TEST_F(Krc, StopActsOnTheRisingEdge) {
  make();
  cycles(5, 1.0);
  tick();
  answer(1.0, 1);
  tick();
  EXPECT_EQ(krc->phase(), RsiPhase::kEnded);
  EXPECT_TRUE(packet.empty());
}

TEST_F(Krc, NewSessionStartsWhereTheArmStands) {
  make();
  cycles(300, 3.0);
  tick();
  answer(3.0, 1);
  tick();
  const std::vector<double> stood = krc->actual_rad_at(now);
  const std::uint64_t counter = krc->ipoc();
  krc->rsi_on();
  const drivers::RobFrame frame = tick();
  EXPECT_NEAR(frame.setpoint_axes_deg[0], stood[0] / drivers::kRadPerDeg, 1e-4);
  EXPECT_EQ(frame.delay, 0U);
  EXPECT_EQ(krc->correction_deg()[0], 0.0);
  EXPECT_EQ(krc->ipoc(), counter + 4);
}

TEST_F(Krc, ImpossibleConfigurationsAreRefused) {
  ControllerConfig config;
  config.lag_s = 0.0;
  EXPECT_THROW(Controller{config}, std::invalid_argument);
  config = {};
  config.start_rad.clear();
  EXPECT_THROW(Controller{config}, std::invalid_argument);
  config = {};
  config.max_speed_rad_s = {1.0};
  EXPECT_THROW(Controller{config}, std::invalid_argument);
  make();
  EXPECT_THROW(krc->place({0, 0, 0, 0, 0, 0}), std::logic_error);
}

}  // namespace
}  // namespace cellcal::sim
