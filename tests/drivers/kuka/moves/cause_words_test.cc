// Sentences of every cause: event with number and unit, location, and remedy. All other tests check
// kinds.

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "drivers/kuka/moves/cause.h"
#include "tests/drivers/said.h"

namespace cellcal::drivers {
namespace {

std::string said(const Cause& cause, bool in_space = false) {
  CoreResult result;
  result.cause = cause;
  result.ipoc = 4711;
  result.in_space = in_space;
  return said(words(result));
}

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

template <std::size_t... Kind>
std::multiset<std::string> of_every_kind(std::index_sequence<Kind...>) {
  return {said(std::variant_alternative_t<Kind, Cause>{})...};
}

TEST(CauseWords, EveryKindHasItsOwnAndThatNothingIsWrongHasNone) {
  const auto all = of_every_kind(std::make_index_sequence<std::variant_size_v<Cause>>());
  EXPECT_EQ(all.count(""), 1u);
  for (const std::string& one : all) EXPECT_EQ(all.count(one), 1u) << one;
  EXPECT_EQ(said(cause::None{}), "");
  EXPECT_EQ(said(Cause{}), "") << "what was not said is nothing";
}

TEST(CauseWords, AxesAreNamedAsControllersNumberThem) {
  EXPECT_EQ(said(cause::AboveLimit{1, 66.0, 65.0}),
            "A2: target 66.0000 deg, upper axis limit 65.0000 deg");
  EXPECT_EQ(said(cause::BelowLimit{6, -1.0, 0.0}),
            "E1: target -1.0000 deg, lower axis limit 0.0000 deg");
  EXPECT_EQ(said(cause::NotFinite{4, HUGE_VAL}), "A5: target inf is not a finite angle");
  EXPECT_EQ(said(cause::AxisCount{2, 6}), "2 axes in the target, 6 in the robot");
  EXPECT_EQ(said(cause::NotSettled{2, 0.0008, 1.0}), "A3: still moving by 0.0008 deg after 1.00 s");
}

TEST(CauseWords, WayPointsAreNamedByTheirNumber) {
  EXPECT_EQ(said(cause::AboveLimit{1, 66.0, 65.0, 3}),
            "way-point 3, A2: target 66.0000 deg, upper axis limit 65.0000 deg");
  EXPECT_EQ(said(cause::AxisCount{2, 6, 1}), "2 axes in way-point 1, 6 in the robot");
  EXPECT_TRUE(has(said(cause::CorrectionLimit{0, 31, 30, 2}), "way-point 2, A1: correction"));
  EXPECT_TRUE(has(said(cause::NearSingular{3, 20.0, 15.0, 2}), "way-point 2, near a singularity"));
  EXPECT_EQ(said(cause::BadShare{0.7, 0.5, 2}), "way-point 2, share 0.7 is not within 0 and 0.5");
  EXPECT_TRUE(has(said(cause::SearchByWayPoints{2}), "2 way-points in a search"));
  EXPECT_TRUE(has(said(cause::CruiseByWayPoints{1.5}), "cruise time 1.5 s"));
}

TEST(CauseWords, TimesAreInTheUnitThatTheyAreReadIn) {
  EXPECT_TRUE(has(said(cause::SensorLate{0.040, 0.025}),
                  "this computer was busy: sensor data 40 ms late, limit 25 ms"));
  EXPECT_TRUE(has(said(cause::SensorLate{0.0251, 0.025}), "26 ms late, limit 25 ms"));
  EXPECT_TRUE(has(said(cause::HeldUp{0.0135, 0.012, 0.011}),
                  "no packet read for 14 ms, limit 12 ms; its real-time thread did not run for 11 "
                  "ms of them"));
  EXPECT_TRUE(has(said(cause::TripUnconfirmed{0.104}),
                  "neither confirmed nor revoked the trip within 104 ms"));
  EXPECT_TRUE(has(said(cause::InputAlone{0.104}), "sensor detected nothing within 104 ms"));
  EXPECT_TRUE(has(said(cause::Silence{0.25}), "for 250 ms (last IPOC 4711)"));
  EXPECT_TRUE(has(said(cause::SessionRestarted{}), "now 4711"));
  EXPECT_TRUE(has(said(cause::NoPackets{5.0}), "no packet from the controller for 5.00 s"));
  EXPECT_TRUE(has(said(cause::StampOutside{60.0}), "60.000 s old"));
  EXPECT_TRUE(has(said(cause::NotMoving{2.02, 0}), "2.0 s (override 0 %)"));
}

TEST(CauseWords, CountsAndNumbersAreWhole) {
  EXPECT_TRUE(has(said(cause::LateReplies{3}),
                  "3 late replies during this move, counted by the controller (IPOC 4711)"));
  EXPECT_TRUE(has(said(cause::IncrementLost{1}), "1 replies of this move not accepted"));
  EXPECT_TRUE(has(said(cause::TooCoarse{1}), "angles with 1 decimals"));
  EXPECT_TRUE(has(said(cause::SessionTaken{4000000000u}), "another session (4000000000)"));
  EXPECT_TRUE(has(said(cause::ProgramAborted{17}), "(fault 17)"));
  EXPECT_EQ(said(cause::NotArmed{5}), "contact sensor is not armed (search needs arming 5)");
  EXPECT_EQ(said(cause::ArmedOtherwise{5, 8}), "contact sensor is armed with 8, search needs 5");
}

TEST(CauseWords, WhatToSetOrCheckIsNamed) {
  EXPECT_TRUE(has(said(cause::ShiftLimit{140.0, 100.0}), "limit 100.00 mm"));
  EXPECT_TRUE(has(said(cause::ShiftLimit{140.0, 100.0}), "POSCORRMON"));
  EXPECT_TRUE(has(said(cause::TurnLimit{40.0, 30.0}), "MaxRotAngle"));
  const std::string near = said(cause::NearSingular{3, 20.0, 15.0});
  for (const char* part : {"A4 would turn 20 times", "limit 15", "arm is stretched",
                           "begin the session elsewhere", "correction = \"axes\""})
    EXPECT_TRUE(has(near, part)) << near;
  EXPECT_TRUE(has(said(cause::TooCoarse{1}), "Precision"));
  EXPECT_TRUE(has(said(cause::DelayGone{}), "DEF_Delay"));
  EXPECT_TRUE(has(said(cause::NotAccepted{}), "SENTYPE"));
  EXPECT_TRUE(has(said(cause::StampOutside{60.0}), "clock is not synchronised"));
  EXPECT_TRUE(has(said(cause::InputMissed{}), "wire to the input"));
  EXPECT_TRUE(has(said(cause::InputTouched{}), "in a move other than a search"));
  EXPECT_TRUE(has(said(cause::ProgramAborted{17}), "pendant"));
  EXPECT_TRUE(has(said(cause::TooFastForFlag{0, 1.5, 1.0}), "1.5000 deg/s"));
}

TEST(CauseWords, AnArmThatDoesNotFollowIsLookedIntoWhereItIsCorrected) {
  for (const Cause& cause :
       {Cause(cause::AxisStands{0, 8.0, 5.0}), Cause(cause::AxisNotFollowing{0, 8.0, 5.0})}) {
    const std::string axes = said(cause), space = said(cause, true);
    EXPECT_TRUE(has(axes, "AXISCORR") && !has(axes, "RefCorrSys")) << axes;
    for (const char* part : {"RefCorrSys", "correction_frame", "[controller] tool"})
      EXPECT_TRUE(has(space, part)) << space;
    for (const std::string& text : {axes, space})
      EXPECT_TRUE(has(text, "A1") && has(text, "8.0000 deg") && has(text, "5.0000 deg")) << text;
  }
  EXPECT_TRUE(has(said(cause::CorrectionLimit{3, 5.1, 5.0}), "AXISCORR, AXISCORRMON"));
  EXPECT_FALSE(has(said(cause::CorrectionLimit{3, 5.1, 5.0}, true), "AXISCORR, "));
}

}  // namespace
}  // namespace cellcal::drivers
