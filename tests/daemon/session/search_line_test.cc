#include <gtest/gtest.h>

#include <cmath>

#include "daemon/session/interruption.h"
#include "tests/daemon/runner/fakes.h"

namespace cellcal::daemon {
namespace {

Reading slow_reading_at(double along_m) {
  Reading reading;
  reading.along_m = along_m;
  reading.contact_rad = {along_m};
  reading.settled_rad = {along_m + 0.1};
  reading.slow = true;
  return reading;
}

std::vector<Reading> readings_at(std::initializer_list<double> along) {
  std::vector<Reading> readings;
  for (double one : along) readings.push_back(slow_reading_at(one));
  return readings;
}

TEST(SearchLine, TravelAndJointsAreInverseOnTheLine) {
  calib::PlannedTouch planned;
  planned.standoff = {0.1, -0.2, 0.3};
  planned.end = {0.12, -0.25, 0.31};
  planned.search_m = 0.018;
  for (double along : {0.0, 0.0033, 0.018}) {
    EXPECT_NEAR(travel_m(planned, at_travel(planned, along)), along, 1e-15);
  }
}

TEST(SearchLine, TravelIgnoresWhatIsAcrossTheLine) {
  calib::PlannedTouch planned;
  planned.standoff = {0.0, 0.0};
  planned.end = {1.0, 0.0};
  planned.search_m = 0.018;
  EXPECT_NEAR(travel_m(planned, {0.5, 0.4}), 0.009, 1e-15);
}

TEST(Agreement, NeedsTwoReadingsWithinTheTolerance) {
  const TouchPolicy policy;
  EXPECT_FALSE(find_agreement(readings_at({0.010}), policy));
  EXPECT_FALSE(find_agreement(readings_at({0.010, 0.010061}), policy));
  EXPECT_TRUE(find_agreement(readings_at({0.010, 0.010059}), policy));
}

TEST(Agreement, TakesTheTwoThatAreClosestWhateverTheirOrder) {
  const TouchPolicy policy;
  const auto found = find_agreement(readings_at({0.0105, 0.010, 0.01002, 0.01049}), policy);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->spread_m, 0.00001, 1e-12);
  ASSERT_EQ(found->readings.size(), 2u);
  EXPECT_EQ(found->readings[0].along_m, 0.01049);
}

TEST(Agreement, OfTwoGivesTheMeanOfTheirJoints) {
  calib::PlannedTouch planned;
  planned.target = "S2";
  planned.set = calib::TouchSet::kCheck;
  const auto found = find_agreement(readings_at({0.01004, 0.010}), TouchPolicy{});
  const calib::Touch touch = touch_of(planned, *found, TouchPolicy().slow_m_s);
  EXPECT_DOUBLE_EQ(touch.joint_rad.at(0), 0.01002);
  EXPECT_DOUBLE_EQ(touch.settled_joint_rad.at(0), 0.11002);
  EXPECT_EQ(touch.target, "S2");
  EXPECT_EQ(touch.set, calib::TouchSet::kCheck);
  EXPECT_EQ(touch.readings, 2);
  EXPECT_NEAR(touch.spread_m, 0.00004, 1e-12);
  EXPECT_EQ(touch.speed_m_s, TouchPolicy().slow_m_s);
}

TEST(Agreement, OfThreeGivesTheMiddleReading) {
  TouchPolicy policy;
  policy.readings = 3;
  const auto found = find_agreement(readings_at({0.01005, 0.010, 0.01001}), policy);
  ASSERT_TRUE(found);
  EXPECT_DOUBLE_EQ(touch_of({}, *found, 0.002).joint_rad.at(0), 0.01001);
}

TEST(Agreement, DoesNotTakeWhatIsNotANumber) {
  EXPECT_FALSE(find_agreement(readings_at({NAN, NAN}), TouchPolicy{}));
}

}  // namespace
}  // namespace cellcal::daemon
