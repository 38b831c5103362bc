// Position of the arm and correction held by the controller, packet by packet and without a
// controller: conclusions from each packet, at their limits.

#include "drivers/kuka/rsi/rsi_setpoint.h"

#include <gtest/gtest.h>

#include <cmath>

#include "drivers/kuka/rsi/path_move.h"
#include "drivers/units.h"

namespace cellcal::drivers {
namespace {

using namespace std::chrono_literals;
constexpr double kCycleS = 0.004;

RsiConfig two_axes(CorrectionMode mode = CorrectionMode::kAbsolute) {
  RsiConfig config;
  config.mode = mode;
  config.hold_on = mode == CorrectionMode::kAbsolute;
  config.limits.assign(2, {-9, 9, 100 * kRadPerDeg, 400 * kRadPerDeg, 4000 * kRadPerDeg});
  config.correction_limit_deg.assign(2, 90.0);
  return config;
}

RobFrame packet(AxisAngles actual_deg, AxisAngles setpoint_deg = {}) {
  RobFrame frame;
  frame.has_ipoc = true;
  frame.axes_deg = std::move(actual_deg);
  frame.setpoint_axes_deg = std::move(setpoint_deg);
  return frame;
}

AxisAngles rad(const AxisAngles& deg) { return axes_of(deg, {}, WireAxes(deg.size(), false)); }

struct Stand {
  explicit Stand(CorrectionMode mode = CorrectionMode::kAbsolute) : config(two_axes(mode)) {}

  bool find(RobFrame frame, bool waits = false) {
    now += 4ms;
    frame.ipoc.value = ipoc += 4;
    return setpoint.find(frame, rad(frame.axes_deg), now, waits);
  }
  bool moved(const RobFrame& frame, bool moving) {
    return setpoint.start_pose_moved(frame, rad(frame.axes_deg), moving).has_value();
  }
  /// Commands this and sends it, until it is held.
  void command(AxisAngles deg) {
    const PathMove path(setpoint.commanded_rad(), rad(deg), config.limits, 0.0);
    for (double t_s = 0.0; t_s < path.duration_s() + 0.1; t_s += kCycleS) {
      setpoint.commanded_rad() = path.at(t_s);
      setpoint.next(kCycleS, false);
      ASSERT_FALSE(setpoint.beyond());
    }
  }
  /// The link is lost, and the same session resumes with its counter unchanged.
  void lose_and_come_back(const AxisAngles& actual_deg) {
    OffsetMemory link;
    link.ipoc = ipoc + 4;
    link.step = 4;
    link.seconds_per_ipoc = 0.001;
    link.t_rx = now;
    link.counts_packets = true;
    link.actual_rad = rad(actual_deg);
    setpoint.remember(link);
    setpoint.begin_session(0.1);
  }

