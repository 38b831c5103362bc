// Position of the arm read over EKI outside a session: with the emulated controller in virtual time and on real
// sockets, and with streams that are not EKI.

#include <gtest/gtest.h>

#include <functional>

#include "drivers/kuka/eki/eki_aside.h"
#include "drivers/kuka/krl/krl_files.h"
#include "drivers/units.h"
#include "sim/krc/eki_server.h"

namespace cellcal::drivers {
namespace {

using namespace std::chrono_literals;

const std::vector<double> kJogged{10 * kRadPerDeg, -80 * kRadPerDeg, 95 * kRadPerDeg,
                                  -5 * kRadPerDeg, 60 * kRadPerDeg,  170 * kRadPerDeg};

sim::EkiControllerConfig usual() {
  sim::EkiControllerConfig config;
  config.files = eki_files(EkiFilesConfig());
  return config;
}

struct Rig {
  EkiPosition run() {
    for (int i = 0; i < 2000 && !reading.ended(); ++i) {
      now += krc.cycle();
      if (each) each();
      krc.tick(now);
      reading.on_bytes(mangle(krc.drain_output()), now);
      reading.on_tick(now);
      krc.receive(reading.drain_output());
    }
    EXPECT_TRUE(reading.ended());
    return position_of(reading.result().value_or(EkiFrameResult{}));
  }

  TimePoint now{1h};
  sim::EkiController krc{usual()};
  bool connected = krc.connect();
  EkiFrameExchange reading{now};
  std::function<std::string(std::string)> mangle = [](std::string text) { return text; };
  std::function<void()> each;
};

TEST(EkiPosition, IsWhereTheArmWasJoggedToWhicheverProgramIsSelected) {
  Rig rig;
  ASSERT_TRUE(rig.connected);
  rig.krc.place(kJogged);
  const EkiPosition position = rig.run();
  ASSERT_EQ(position.trouble, EkiPositionTrouble::kNone);
  ASSERT_EQ(position.axes_deg.size(), kJogged.size());
  for (std::size_t i = 0; i < kJogged.size(); ++i)
    EXPECT_NEAR(position.axes_deg[i], kJogged[i] / kRadPerDeg, 1e-3) << i;
  EXPECT_EQ(rig.krc.session(), 0U) << "nobody is obeyed by it";
  EXPECT_EQ(rig.krc.moves(), 0U);
}

TEST(EkiPosition, AnArmThatIsStillJoggedHasNone) {
  Rig rig;
  std::vector<double> at = kJogged;
  rig.each = [&] {
    at[0] += 0.001 * kRadPerDeg;
    rig.krc.place(at);
  };
  const EkiPosition position = rig.run();
  EXPECT_EQ(position.trouble, EkiPositionTrouble::kMoves);
  EXPECT_TRUE(position.axes_deg.empty());
}

TEST(EkiPosition, AnArmThatComesToRestIsReadThen) {
  Rig rig;
  std::vector<double> at = kJogged;
  int cycles = 0;
  rig.each = [&] {
    if (++cycles < 200) at[0] += 0.001 * kRadPerDeg;
    rig.krc.place(at);
  };
  const EkiPosition position = rig.run();
  ASSERT_EQ(position.trouble, EkiPositionTrouble::kNone);
  EXPECT_NEAR(position.axes_deg[0], at[0] / kRadPerDeg, 1e-3);
}

TEST(EkiPosition, AControllerThatObeysSomebodyGivesNone) {
  Rig rig;
  rig.mangle = [](std::string text) {
    const auto at = text.find("Session=\"0\"");
    if (at != std::string::npos) text.replace(at, 11, "Session=\"7\"");
    return text;
  };
  EXPECT_EQ(rig.run().trouble, EkiPositionTrouble::kInSession);
}

TEST(EkiPosition, SilenceAndDamageAreNoPosition) {
  Rig mute;
  mute.krc.mute(true);
  EXPECT_EQ(mute.run().trouble, EkiPositionTrouble::kNoState);
  Rig damaged;
  damaged.mangle = [](std::string text) {
    return text.empty() ? text : text.substr(0, text.size() / 2) + "</RobotState>";
  };
  EXPECT_EQ(damaged.run().trouble, EkiPositionTrouble::kNoState);
  Rig not_finite;
  not_finite.mangle = [](std::string text) {
    const auto at = text.find("A1=\"");
    if (at != std::string::npos) text.replace(at, 5, "A1=\"nan");
    return text;
  };
  EXPECT_EQ(not_finite.run().trouble, EkiPositionTrouble::kNoState);
  Rig endless;
  endless.mangle = [](const std::string&) { return "<RobotState " + std::string(9000, 'x'); };
  EXPECT_EQ(endless.run().trouble, EkiPositionTrouble::kNotAStream);
}

TEST(EkiPositionSockets, ReadTheEmulatedControllerOnceAndAgain) {
  sim::EkiServer krc(usual(), {.address = "127.0.0.1", .port = 0});
  krc.start();
  for (int i = 0; i < 2; ++i) {
    krc.with([](sim::EkiController& controller) { controller.place(kJogged); });
    const EkiPosition position = read_position("127.0.0.1", krc.port());
    ASSERT_EQ(position.trouble, EkiPositionTrouble::kNone) << position.detail;
    EXPECT_NEAR(position.axes_deg[1], -80.0, 1e-3);
  }
}

TEST(EkiPositionSockets, AddressesThatAreNoneAreNamed) {
  EXPECT_THROW(read_position("robot", 54600), std::runtime_error);
}

}  // namespace
}  // namespace cellcal::drivers
