// Imperfections that a result uses to explain the touches, and their selection.

#include "calib/result/level.h"

#include <gtest/gtest.h>

#include "calib/identify/identify.h"
#include "calib/model/kinematics.h"
#include "calib/result/calibration.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::make_touches;

constexpr double kArcsec = std::numbers::pi / 180.0 / 3600.0;

int count(const Cell& cell, ParameterKind kind) {
  const ArmModel arm(cell.robot, cell.tool);
  return static_cast<int>(
      std::count_if(arm.parameters().begin(), arm.parameters().end(),
                    [&](const ArmParameter& parameter) { return parameter.kind == kind; }));
}

/// The demo cell with soft joints.
Cell soft_cell() {
  Cell cell = demo_cell();
  for (std::size_t j = 1; j < 4; ++j) {
    cell.robot.joints[j].mass_kg = 30.0;
    cell.robot.joints[j].com_m = {-0.2, 0.0, 0.0};
    cell.robot.joints[j].compliance_sigma_rad_per_nm = 5e-6;
  }
  return cell;
}

TEST(Level, ItsWordsNameWhatTheTouchesGaveEvidenceFor) {
  Cell cell = demo_cell();
  EXPECT_EQ(words(cell, {0.0, 0.0, 0.0}).find("functions"), std::string::npos);
  cell.robot.joints[1].function_sigma_rad = 12.0 * kArcsec;
  cell.robot.joints[2].function_sigma_rad = 38.0 * kArcsec;
  cell.robot.joints[2].bearing_sigma_rad_per_nm = 1e-6;
  EXPECT_NE(
      words(cell, {0.0, 0.0, 0.0})
          .find("compliance across the axes, functions of the joints' angles 12 to 38 arcsec"),
      std::string::npos);
}

TEST(Level, EveryArmHasGearsWhetherItsFileNamesThemOrNot) {
  const Cell cell = at_level(demo_cell(), ModelLevel{});
  EXPECT_EQ(count(demo_cell(), ParameterKind::kCosine), 0);
  EXPECT_EQ(count(cell, ParameterKind::kCosine), 24);  // four orders of six joints
  EXPECT_EQ(count(cell, ParameterKind::kSine), 24);
  EXPECT_EQ(count(at_level(cell, {true, 0.0, 0.0}), ParameterKind::kCosine), 0);
}

TEST(Level, GearsThatAreAssumedFallOffWithTheirOrderAndTheFilesOwnDoNot) {
  const auto sigmas = [](const Cell& cell) {
    const ArmModel arm(cell.robot, cell.tool);
    std::vector<double> arcsec;
    for (const ArmParameter& parameter : arm.parameters())
      if (parameter.kind == ParameterKind::kCosine && parameter.joint == 2)
        arcsec.push_back(parameter.sigma / kArcsec);
    return arcsec;
  };
  const std::vector<double> assumed = sigmas(at_level(demo_cell(), ModelLevel{}));
  ASSERT_EQ(assumed.size(), 4U);
  for (std::size_t k = 0; k < assumed.size(); ++k)
    EXPECT_NEAR(assumed[k], 10.0 / static_cast<double>(k + 1), 1e-9);
  Cell named = demo_cell();
  named.robot.joints[2].harmonics = {1, 3};
  named.robot.joints[2].harmonic_sigma_rad = 10.0 * kArcsec;
  for (const double sigma : sigmas(at_level(named, ModelLevel{}))) EXPECT_NEAR(sigma, 10.0, 1e-9);
}

TEST(Level, TheFilesOwnGearsAreScaledAndNotReplaced) {
  Cell cell = demo_cell();
  cell.robot.joints[2].gear_ratio = 100.0;
  cell.robot.joints[2].harmonics = {3};
  cell.robot.joints[2].harmonic_sigma_rad = 30.0 * kArcsec;
  const Cell levelled = at_level(cell, {true, 0.5, 0.0});
  EXPECT_EQ(count(levelled, ParameterKind::kCosine), 1);
  EXPECT_EQ(levelled.robot.joints[2].gear_ratio, 100.0);
  EXPECT_DOUBLE_EQ(levelled.robot.joints[2].harmonic_sigma_rad, 15.0 * kArcsec);
}

TEST(Level, TheFilesOwnComplianceIsTakenAndNoOther) {
  EXPECT_EQ(count(at_level(soft_cell(), {true, 0.0, 0.0}), ParameterKind::kCompliance), 3);
  EXPECT_EQ(count(at_level(soft_cell(), {false, 0.0, 0.0}), ParameterKind::kCompliance), 0);
}

