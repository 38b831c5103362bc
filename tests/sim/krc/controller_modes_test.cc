// Corrections of all kinds, faults of the motion system, and the operator.

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "calib/model/kinematics.h"
#include "calib/model/robot.h"
#include "drivers/units.h"
#include "sim/krc/cartesian_arm.h"
#include "sim/krc/controller.h"
#include "tests/sim/krc/arm_cell.h"

namespace cellcal::sim {
namespace {

using namespace std::chrono_literals;

class Modes : public ::testing::Test {
 protected:
  void make(ControllerConfig config = {}) {
    krc = std::make_unique<Controller>(config);
    krc->rsi_on();
  }
  void tick() { packet = std::string(krc->tick(now += krc->cycle())); }
  void answer(const std::string& inside) {
    krc->receive("<Sen Type=\"ImFree\">" + inside + "<IPOC>" + std::to_string(krc->ipoc()) +
                 "</IPOC></Sen>");
  }
  void cycles(int n, const std::string& inside) {
    for (int i = 0; i < n; ++i) {
      tick();
      answer(inside);
    }
  }

  std::unique_ptr<Controller> krc;
  drivers::TimePoint now{100s};
  std::string packet;
};

TEST_F(Modes, RelativeCorrectionsAddUpAndAreClampedAsAWhole) {
  ControllerConfig config;
  config.mode = RsiMode::kRelative;
  config.hold_on = false;
  config.clamp_deg = 5.0;
  make(config);
  cycles(20, "<AK A1=\"0.1\"/>");
  tick();
  EXPECT_NEAR(krc->correction_deg()[0], 2.0, 1e-9);
  answer("<AK A1=\"0\"/>");
  cycles(10, "<AK A1=\"0\"/>");
  EXPECT_NEAR(krc->correction_deg()[0], 2.0, 1e-9);
  cycles(100, "<AK A1=\"0.1\"/>");
  EXPECT_EQ(krc->correction_deg()[0], 5.0);
  cycles(11, "<AK A1=\"-0.1\"/>");
  EXPECT_NEAR(krc->correction_deg()[0], 4.0, 1e-9) << "what was clamped away is not owed";
}

TEST_F(Modes, RelativeWithHoldonRepeatsTheLastStepForEveryLateReply) {
  for (const bool hold : {true, false}) {
    ControllerConfig config;
    config.mode = RsiMode::kRelative;
    config.hold_on = hold;
    make(config);
    cycles(1, "<AK A1=\"0.1\"/>");
    for (int i = 0; i < 10; ++i) tick();
    EXPECT_NEAR(krc->correction_deg()[0], hold ? 1.0 : 0.1, 1e-9);
  }
}

TEST_F(Modes, CartesianCorrectionMovesTheTcpAlongTheBaseOrTheTool) {
  const auto arm = make_cartesian_arm(arm_cell());
  for (const CorrectionFrame system : {CorrectionFrame::kBase, CorrectionFrame::kTool}) {
    ControllerConfig config;
    config.arm = arm;
    config.cartesian_system = system;
    make(config);
    const KukaFrame from = arm->frame(krc->setpoint_rad());
    cycles(3, "<RKorr X=\"10\" Y=\"-5\" Z=\"2.5\" A=\"0\" B=\"0\" C=\"0\"/>");
    const KukaFrame to = arm->frame(krc->setpoint_rad());
    EXPECT_NEAR(std::hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]),
                std::hypot(10, 5, 2.5), 1e-5);
    if (system == CorrectionFrame::kBase) {
      EXPECT_NEAR(to[0] - from[0], 10.0, 1e-5);
      EXPECT_NEAR(to[1] - from[1], -5.0, 1e-5);
    } else {
      // In home the tool's z points down: KUKA's flange, A5 = 90 deg.
      EXPECT_NEAR(to[2] - from[2], -2.5, 1e-5);
    }
    for (std::size_t i = 3; i < 6; ++i)
      EXPECT_NEAR(std::sin((to[i] - from[i]) * drivers::kRadPerDeg), 0.0, 1e-7);
  }
}

TEST_F(Modes, HomeOfTheArmIsWhereThePendantShowsIt) {
  const auto arm = make_cartesian_arm(arm_cell());
  make();
  const KukaFrame home = arm->frame(krc->setpoint_rad());
  EXPECT_NEAR(home[0], 800.0, 1e-6);
  EXPECT_NEAR(home[1], 0.0, 1e-6);
  EXPECT_NEAR(home[2], 1005.0, 1e-6);
}

