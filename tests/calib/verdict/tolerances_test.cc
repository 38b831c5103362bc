// What comes out farther from the files than they allow is told, and withheld where chance no
// longer does it; gross errors within reason and an arm that warms up hold nothing back.

#include "calib/verdict/tolerances.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "calib/identify/identify.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::make_touches;
using testing::plain_truth;

const std::vector<Touch>& touches() {
  static const std::vector<Touch> made =
      make_touches(demo_cell(), plain_truth(demo_cell(), 5), {.fit = 100, .check = 12}).touches;
  return made;
}

/// The reason that begins so; empty where there is none.
std::string reason(const Calibration& c, const std::string& beginning) {
  for (const std::string& one : c.verdict.reasons)
    if (one.starts_with(beginning)) return one;
  return {};
}

Calibration with_all_diameters(double off_m) {
  Cell cell = demo_cell();
  cell.radius_offset_sigma_m = 0.3e-3;
  for (Target& target : cell.targets) target.diameter_m += off_m;
  return identify(cell, touches());
}

TEST(Tolerances, DiametersThatAreAllOffAreToldAndThenWithheld) {
  const Calibration little = with_all_diameters(-0.6e-3);
  EXPECT_TRUE(little.verdict.publish);
  EXPECT_EQ(reason(little, "radius offset: "), "");
  const Calibration more = with_all_diameters(-1.5e-3);
  EXPECT_TRUE(more.verdict.publish);
  EXPECT_NE(reason(more, "radius offset: ").find("mm larger than stated"), std::string::npos);
  const Calibration much = with_all_diameters(3e-3);
  EXPECT_FALSE(much.verdict.publish);
  EXPECT_NE(reason(much, "effective radius: ").find("mm smaller than stated"), std::string::npos);
  EXPECT_EQ(reason(much, "radius offset: "), "") << "once is enough";
}

TEST(Tolerances, AToolOfAnotherLengthIsToldAndThenWithheld) {
  const auto with = [](double off_m) {
    Cell cell = demo_cell();
    for (Joint& joint : cell.robot.joints) joint.tolerance_length_m = 0.7e-3;
    cell.tool.tcp.translation().z() += off_m;
    return identify(cell, touches());
  };
  EXPECT_EQ(reason(with(0.5e-3), "beyond tolerance: "), "");
  const Calibration more = with(2e-3);
  EXPECT_TRUE(more.verdict.publish) << more.verdict.reasons.front();
  EXPECT_NE(reason(more, "beyond tolerance: ").find("A6.d is off by -"), std::string::npos);
  const Calibration much = with(6e-3);
  EXPECT_FALSE(much.verdict.publish);
  EXPECT_NE(reason(much, "far from the drawing: ").find("right robot file and tool"),
            std::string::npos);
}

TEST(Tolerances, LengthsWrongByOneFactorAreTakenForTheScaleTheyHold) {
  Cell cell = demo_cell();
  for (CertifiedLength& length : cell.lengths) length.length_m *= 1.01;
  const Calibration c = identify(cell, touches());
  EXPECT_FALSE(c.verdict.publish);
  EXPECT_NE(reason(c, "scale: ").find("check what holds the scale: certified lengths"),
            std::string::npos);
  // Right ones are said to hang together.
  const std::string scope = reason(identify(demo_cell(), touches()), "scope: ");
  EXPECT_NE(scope.find("an error that all of them share would be noticed from 0."),
            std::string::npos)
      << scope;
}

TEST(Tolerances, ATenthOfGrossErrorsWithholdsNothing) {
  for (const unsigned seed : {1u, 2u, 3u, 4u, 5u, 6u, 7u, 8u}) {
    const auto made = make_touches(demo_cell(), plain_truth(demo_cell(), seed),
                                   {.fit = 100, .check = 12, .outlier_share = 0.1, .seed = seed});
    const Calibration c = identify(demo_cell(), made.touches);
    EXPECT_TRUE(c.verdict.publish) << seed << ": " << c.verdict.reasons.front();
  }
}

TEST(Tolerances, ATargetThatCreepsByHundredthsOfAMillimetreHasNotMoved) {
  const sim::Truth before = plain_truth(demo_cell(), 3);
  sim::Truth after = before;
  const auto session = [&](double creep_m) {
    after.centre_m = before.centre_m;
    after.centre_m[1].z() += creep_m;
    auto made = make_touches(demo_cell(), before, {.fit = 1200, .seed = 3}).touches;
    const auto later = make_touches(demo_cell(), after, {.fit = 1200, .seed = 3}).touches;
    std::copy(later.begin() + 600, later.end(), made.begin() + 600);
    return identify(demo_cell(), made);
  };
  const Calibration creeps = session(0.04e-3);
  EXPECT_TRUE(creeps.verdict.publish) << creeps.verdict.reasons.front();
  const Calibration moved = session(0.25e-3);
  EXPECT_FALSE(moved.verdict.publish);
  EXPECT_NE(reason(moved, "moved target: S2"), "") << moved.verdict.reasons.front();
}

}  // namespace
}  // namespace cellcal::calib