TEST(Level, AnArmWhoseFileIsSilentGivesAtEveryJointThatBearsALoad) {
  const Cell cell = at_level(demo_cell(), ModelLevel{});
  EXPECT_EQ(count(demo_cell(), ParameterKind::kCompliance), 0);
  EXPECT_EQ(count(cell, ParameterKind::kCompliance), 5);  // all but the vertical first one
  EXPECT_EQ(cell.robot.joints[0].compliance_sigma_rad_per_nm, 0.0);
  Cell on_the_wall = demo_cell();
  on_the_wall.robot.gravity_m_s2 = {9.81, 0.0, 0.0};
  EXPECT_EQ(count(at_level(on_the_wall, ModelLevel{}), ParameterKind::kCompliance), 6);
}

TEST(Level, AssumedLinksWeighByTheirLengthInTheirMiddle) {
  const Cell cell = at_level(demo_cell(), ModelLevel{});
  const Joint& upper_arm = cell.robot.joints[1];
  EXPECT_NEAR(upper_arm.com_m.norm(), std::hypot(upper_arm.a_m, upper_arm.d_m) / 2.0, 1e-12);
  EXPECT_GT(upper_arm.mass_kg, cell.robot.joints[5].mass_kg);
}

TEST(Level, IsSaidInWords) {
  EXPECT_EQ(words(demo_cell(), {false, 0.0, 0.0}), "geometry, tool bending");
  EXPECT_EQ(words(soft_cell(), {true, 1.0, 5.0 * kArcsec}),
            "geometry, tool bending, joint compliance, transmission 10 arcsec, ripple 5 arcsec");
}

TEST(Level, AskedForIsTakenAndSaidToBe) {
  const auto made = make_touches(demo_cell(), testing::plain_truth(demo_cell(), 1), {.fit = 80});
  IdentifyOptions options;
  options.level = ModelLevel{false, 2.0, 15.0 * kArcsec};
  const Calibration result = identify(demo_cell(), made.touches, options);
  EXPECT_EQ(result.level, *options.level);
  EXPECT_EQ(result.level_reason.choice, LevelChoice::kAskedFor);
}

TEST(Level, SoftJointsAreSeenByTheirEvidence) {
  double soft = 0.0;
  constexpr int kRuns = 6;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    const sim::Truth truth = testing::plain_truth(soft_cell(), seed);
    const auto made = make_touches(soft_cell(), truth, {.fit = 150, .seed = seed});
    const Calibration result = identify(soft_cell(), made.touches);
    EXPECT_FALSE(result.levels.empty());
    for (std::size_t i = 1; i < result.levels.size(); ++i)
      EXPECT_LE(result.levels[i].log_evidence, result.levels[i - 1].log_evidence);
    EXPECT_EQ(result.level_reason.choice, LevelChoice::kMeanByEvidence);
    double all = 0.0;
    for (const LevelEvidence& l : result.levels) {
      all += l.probability;
      soft += l.level.compliance > 0.0 ? l.probability / kRuns : 0.0;
    }
    EXPECT_NEAR(all, 1.0, 1e-4);
  }
  EXPECT_GT(soft, 0.99);
}

TEST(Level, SagOfAnArmWhoseFileStatesNoMassesIsFoundInItsTrueShape) {
  // The forearm's weight is off-centre, which cannot be derived from the links' lengths.
  Cell heavy = soft_cell();
  heavy.robot.joints[3].com_m = {0.0, 0.0, -0.3};
  for (Joint& joint : heavy.robot.joints) joint.compliance_sigma_rad_per_nm *= 3.0;
  double taken = 0.0, left_out = 0.0;
  constexpr int kRuns = 4;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    const sim::Truth truth = testing::plain_truth(heavy, seed);
    const auto made = make_touches(heavy, truth, {.fit = 150, .check = 40, .seed = seed});
    taken += identify(demo_cell(), made.touches).check.rms_m / kRuns;
    IdentifyOptions stiff;
    stiff.level = ModelLevel{0.0, 1.0, 0.0};
    left_out += identify(demo_cell(), made.touches, stiff).check.rms_m / kRuns;
  }
  std::printf("sag: unseen touches %.3f mm rms, stiff %.3f mm\n", 1e3 * taken, 1e3 * left_out);
  EXPECT_LT(taken, 0.25 * left_out);  // an eighth at the time of writing
}

TEST(Level, LargeGearErrorsAreTakenAsLargerThanSmallOnes) {
  double small = 0.0, large = 0.0;
  constexpr int kRuns = 6;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    for (const double arcsec : {0.0, 40.0}) {
      sim::TruthOptions options;
      options.seed = seed;
      options.gear_arcsec = arcsec;
      const sim::Truth truth = sim::draw_truth(demo_cell(), options);
      const auto made = make_touches(demo_cell(), truth, {.fit = 200, .seed = seed});
      (arcsec > 0.0 ? large : small) += identify(demo_cell(), made.touches).level.transmission;
    }
  }
  EXPECT_LE(small / kRuns, 1.0);
  EXPECT_GE(large / kRuns, 2.0);
}

}  // namespace
}  // namespace cellcal::calib
