// Touches with a single fast contact: conditions, and start of the search.

#include <limits>

#include "daemon/session/interruption.h"
#include "walk.h"

namespace cellcal::daemon::testing {
namespace {

using drivers::MoveKind;

/// At the end of the fast search for the second touch, which needs no confirmation after the first.
struct SecondTouch {
  SecondTouch() {
    walk.plan->touches[0].target = walk.plan->touches[1].target = "S1";
    walk.state.policy.confirm_every = 8;
    walk.to_slow_search();
    walk.to_next_search();
    walk.contact(0.11, 0.1102);
    EXPECT_EQ(walk.state.phase, Phase::kRecording);
  }
  void record() {
    walk.on(EventKind::kRecorded);
    EXPECT_EQ(walk.state.phase, Phase::kRetreat);
  }
  void assess(double travel_m, double sigma_m) {
    walk.on(EventKind::kAssessed, [&](Event& event) {
      assessed(event).expected = std::make_shared<const std::vector<calib::ExpectedContact>>(
          std::vector<calib::ExpectedContact>{{}, {travel_m, sigma_m}});
    });
  }
  /// From the record of the first touch to the search.
  void to_fast_search() {
    if (walk.state.phase == Phase::kRecording) record();
    walk.on(EventKind::kArrived);
    EXPECT_EQ(walk.state.phase, Phase::kArmingFast);
    walk.on(EventKind::kArmed);
  }
  Walk walk;
};

TEST(OneFastContact, UnderAnOverrideMakesATouchWithTheSpeedThatItLeaves) {
  SecondTouch second;
  second.to_fast_search();
  second.walk.on(EventKind::kLinks, [](Event& event) {
    links(event).override_percent = 50;
    links(event).override_slows = true;
  });
  second.walk.contact(0.21, 0.2102);
  EXPECT_NEAR(second.walk.the<RecordTouch>().touch.speed_m_s, 0.005, 1e-12);
}

TEST(OneFastContact, MakesATouchWithItsOwnPlaceAndSpeed) {
  SecondTouch second;
  Walk& walk = second.walk;
  second.to_fast_search();
  walk.contact(0.21, 0.2102);
  EXPECT_EQ(walk.state.phase, Phase::kRecording);
  EXPECT_EQ(walk.the<RecordReading>().number, 0);
  const calib::Touch& touch = walk.the<RecordTouch>().touch;
  EXPECT_EQ(walk.the<RecordTouch>().index, 1u);
  EXPECT_EQ(touch.joint_rad, (std::vector<double>{0.21}));
  EXPECT_EQ(touch.settled_joint_rad, (std::vector<double>{0.2102}));
  EXPECT_EQ(touch.readings, 1);
  EXPECT_EQ(touch.spread_m, 0.0);
  EXPECT_EQ(touch.speed_m_s, 0.010);
  EXPECT_EQ(touch.time, "2026-01-02T03:04:05.000Z");
  EXPECT_EQ(walk.timeout_s(), 10.0);
  walk.on(EventKind::kRecorded);
  EXPECT_EQ(walk.the<BeginMove>().move.kind, MoveKind::kRetreat);
  EXPECT_EQ(walk.the<BeginMove>().move.target_rad, (drivers::AxisAngles{0.19}));
}

TEST(OneFastContact, IsSearchedForAtTheTouchsOwnSpeedWhereItHasOne) {
  SecondTouch second;
  Walk& walk = second.walk;
  second.to_fast_search();
  const double usual_s = walk.the<BeginMove>().move.cruise_s;
  SecondTouch slower;
  Walk& other = slower.walk;
  other.plan->touches[1].search_m_s = 0.004;
  slower.to_fast_search();
  EXPECT_NEAR(other.the<BeginMove>().move.cruise_s, 2.5 * usual_s, 1e-9);
  other.contact(0.21, 0.2102);
  EXPECT_EQ(other.the<RecordTouch>().touch.speed_m_s, 0.004);
}

TEST(OneFastContact, IsConfirmedAtTheFirstTouchOfATargetAndAtEveryEighth) {
  SecondTouch other_target;
  other_target.walk.plan->touches[1].target = "S2";
  other_target.to_fast_search();
  other_target.walk.contact(0.21, 0.2102);
  EXPECT_EQ(other_target.walk.state.phase, Phase::kBackingOff);

  for (const std::size_t done : {7u, 8u, 9u, 16u}) {
    SecondTouch second;
    second.to_fast_search();
    const auto plan = std::make_shared<calib::Plan>(line_plan(done + 1));
    for (calib::PlannedTouch& touch : plan->touches) touch.target = "S1";
    plan->touches[done] = second.walk.plan->touches[1];
    second.walk.state.plan = plan;
    second.walk.state.done = done;
    second.walk.contact(0.21, 0.2102);
    EXPECT_EQ(second.walk.state.phase, done % 8 == 0 ? Phase::kBackingOff : Phase::kRecording);
  }
}

TEST(OneFastContact, IsConfirmedBehindNoiseInTheSameSearch) {
  SecondTouch second;
  second.to_fast_search();
  second.walk.on(EventKind::kRevoked, [](Event& event) { move(event).at_rad = {0.205}; });
  second.walk.on(EventKind::kArrived);
  second.walk.on(EventKind::kArmed);
  ASSERT_EQ(second.walk.state.phase, Phase::kFastSearch);
  second.walk.contact(0.21, 0.2102);
  EXPECT_EQ(second.walk.state.phase, Phase::kBackingOff);
}

TEST(OneFastContact, IsConfirmedWhereItsStampOrItsBouncesAreNotThoseOfASoundOne) {
  const TouchPolicy policy;
  Reading reading;
  reading.along_m = 0.010;
  reading.bounces = policy.most_bounces;
  reading.time_sigma_s = 0.99 * policy.most_stamp_m / policy.fast_m_s;
  EXPECT_FALSE(is_surprising(reading, {}, policy));
  Reading bouncing = reading;
  ++bouncing.bounces;
  EXPECT_TRUE(is_surprising(bouncing, {}, policy));
  Reading vague = reading;
  vague.time_sigma_s = 1.01 * policy.most_stamp_m / policy.fast_m_s;
  EXPECT_TRUE(is_surprising(vague, {}, policy));
  vague.time_sigma_s = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(is_surprising(vague, {}, policy));
}

TEST(OneFastContact, IsConfirmedWhereItIsNotWhereTheTouchesSoFarExpectIt) {
  for (const double off_sigmas : {-5.2, -4.8, 4.8, 5.2}) {
    SecondTouch second;
    second.assess(0.010, 0.0001);
    second.to_fast_search();
    const double at = 0.21 + off_sigmas * 0.0001;
    second.walk.contact(at, at + 0.0002);
    EXPECT_EQ(second.walk.state.phase,
              std::abs(off_sigmas) > 5.0 ? Phase::kBackingOff : Phase::kRecording)
        << off_sigmas;
  }
}

TEST(ASearch, BeginsNearWhatTheTouchesSoFarExpect) {
  SecondTouch second;
  Walk& walk = second.walk;
  second.assess(0.010, 0.0005);
  second.record();
  // Six sigmas and a millimetre ahead.
  const drivers::Move& move = walk.the<BeginMove>().move;
  EXPECT_EQ(move.kind, MoveKind::kRetreat);
  ASSERT_EQ(move.via.size(), 3u);
  EXPECT_NEAR(move.via[0].at_rad.at(0), 0.09, 1e-12);
  EXPECT_NEAR(move.via[1].at_rad.at(0), 0.15, 1e-12);
  EXPECT_NEAR(move.via[2].at_rad.at(0), 0.20, 1e-12);
  EXPECT_NEAR(move.target_rad.at(0), 0.206, 1e-12);
  walk.on(EventKind::kArrived);
  EXPECT_NEAR(static_cast<double>(walk.the<ArmSensor>().lifetime.count()), 3800.0, 1.0);
  walk.on(EventKind::kArmed);
  expect_move(walk, MoveKind::kSearch, 0.218, 1.2, 3 * 1.2 + 10);
  // Earlier than expected: still a contact with the sphere, to be confirmed.
  walk.contact(0.2062, 0.2064);
  EXPECT_EQ(walk.state.phase, Phase::kBackingOff);
}

TEST(ASearch, BeginsWhereWasExpectedWhenTheArmSetOut) {
  SecondTouch second;
  second.record();
  second.assess(0.010, 0.0005);
  second.to_fast_search();
  expect_move(second.walk, MoveKind::kSearch, 0.218, 1.8, 3 * 1.8 + 10);
}

TEST(ASearch, BeginsAtTheStandoffWhereNothingIsKnown) {
  SecondTouch second;
  second.to_fast_search();
  expect_move(second.walk, MoveKind::kSearch, 0.218, 1.8, 3 * 1.8 + 10);
}

TEST(ASearch, BeginsNoNearerThanTwoMillimetresAndAtMostFiveBehindTheNominalSurface) {
  const TouchPolicy policy;
  calib::PlannedTouch planned = line_plan(1).touches[0];
  planned.expected_m = 0.012;
  EXPECT_NEAR(approach_m(planned, {0.011, 1e-5}, policy), 0.009, 1e-12);
  EXPECT_NEAR(approach_m(planned, {0.011, 1e-3}, policy), 0.004, 1e-12);
  EXPECT_NEAR(approach_m(planned, {0.016, 1e-5}, policy), 0.014, 1e-12);
  EXPECT_NEAR(approach_m(planned, {0.020, 1e-5}, policy), 0.015, 1e-12);
  EXPECT_NEAR(approach_m(planned, {0.020, 1e-3}, policy), 0.010, 1e-12);
  EXPECT_EQ(approach_m(planned, {0.0021, 1e-5}, policy), 0.0);  // not worth a move
  EXPECT_EQ(approach_m(planned, {0.011, 0.01}, policy), 0.0);
  EXPECT_EQ(approach_m(planned, {0.011, 0.0}, policy), 0.0);
  const double none = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(approach_m(planned, {none, 1e-5}, policy), 0.0);
  EXPECT_EQ(approach_m(planned, {0.011, none}, policy), 0.0);
  planned.may_miss = true;  // a search for the sphere
  EXPECT_EQ(approach_m(planned, {0.011, 1e-5}, policy), 0.0);
}

TEST(ASearch, ForATouchChosenByWhatIsKnownHasItsExpectationFromTheChoice) {
  Walk walk;
  walk.state.policy.confirm_every = 8;
  walk.state.one_by_one = true;
  walk.state.done = 1;
  walk.state.met = {walk.plan->touches[0].target};
  walk.plan->touches.resize(1);
  walk.plan->touches[0].expected_m = 0.010;
  walk.plan->touches[0].expected_sigma_m = 0.0001;
  walk.to_routing();
  walk.on(EventKind::kRouted);
  walk.on(EventKind::kArrived);
  walk.on(EventKind::kArmed);
  expect_move(walk, MoveKind::kSearch, 0.118, 1.0, 3 * 1.0 + 10);
  walk.contact(0.1106, 0.1107);
  EXPECT_EQ(walk.state.phase, Phase::kBackingOff) << "six sigmas off";
}

}  // namespace
}  // namespace cellcal::daemon::testing