TEST_F(Modes, PacketsTellTheTcpWithTheCorrectionAndWithout) {
  ControllerConfig config;
  config.arm = make_cartesian_arm(arm_cell());
  config.send_cartesian_setpoint = true;
  config.precision = 1;
  make(config);
  cycles(100, "<RKorr X=\"-20\"/>");
  EXPECT_NE(packet.find("<RIst X=\"780.0\""), std::string::npos) << packet;
  EXPECT_NE(packet.find("<RSol X=\"800.0\""), std::string::npos) << packet;
  EXPECT_EQ(krc->cartesian_correction()[0], -20.0);
}

TEST_F(Modes, CartesianCorrectionsAreClampedInSilenceAndMonitored) {
  ControllerConfig config;
  config.arm = make_cartesian_arm(arm_cell());
  config.clamp_mm = 5.0;
  make(config);
  cycles(5, "<RKorr Z=\"-8\"/>");
  EXPECT_EQ(krc->cartesian_correction()[2], -5.0);
  EXPECT_EQ(krc->message(), "");
  config.monitor_mm = 4.0;
  make(config);
  cycles(3, "<RKorr Z=\"-8\"/>");
  EXPECT_EQ(krc->phase(), RsiPhase::kFaulted);
  EXPECT_NE(krc->message().find("POSCORRMON"), std::string::npos);
}

TEST_F(Modes, CorrectionsThatTheArmCannotFollowStopIt) {
  ControllerConfig config;
  config.arm = make_cartesian_arm(arm_cell());
  config.clamp_mm = 5000;
  config.monitor_mm = 5000;
  make(config);
  cycles(3, "<RKorr X=\"3000\"/>");
  EXPECT_EQ(krc->message(), "Work envelope exceeded");
  config.arm = nullptr;
  make(config);
  cycles(3, "<RKorr X=\"1\"/>");
  EXPECT_NE(krc->message().find("no geometry"), std::string::npos);
  config.soft_min_rad.assign(6, -95 * drivers::kRadPerDeg);
  config.soft_max_rad.assign(6, 95 * drivers::kRadPerDeg);
  make(config);
  cycles(3, "<AK A2=\"-6\"/>");
  EXPECT_EQ(krc->message(), "Software limit switch A2");
}

TEST_F(Modes, MoreThanTheDrivesCanDoIsAGearTorqueFault) {
  ControllerConfig config;
  config.max_acceleration_rad_s2.assign(6, 1000 * drivers::kRadPerDeg);
  make(config);
  // 0.015 deg in a cycle of 4 ms from rest: 940 deg/s^2.
  cycles(2, "<AK A3=\"0.015\"/>");
  tick();
  EXPECT_EQ(krc->phase(), RsiPhase::kRunning) << krc->message();
  answer("<AK A3=\"0.046\"/>");
  cycles(2, "<AK A3=\"0.046\"/>");
  EXPECT_EQ(krc->message(), "Command gear torque A3");
}

TEST_F(Modes, T1WatchesTheTcpFor250MillimetresPerSecond) {
  ControllerConfig config;
  config.arm = make_cartesian_arm(arm_cell());
  for (const double mm : {0.9, 1.1}) {  // per 4 ms
    make(config);
    krc->mode(OperatingMode::kT1);
    EXPECT_EQ(krc->message(), "Operating mode changed");
    krc->rsi_on();
    cycles(3, "<RKorr Y=\"" + std::to_string(mm) + "\"/>");
    EXPECT_EQ(krc->phase(), mm < 1.0 ? RsiPhase::kRunning : RsiPhase::kFaulted) << krc->message();
  }
  config.arm = nullptr;
  config.max_speed_rad_s.assign(6, 100 * drivers::kRadPerDeg);
  make(config);
  krc->mode(OperatingMode::kT1);
  krc->rsi_on();
  cycles(3, "<AK A1=\"0.1\"/>");
  EXPECT_NE(krc->message().find("T1"), std::string::npos);
}

TEST_F(Modes, StartKeyIsNeededInT1AndItsReleaseStops) {
  make();
  krc->start_key(false);
  cycles(2, "");
  EXPECT_EQ(krc->phase(), RsiPhase::kRunning) << "not in AUT";
  krc->mode(OperatingMode::kT1);
  krc->rsi_on();
  EXPECT_EQ(krc->message(), "Start key is not held");
  krc->start_key(true);
  krc->rsi_on();
  cycles(2, "");
  EXPECT_EQ(krc->phase(), RsiPhase::kRunning);
  krc->start_key(false);
  tick();
  EXPECT_TRUE(packet.empty());
}

