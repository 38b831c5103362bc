// A sphere that is not as large as its file says, or a wire that was zeroed elsewhere, is named
// with what it is; sizes that are right are not accused.

#include "calib/consistency/artefact_bias.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "calib/identify/identify.h"
#include "calib/verdict/identify_as_stated.h"
#include "tests/calib/findings.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::make_touches;
using testing::plain_truth;
using testing::the;
using testing::words_of;

const std::vector<Touch>& touches() {
  static const std::vector<Touch> made =
      make_touches(demo_cell(), plain_truth(demo_cell(), 5), {.fit = 100, .check = 12}).touches;
  return made;
}

std::string likely_cause(const Calibration& c) { return the(c, FindingKind::kLikelyCause).text; }

/// The number behind `words`.
double number_behind(const std::string& words, const std::string& in) {
  const std::size_t at = in.find(words);
  return at == std::string::npos ? std::nan("") : std::stod(in.substr(at + words.size()));
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
    const Calibration c = identify_as_stated(demo_cell(), made.touches);
    ASSERT_EQ(c.artefact_biases.size(), demo_cell().targets.size());
    EXPECT_EQ(worst_contradicted(c.artefact_biases), nullptr);
    // A bound that nothing could break would be as quiet.
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
      const Calibration c = identify(cell, touches());
      EXPECT_FALSE(c.verdict.publish);
      const std::string cause = likely_cause(c);
      EXPECT_NEAR(number_behind("with the diameter of " + cell.targets[t].id + " ", cause), 61.4,
                  0.12)
          << cause;
    }
}

TEST(Sizes, ASphereAllOfWhoseTouchesWereLeftOutForItsDiameterIsNamed) {
  Cell cell = demo_cell();
  cell.targets[0].diameter_m += 4e-3;
  const auto made =
      make_touches(demo_cell(), plain_truth(demo_cell(), 5), {.fit = 240, .check = 24}).touches;
  const Calibration c = identify(cell, made);
  EXPECT_FALSE(c.verdict.publish);
  const std::string cause = likely_cause(c);
  EXPECT_NEAR(number_behind("with the diameter of S1 ", cause), 61.4, 0.12) << cause;
}

TEST(Sizes, AWireThatWasZeroedElsewhereIsNamedWithByHowMuch) {
  const Cell cell = wires();
  auto made = make_touches(cell, plain_truth(cell, 3), {.fit = 160, .check = 16}).touches;
  EXPECT_EQ(worst_contradicted(identify_as_stated(cell, made).artefact_biases), nullptr);
  for (Touch& touch : made)
    if (touch.target == "S2") touch.radius_m += 0.6e-3;
  const Calibration c = identify(cell, made);
  EXPECT_FALSE(c.verdict.publish);
  const std::string cause = likely_cause(c);
  EXPECT_NEAR(number_behind("with all readings of S2 ", cause), -0.6, 0.1) << cause;
}

TEST(Sizes, TheMoreADiameterOrAZeroIsOffTheLessItPasses) {
  const Cell of_wires = wires();
  const sim::Truth truth = plain_truth(demo_cell(), 5), truth_of_wires = plain_truth(of_wires, 3);
  for (const int of_each : {15, 25})
    for (const double off_m : {-1e-3, 1.5e-3, 2.5e-3, 4e-3, -8e-3, 30e-3}) {
      SCOPED_TRACE(of_each);
      SCOPED_TRACE(off_m);
      Cell cell = demo_cell();
      cell.targets[0].diameter_m += off_m;
      const Calibration sphere =
          identify(cell, make_touches(demo_cell(), truth, {.fit = 4 * of_each}).touches);
      EXPECT_FALSE(sphere.verdict.publish);
      EXPECT_NE(likely_cause(sphere).find("S1"), std::string::npos) << words_of(sphere);
      auto made = make_touches(of_wires, truth_of_wires, {.fit = 6 * of_each}).touches;
      for (Touch& touch : made)
        if (touch.target == "S2") touch.radius_m += off_m;
      EXPECT_FALSE(identify(of_wires, made).verdict.publish);
    }
}

TEST(Sizes, WiresThatAreAllOffAlikeAreToldTogether) {
  const Cell cell = wires();
  auto made = make_touches(cell, plain_truth(cell, 3), {.fit = 160, .check = 16}).touches;
  for (Touch& touch : made) touch.radius_m += 0.4e-3;
  const Calibration c = identify(cell, made);
  EXPECT_FALSE(c.verdict.publish);
  EXPECT_NEAR(number_behind("with all readings of all wires ", likely_cause(c)), -0.4, 0.1)
      << likely_cause(c);
}

TEST(Sizes, AWrongCertifiedLengthIsNotTakenForADiameter) {
  for (const double off_m : {-1e-3, 0.5e-3, 3e-3}) {
    SCOPED_TRACE(off_m);
    Cell cell = demo_cell();
    cell.lengths[1].length_m += off_m;
    const std::string cause = likely_cause(identify(cell, touches()));
    EXPECT_NE(cause.find("certified length of"), std::string::npos) << cause;
    EXPECT_EQ(cause.find("diameter"), std::string::npos) << cause;
  }
}

}  // namespace
}  // namespace cellcal::calib
