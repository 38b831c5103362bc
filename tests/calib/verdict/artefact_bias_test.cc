// A sphere of another size than stated, or a wire with a displaced zero, is named with its
// deviation; correct sizes are not accused.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "calib/identify/identify.h"
#include "calib/identify/identify_once.h"
#include "calib/verdict/artefacts.h"
#include "tests/calib/findings.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::cause;
using testing::demo_cell;
using testing::make_touches;
using testing::plain_truth;
using testing::words_of;

const std::vector<Touch>& sphere_touches() {
  static const std::vector<Touch> made =
      make_touches(demo_cell(), plain_truth(demo_cell(), 5), {.fit = 100, .check = 12}).touches;
  return made;
}

/// True if the likely causes name S1, alone or together with others.
bool about_s1(const Calibration& c) {
  const auto names = [](const Subject& s) { return s.name == "S1" || s.other_end == "S1"; };
  return std::any_of(c.verdict.findings.begin(), c.verdict.findings.end(), [&](const Finding& f) {
    return f.kind == FindingKind::kLikelyCause &&
           (names(f.about) ||
            std::any_of(f.parts.begin(), f.parts.end(),
                        [&](const FindingPart& part) { return names(part.about); }));
  });
}

/// The size named first as a likely cause; an empty part if there is none.
FindingPart wrong_size(const Calibration& c) {
  const Finding finding = cause(c, LikelyCause::kArtefactSize);
  return finding.parts.empty() ? FindingPart{} : finding.parts.front();
}

Cell wires() {
  Cell cell = demo_cell();
  cell.lengths.clear();
  for (Target& target : cell.targets) target.kind = TargetKind::kWire;
  return cell;
}

TEST(Sizes, OfRightFilesAreNotAccused) {
  for (const unsigned seed : {1u, 2u, 3u, 4u, 5u, 6u}) {
    SCOPED_TRACE(seed);
    const auto made =
        make_touches(demo_cell(), plain_truth(demo_cell(), seed), {.fit = 100, .seed = seed});
    const Calibration c = identify_single_pass(demo_cell(), made.touches);
    ASSERT_EQ(c.artefact_biases.size(), demo_cell().targets.size());
    EXPECT_EQ(worst_contradicted(c.artefact_biases), nullptr);
    // A very large bound would not be contradicted either.
    for (const ArtefactBias& size : c.artefact_biases)
      EXPECT_LT(size.sigma_m, 0.08e-3) << size.target;
  }
}

TEST(Sizes, ASphereThatIsAFewTenthsLargerOrSmallerThanStatedIsNamedWithItsDiameter) {
  for (std::size_t t = 0; t < demo_cell().targets.size(); ++t)
    for (const double off_m : {-0.5e-3, 0.5e-3, 1.5e-3}) {
      SCOPED_TRACE(t);
      SCOPED_TRACE(off_m);
      Cell cell = demo_cell();
      cell.targets[t].diameter_m += off_m;
      const Calibration c = identify(cell, sphere_touches());
      EXPECT_FALSE(c.verdict.publish());
      const Finding named = cause(c, LikelyCause::kArtefactSize);
      // The touches may not distinguish which of several it is.
      const auto own = std::find_if(
          named.parts.begin(), named.parts.end(),
          [&](const FindingPart& one) { return one.about == about_target(cell.targets[t]); });
      ASSERT_NE(own, named.parts.end()) << words_of(c);
      EXPECT_NEAR(value(own->evidence, "measured"), 61.4, 0.12) << words_of(c);
    }
}

TEST(Sizes, ASphereAllOfWhoseTouchesWereLeftOutForItsDiameterIsNamed) {
  Cell cell = demo_cell();
  cell.targets[0].diameter_m += 4e-3;
  const auto made =
      make_touches(demo_cell(), plain_truth(demo_cell(), 5), {.fit = 240, .check = 24}).touches;
  const Calibration c = identify(cell, made);
  EXPECT_FALSE(c.verdict.publish());
  EXPECT_EQ(wrong_size(c).about.name, "S1") << words_of(c);
  EXPECT_NEAR(value(wrong_size(c).evidence, "measured"), 61.4, 0.12) << words_of(c);
}

TEST(Sizes, AWireThatWasZeroedElsewhereIsNamedWithByHowMuch) {
  const Cell cell = wires();
  auto made = make_touches(cell, plain_truth(cell, 3), {.fit = 160, .check = 16}).touches;
  EXPECT_EQ(worst_contradicted(identify_single_pass(cell, made).artefact_biases), nullptr);
  for (Touch& touch : made)
    if (touch.target == "S2") touch.radius_m += 0.6e-3;
  const Calibration c = identify(cell, made);
  EXPECT_FALSE(c.verdict.publish());
  EXPECT_EQ(wrong_size(c).about.name, "S2") << words_of(c);
  EXPECT_NEAR(value(wrong_size(c).evidence, "longer"), -0.6, 0.1) << words_of(c);
}

TEST(Sizes, TheMoreADiameterOrAZeroIsOffTheLessItPasses) {
  const Cell of_wires = wires();
  const sim::Truth truth = plain_truth(demo_cell(), 5), truth_of_wires = plain_truth(of_wires, 3);
  int of_each = 15;
  for (const double off_m : {-1e-3, 1.5e-3, 2.5e-3, 4e-3, -8e-3, 30e-3}) {
    of_each = 40 - of_each;  // alternately 25 and 15
    SCOPED_TRACE(of_each);
    SCOPED_TRACE(off_m);
    Cell cell = demo_cell();
    cell.targets[0].diameter_m += off_m;
    const Calibration sphere =
        identify(cell, make_touches(demo_cell(), truth, {.fit = 4 * of_each}).touches);
    EXPECT_FALSE(sphere.verdict.publish());
    EXPECT_TRUE(about_s1(sphere)) << words_of(sphere);
    auto made = make_touches(of_wires, truth_of_wires, {.fit = 6 * of_each}).touches;
    for (Touch& touch : made)
      if (touch.target == "S2") touch.radius_m += off_m;
    EXPECT_FALSE(identify(of_wires, made).verdict.publish());
  }
}

TEST(Sizes, WiresThatAreAllOffAlikeAreToldTogether) {
  const Cell cell = wires();
  auto made = make_touches(cell, plain_truth(cell, 3), {.fit = 160, .check = 16}).touches;
  for (Touch& touch : made) touch.radius_m += 0.4e-3;
  const Calibration c = identify(cell, made);
  EXPECT_FALSE(c.verdict.publish());
  EXPECT_EQ(wrong_size(c).about, Subject{}) << words_of(c);
  EXPECT_NEAR(value(wrong_size(c).evidence, "longer"), -0.4, 0.1) << words_of(c);
}

TEST(Sizes, AWrongCertifiedLengthIsNotTakenForADiameter) {
  for (const double off_m : {-1e-3, 0.5e-3, 3e-3}) {
    SCOPED_TRACE(off_m);
    Cell cell = demo_cell();
    cell.lengths[1].length_m += off_m;
    const Calibration c = identify(cell, sphere_touches());
    EXPECT_EQ(cause(c, LikelyCause::kCertifiedLength).cause, LikelyCause::kCertifiedLength)
        << words_of(c);
    EXPECT_EQ(cause(c, LikelyCause::kArtefactSize).cause, std::nullopt) << words_of(c);
  }
}

}  // namespace
}  // namespace cellcal::calib
