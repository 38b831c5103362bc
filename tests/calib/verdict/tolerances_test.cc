// Deviations from the files beyond their tolerances are reported, and withhold the result if chance
// does not explain them; reasonable gross errors and a warming arm withhold nothing.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "calib/identify/identify.h"
#include "calib/verdict/judge.h"
#include "tests/calib/findings.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::found;
using testing::make_touches;
using testing::plain_truth;
using testing::the;
using testing::words_of;

const std::vector<Touch>& touches() {
  static const std::vector<Touch> made =
      make_touches(demo_cell(), plain_truth(demo_cell(), 5), {.fit = 100, .check = 12}).touches;
  return made;
}

Calibration with_all_diameters(double off_m) {
  Cell cell = demo_cell();
  cell.radius_offset_sigma_m = 0.3e-3;
  for (Target& target : cell.targets) target.diameter_m += off_m;
  return identify(cell, touches());
}

TEST(Tolerances, DiametersThatAreAllOffAreToldAndThenWithheld) {
  const Calibration little = with_all_diameters(-0.6e-3);
  EXPECT_TRUE(little.verdict.publish());
  EXPECT_FALSE(found(little, FindingKind::kEffectiveRadius));
  const Calibration more = with_all_diameters(-1.5e-3);
  EXPECT_TRUE(more.verdict.publish());
  EXPECT_EQ(the(more, FindingKind::kEffectiveRadius).severity, Severity::kWarns);
  EXPECT_GT(the(more, FindingKind::kEffectiveRadius, "off"), 0.0);
  const Calibration much = with_all_diameters(3e-3);
  EXPECT_FALSE(much.verdict.publish());
  EXPECT_TRUE(the(much, FindingKind::kEffectiveRadius).withholds());
  EXPECT_LT(the(much, FindingKind::kEffectiveRadius, "off"), 0.0);
  EXPECT_EQ(
      std::count_if(much.verdict.findings.begin(), much.verdict.findings.end(),
                    [](const Finding& one) { return one.kind == FindingKind::kEffectiveRadius; }),
      1)
      << "once is enough";
}

TEST(Tolerances, AToolOfAnotherLengthIsToldAndThenWithheld) {
  const auto with = [](double off_m) {
    Cell cell = demo_cell();
    for (Joint& joint : cell.robot.joints) joint.tolerance_length_m = 0.7e-3;
    cell.tool.tcp.translation().z() += off_m;
    return identify(cell, touches());
  };
  EXPECT_FALSE(found(with(0.5e-3), FindingKind::kOffNominal));
  const Calibration more = with(2e-3);
  EXPECT_TRUE(more.verdict.publish()) << words_of(more);
  const Finding beyond = the(more, FindingKind::kOffNominal);
  EXPECT_EQ(beyond.severity, Severity::kWarns);
  ASSERT_FALSE(beyond.parts.empty());
  EXPECT_EQ(beyond.parts[0].about,
            about_parameter(more.cell, joint_parameter(ParameterKind::kD, 5)));
  EXPECT_LT(value(beyond.parts[0].evidence, "off"), 0.0);
  const Calibration much = with(6e-3);
  EXPECT_FALSE(much.verdict.publish());
  EXPECT_TRUE(the(much, FindingKind::kOffNominal).withholds());
}

TEST(Tolerances, LengthsWrongByOneFactorAreTakenForTheScaleTheyHold) {
  Cell cell = demo_cell();
  for (CertifiedLength& length : cell.lengths) length.length_m *= 1.01;
  const Calibration c = identify(cell, touches());
  EXPECT_FALSE(c.verdict.publish());
  EXPECT_NEAR(the(c, FindingKind::kArmScale, "off"), 1.0, 0.3) << words_of(c);
  // Correct lengths are reported as consistent.
  EXPECT_LT(the(identify(demo_cell(), touches()), FindingKind::kScaleByLengths, "unseen"), 1.0);
}

TEST(Tolerances, ATenthOfGrossErrorsWithholdsNothing) {
  for (const unsigned seed : {1u, 2u, 3u, 4u, 5u, 6u, 7u, 8u}) {
    const auto made = make_touches(demo_cell(), plain_truth(demo_cell(), seed),
                                   {.fit = 100, .check = 12, .outlier_share = 0.1, .seed = seed});
    const Calibration c = identify(demo_cell(), made.touches);
    EXPECT_TRUE(c.verdict.publish()) << seed << ": " << words_of(c);
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
  EXPECT_TRUE(creeps.verdict.publish()) << words_of(creeps);
  const Calibration moved = session(0.25e-3);
  EXPECT_FALSE(moved.verdict.publish());
  EXPECT_EQ(the(moved, FindingKind::kMovedTarget).about.name, "S2") << words_of(moved);
}

}  // namespace
}  // namespace cellcal::calib