TEST_F(Modes, EmergencyStopEndsPacketsAndHasToBeReleasedBeforeAReset) {
  make();
  cycles(50, "<AK A1=\"1\"/>");
  krc->emergency_stop(true);
  tick();
  EXPECT_TRUE(packet.empty());
  EXPECT_EQ(krc->message(), "EMERGENCY STOP");
  const std::vector<double> stood = krc->actual_rad_at(now);
  krc->rsi_on();
  tick();
  EXPECT_TRUE(packet.empty()) << "still pressed";
  krc->emergency_stop(false);
  tick();
  EXPECT_TRUE(packet.empty()) << "nothing starts by itself";
  krc->rsi_on();
  tick();
  EXPECT_FALSE(packet.empty());
  EXPECT_EQ(krc->actual_rad_at(now), stood);
  krc->drives(false);
  krc->rsi_on();
  EXPECT_EQ(krc->message(), "Drives are off");
}

TEST_F(Modes, OfAnotherHabitAnEmergencyStopLeavesRsiOnAndStartLetsTheArmGoOn) {
  ControllerConfig config;
  config.rsi_outlives_stop = true;
  make(config);
  cycles(50, "<AK A1=\"1\"/>");
  krc->emergency_stop(true);
  const std::vector<double> stood = krc->actual_rad_at(now);
  cycles(50, "<AK A1=\"2\"/>");
  EXPECT_FALSE(packet.empty());
  EXPECT_EQ(krc->phase(), RsiPhase::kRunning);
  krc->start_key(true);
  cycles(50, "<AK A1=\"2\"/>");
  EXPECT_EQ(krc->actual_rad_at(now), stood) << "still pressed";
  krc->emergency_stop(false);
  cycles(50, "<AK A1=\"2\"/>");
  EXPECT_EQ(krc->actual_rad_at(now), stood) << "not started";
  krc->start_key(true);
  cycles(100, "<AK A1=\"2\"/>");
  EXPECT_GT(krc->actual_rad_at(now)[0], stood[0] + 0.5 * 0.0174);
}

TEST_F(Modes, StopObjectDoesWhatItsModeSays) {
  ControllerConfig config;
  for (const RsiStop mode : {RsiStop::kInfo, RsiStop::kPathStop, RsiStop::kFastStop}) {
    config.stop_mode = mode;
    make(config);
    cycles(50, "<AK A1=\"1\"/>");
    cycles(1, "<AK A1=\"1\"/><Stop>1</Stop>");
    cycles(100, "<AK A1=\"2\"/>");
    EXPECT_FALSE(packet.empty()) << "RSI goes on";
    EXPECT_NE(krc->message().find("STOP object"), std::string::npos);
    const double a1 = krc->setpoint_rad()[0] / drivers::kRadPerDeg;
    if (mode == RsiStop::kInfo) {
      EXPECT_NEAR(a1, 2.0, 1e-9);
    } else {
      EXPECT_NEAR(a1, 1.0, 0.01) << "corrections have no effect any more";
    }
  }
}

TEST_F(Modes, StopThatIsSetInTheFirstReplyIsARisingEdge) {
  ControllerConfig config;
  config.stop_mode = RsiStop::kInfo;
  make(config);
  cycles(2, "<Stop>1</Stop>");
  EXPECT_NE(krc->message(), "");
}

TEST_F(Modes, Krc2OpensWithAPacketOfIpocAlone) {
  ControllerConfig config;
  config.first_frame_only_ipoc = true;
  config.cycle_ms = 12;
  make(config);
  tick();
  EXPECT_EQ(packet, "<Rob Type=\"KUKA\"><IPOC>" + std::to_string(krc->ipoc()) + "</IPOC></Rob>");
  answer("");
  tick();
  EXPECT_NE(packet.find("<AIPos"), std::string::npos);
  EXPECT_EQ(krc->late(), 0u);
}

TEST_F(Modes, ExternalAxesHaveAnElementOfTheirOwn) {
  ControllerConfig config;
  config.start_rad.push_back(0.0);
  make(config);
  cycles(3, "<AK A1=\"1\"/><EK E1=\"2.5\"/>");
  EXPECT_EQ(krc->correction_deg()[6], 2.5);
  EXPECT_NE(packet.find("<EIPos E1="), std::string::npos);
}

}  // namespace
}  // namespace cellcal::sim