  RsiConfig config;
  RsiSetpoint setpoint{config};
  TimePoint now{1000s};
  std::uint32_t ipoc = 5000;
};

TEST(AxesOfAPacket, AreItsOwnFirstAndTheExternalOnesBehindThem) {
  const AxisAngles six{1, 2, 3, 4, 5, 6}, two{7, 8};
  const auto in_deg = [](const AxisAngles& angles) {
    std::vector<double> deg;
    for (const double angle : angles) deg.push_back(std::round(1e6 * angle / kRadPerDeg) / 1e6);
    return deg;
  };
  EXPECT_EQ(in_deg(axes_of(six, two, WireAxes(7, false))),
            (std::vector<double>{1, 2, 3, 4, 5, 6, 7}));
  EXPECT_EQ(in_deg(axes_of(six, two, WireAxes(8, false))),
            (std::vector<double>{1, 2, 3, 4, 5, 6, 7, 8}));
  EXPECT_EQ(in_deg(axes_of(six, two, WireAxes(3, false))), (std::vector<double>{1, 2, 3}))
      << "no more than asked for";
  EXPECT_TRUE(axes_of(six, two, WireAxes(9, false)).empty()) << "none where it has fewer";
  EXPECT_TRUE(axes_of(two, two, WireAxes(4, false)).empty()) << "E1 is no A3";
  EXPECT_EQ(axes_of(six, {}, WireAxes(6, false)).size(), 6u);
}

TEST(Setpoint, KnowsNothingBeforeAPacketBehindTheLinkAndInAnotherSession) {
  Stand s;
  EXPECT_FALSE(s.setpoint.known());
  EXPECT_EQ(s.setpoint.commanded_rad(), (AxisAngles{0.0, 0.0}));
  EXPECT_EQ(s.setpoint.base_rad(), (AxisAngles{0.0, 0.0}));
  s.setpoint.remember({});
  EXPECT_FALSE(s.setpoint.known());
  ASSERT_TRUE(s.find(packet({10, 20}, {10, 20})));
  EXPECT_TRUE(s.setpoint.known());
  s.setpoint.begin_session(0.0);
  EXPECT_FALSE(s.setpoint.known()) << "everything is in doubt";
  ASSERT_TRUE(s.find(packet({10, 20}, {10, 20})));
  s.setpoint.remember({});
  EXPECT_FALSE(s.setpoint.known()) << "the link is lost";
}

TEST(Setpoint, TakesOverWhatTheDifferenceShowsOnceThePeerIsSeenToWait) {
  Stand s;
  EXPECT_FALSE(s.find(packet({12, 20}, {10, 20})));
  EXPECT_TRUE(s.setpoint.waits_for_rest());
  EXPECT_FALSE(s.setpoint.known());
  ASSERT_TRUE(s.find(packet({12, 20}, {10, 20}), true)) << "nothing moves before it is answered";
  EXPECT_NEAR(s.setpoint.hold()[0], 2.0, 1e-9);
  EXPECT_NEAR(s.setpoint.hold()[1], 0.0, 1e-9);
  EXPECT_NEAR(s.setpoint.base_rad()[0], 10 * kRadPerDeg, 1e-12);
}

// ---- ASPos: a new session, or a simulator whose ASPos includes the correction ---------------------

TEST(Setpoint, HoldsAndNamesWhatExceedsALimit) {
  Stand s;
  ASSERT_TRUE(s.find(packet({10, 20}, {10, 20})));
  s.command({12, 20});
  const std::span<const double> before = s.setpoint.again();
  const std::vector<double> held(before.begin(), before.end());
  const AxisAngles at = s.setpoint.commanded_rad();
  s.setpoint.commanded_rad()[1] += 1 * kRadPerDeg;  // 250 deg/s, 100 allowed
  const std::span<const double> reply = s.setpoint.next(kCycleS, false);
  ASSERT_TRUE(s.setpoint.beyond());
  EXPECT_EQ(std::vector<double>(reply.begin(), reply.end()), held);
  for (std::size_t i = 0; i < at.size(); ++i)
    EXPECT_NEAR(s.setpoint.commanded_rad()[i], at[i], 1e-5 * kRadPerDeg);
  s.command({12, 20.1});
}

TEST(StartPose, ThatChangesAtRestIsANewSession) {
  Stand s;
  ASSERT_TRUE(s.find(packet({10, 20}, {10, 20})));
  EXPECT_FALSE(s.moved(packet({10, 20}, {10, 20}), false));
  EXPECT_FALSE(s.moved(packet({10, 20}, {10.009, 20}), false)) << "a digit of it";
  EXPECT_TRUE(s.moved(packet({10, 20}, {10, 20.011}), false));
  EXPECT_FALSE(s.moved(packet({10, 20}, {}), false)) << "not sent";
  EXPECT_FALSE(s.moved(packet({10, 20}, {13}), false)) << "not of every axis";
}

TEST(StartPose, OfTheVeryFirstPacketIsWhatTheNextIsComparedWith) {
  Stand s;
  ASSERT_TRUE(s.find(packet({10, 20}, {10, 20})));
  EXPECT_TRUE(s.moved(packet({13, 20}, {13, 20}), false)) << "another session from the second on";
}

TEST(StartPose, ThatComesLaterIsTakenFromThereOn) {
  Stand s;
  ASSERT_TRUE(s.setpoint.session_starts(0.0));
  ASSERT_TRUE(s.find(packet({10, 20})));
  EXPECT_FALSE(s.moved(packet({10, 20}, {10, 20}), false));
  EXPECT_TRUE(s.moved(packet({11, 20}, {11, 20}), false));
}

/// A known session at (10, 20), commanded to (11, 20).
struct FollowingSetpoint : testing::Test, Stand {
  void SetUp() override { begin(); }
  void begin() {
    ASSERT_TRUE(find(packet({10, 20}, {10, 20})));
    command({11, 20});
  }
};

TEST_F(FollowingSetpoint, AMovingArmWhereItIsCommandedToBe) {
  EXPECT_FALSE(moved(packet({11.009, 20}, {11.009, 20}), true));
  // From then on it is known to include the correction, without information on sessions.
  EXPECT_FALSE(moved(packet({10.5, 20}, {10.7, 20}), false));
}
TEST_F(FollowingSetpoint, NoArmAtRest) { EXPECT_TRUE(moved(packet({11, 20}, {11, 20}), false)); }
TEST_F(FollowingSetpoint, NoOtherPlaceThanTheCommandedOne) {
  EXPECT_TRUE(moved(packet({11.011, 20}, {11.011, 20}), true));
}
TEST_F(FollowingSetpoint, NoOtherPlaceThanTheArms) {
  EXPECT_TRUE(moved(packet({11.011, 20}, {11, 20}), true));
}
TEST_F(FollowingSetpoint, NotWhereItWasSeenToStayBehindTheArm) {
  EXPECT_FALSE(moved(packet({10.021, 20}, {10, 20}), true));
  EXPECT_TRUE(moved(packet({11, 20}, {11, 20}), true));
}
TEST_F(FollowingSetpoint, StillWhereItWasBehindByWhatServosLeave) {
  EXPECT_FALSE(moved(packet({10.019, 20}, {10, 20}), true));
  EXPECT_FALSE(moved(packet({11, 20}, {11, 20}), true));
}
TEST_F(FollowingSetpoint, NotBeforeItIsKnownWhatTheControllerHolds) {
  setpoint.begin_session(0.0);
  EXPECT_FALSE(moved(packet({10, 20}, {10, 20}), true));
  EXPECT_TRUE(moved(packet({11, 20}, {11, 20}), true));
}
TEST_F(FollowingSetpoint, InOneSessionProvesNothingOfTheNext) {
  EXPECT_FALSE(moved(packet({11, 20}, {11, 20}), true));
  setpoint.begin_session(0.0);
  begin();
  EXPECT_TRUE(moved(packet({12, 20}, {12, 20}), false)) << "a new session";
  // Nor does a lag.
  setpoint.begin_session(0.0);
  begin();
  EXPECT_FALSE(moved(packet({10.5, 20}, {10, 20}), true));
  setpoint.begin_session(0.0);
  begin();
  EXPECT_FALSE(moved(packet({11, 20}, {11, 20}), true));
}
TEST_F(FollowingSetpoint, AndIsNoEvidenceWhenTheLinkComesBack) {
  EXPECT_FALSE(moved(packet({11, 20}, {11, 20}), true));
  lose_and_come_back({11, 20});
  ASSERT_TRUE(find(packet({11, 20}, {11, 20}))) << "by its counter";
  EXPECT_NEAR(setpoint.hold()[0], 1.0, 1e-9) << "not by ASPos, which is where the arm is";
  EXPECT_NEAR(setpoint.base_rad()[0], 10 * kRadPerDeg, 1e-12);
}

TEST(StartPose, OfTooFewAxesIsNoEvidence) {
  Stand s;
  EXPECT_FALSE(s.find(packet({10, 20}, {10})));
  ASSERT_TRUE(s.setpoint.session_starts(0.0));
  EXPECT_TRUE(s.find(packet({10, 20}, {10})));
}

// ---- RELATIVE --------------------------------------------------------------------------------------

TEST(RelativeSetpoint, TakesAsposForItsZeroAndHoldsWhatTheArmShows) {
  Stand s(CorrectionMode::kRelative);
  ASSERT_TRUE(s.find(packet({10.015, 20}, {10, 20})));
  EXPECT_EQ(s.setpoint.base_rad(), rad({10, 20}));
  s.setpoint.commanded_rad() = rad({10.015, 20});
  EXPECT_NEAR(s.setpoint.next(kCycleS, true)[0], 0.0, 1e-9) << "it stands where it is";
}

TEST(RelativeSetpoint, WithoutAsposTheSumOfARunningSessionCannotBeKnown) {
  for (const auto& [axis, sum_deg, known] :
       {std::tuple{0, 0.019, true}, {0, 0.021, false}, {1, -0.021, false}, {1, 1.0, false}}) {
    Stand s(CorrectionMode::kRelative);
    ASSERT_TRUE(s.setpoint.session_starts(0.0));
    ASSERT_TRUE(s.find(packet({10, 20})));
    AxisAngles there{10, 20};
    there[static_cast<std::size_t>(axis)] += sum_deg;
    s.command(there);
    s.lose_and_come_back(there);
    EXPECT_EQ(s.find(packet(there)), known) << sum_deg << ": some increments may have been lost";
    EXPECT_EQ(s.setpoint.known(), known);
    EXPECT_FALSE(s.setpoint.waits_for_rest());
    if (known) {
      EXPECT_NEAR(s.setpoint.base_rad()[0], 10 * kRadPerDeg, 1e-12);
    }
  }
}

}  // namespace
}  // namespace cellcal::drivers
