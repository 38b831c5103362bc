// The uncertainty budget of a calibration.

#include "calib/estimate/budget.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "calib/estimate/region.h"
#include "calib/files/calibration_json.h"
#include "calib/identify/identify.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::make_touches;
using testing::plain_truth;

Calibration calibrated(const Cell& cell, int fit) {
  return identify(cell, make_touches(cell, plain_truth(cell, 3), {.fit = fit, .seed = 3}).touches);
}

const UncertaintyLine* line(const Calibration& c, UncertaintySource source) {
  const auto found = std::ranges::find(c.uncertainty, source, &UncertaintyLine::source);
  return found == c.uncertainty.end() ? nullptr : &*found;
}

TEST(UncertaintyBudget, SquaresAddUpToTheStandardUncertaintyOverEitherScope) {
  for (const int fit : {24, 100}) {
    const Calibration c = calibrated(demo_cell(), fit);
    double near_m2 = 0.0, far_m2 = 0.0;
    for (const UncertaintyLine& one : c.uncertainty) {
      near_m2 += one.near_targets_m * one.near_targets_m;
      far_m2 += one.workspace_m * one.workspace_m;
    }
    EXPECT_NEAR(std::sqrt(near_m2), c.predicted_near_targets_m / kMeanOverRms, 1e-9) << fit;
    EXPECT_NEAR(std::sqrt(far_m2), c.predicted_workspace_m / kMeanOverRms, 1e-9) << fit;
  }
}

TEST(UncertaintyBudget, NamesWhatTheTouchesHaveNotTakenOver) {
  const Calibration few = calibrated(demo_cell(), 24), many = calibrated(demo_cell(), 200);
  for (const UncertaintySource source :
       {UncertaintySource::kArmAngles, UncertaintySource::kArmLengths}) {
    ASSERT_NE(line(few, source), nullptr);
    EXPECT_GT(line(few, source)->workspace_m, line(many, source)->workspace_m);
  }
  const UncertaintyLine* touches = line(many, UncertaintySource::kTouches);
  ASSERT_NE(touches, nullptr);
  EXPECT_NEAR(touches->sigma, many.touch_noise_m / std::sqrt(std::min(1.0, many.chi2_per_dof)),
              1e-12);
  EXPECT_LT(touches->workspace_m, 1e-3);
}

TEST(UncertaintyBudget, StatesTheTouchNoiseThatWasUsedWhereTheResidualsAreSmaller) {
  Cell cell = demo_cell();
  cell.touch_sigma_m = 0.1e-3;
  const Calibration c = calibrated(cell, 100);
  ASSERT_LT(c.chi2_per_dof, 0.5);
  ASSERT_NE(line(c, UncertaintySource::kTouches), nullptr);
  EXPECT_NEAR(line(c, UncertaintySource::kTouches)->sigma, cell.touch_sigma_m, 0.01e-3);
}

TEST(UncertaintyBudget, StatesTheToleranceOfTheTransmissionThatWasFound) {
  const Calibration c = calibrated(demo_cell(), 100);
  ASSERT_GT(std::abs(c.level.transmission - 1.0), 0.1);
  double squares = 0.0, count = 0.0;
  const ArmModel arm(at_level(c.cell, kFullestLevel));
  for (const ArmParameter& one : arm.parameters()) {
    if (source_of(one) != UncertaintySource::kTransmission) continue;
    const double level = is_transmission(one.kind) ? c.level.transmission : c.level.play;
    if (!(level > 0.0)) continue;
    squares += std::pow(level * one.sigma, 2);
    ++count;
  }
  const UncertaintyLine* transmission = line(c, UncertaintySource::kTransmission);
  ASSERT_NE(transmission, nullptr);
  EXPECT_NEAR(transmission->sigma, std::sqrt(squares / count), 1e-9 * transmission->sigma);
}

TEST(UncertaintyBudget, HasALineForCertifiedLengthsAloneThatWereFitted) {
  Cell cell = demo_cell();
  ASSERT_FALSE(cell.lengths.empty());
  const Calibration fitted = calibrated(cell, 60);
  const UncertaintyLine* lengths = line(fitted, UncertaintySource::kCertifiedLengths);
  ASSERT_NE(lengths, nullptr);
  EXPECT_NEAR(lengths->sigma, cell.lengths.front().sigma_m, 1e-9);
  for (CertifiedLength& one : cell.lengths) one.is_check = true;
  EXPECT_EQ(line(calibrated(cell, 60), UncertaintySource::kCertifiedLengths), nullptr);
}

TEST(UncertaintyBudget, GrowsInTheCertificatesShareWithTheirUncertainty) {
  Cell cell = demo_cell();
  const double exact_m =
      line(calibrated(cell, 100), UncertaintySource::kCertifiedLengths)->workspace_m;
  for (CertifiedLength& one : cell.lengths) one.sigma_m = 0.2e-3;
  EXPECT_GT(line(calibrated(cell, 100), UncertaintySource::kCertifiedLengths)->workspace_m,
            2.0 * exact_m);
}

TEST(UncertaintyBudget, IsReadFromTheFileAsItWasWritten) {
  const Calibration c = calibrated(demo_cell(), 40);
  const Calibration again = calibration_from_json(calibration_to_json(c), "calibration.json");
  ASSERT_EQ(again.uncertainty.size(), c.uncertainty.size());
  for (std::size_t i = 0; i < c.uncertainty.size(); ++i) {
    EXPECT_EQ(again.uncertainty[i].source, c.uncertainty[i].source);
    EXPECT_NEAR(again.uncertainty[i].sigma, c.uncertainty[i].sigma, 1e-15);
    EXPECT_NEAR(again.uncertainty[i].workspace_m, c.uncertainty[i].workspace_m, 1e-15);
    EXPECT_NEAR(again.uncertainty[i].near_targets_m, c.uncertainty[i].near_targets_m, 1e-15);
  }
}

}  // namespace
}  // namespace cellcal::calib
