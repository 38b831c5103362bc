#include <gtest/gtest.h>

#include "calib/files/cell_file.h"
#include "calib/files/robot_file.h"
#include "calib/priors/learn.h"
#include "calib/result/level.h"
#include "tests/calib/priors/simulated_fleet.h"

namespace cellcal::calib::testing {
namespace {

FleetPriors learned_priors() {
  return learn(drawn_robot(), evidence_of_all(fleet_of(12, uneven()))).priors;
}

TEST(AcceptedPriors, AreTheRobotFilesTolerancesAndEachChangeIsNamed) {
  const FleetPriors priors = learned_priors();
  const Robot drawn = drawn_robot();
  const auto accepted = std::get<Accepted>(accept(drawn, priors));
  ASSERT_FALSE(accepted.changes.empty());
  for (std::size_t j = 0; j < drawn.joints.size(); ++j)
    EXPECT_EQ(accepted.robot.joints[j].tolerance_length_m,
              offered(*priors.joints[j].of(SpreadKind::kLength)));
  const PriorChange& first = accepted.changes.front();
  EXPECT_EQ(first.joint, drawn.joints[0].name);
  EXPECT_EQ(first.before, drawn.joints[0].tolerance_length_m);
  EXPECT_EQ(nominal_geometry_sha256(accepted.robot), priors.nominal_geometry)
      << "of the same nominal geometry";
  const Robot again = read_robot(TomlTable::parse(robot_to_toml(accepted.robot), "accepted.toml"));
  EXPECT_NEAR(again.joints[2].tolerance_angle_rad, accepted.robot.joints[2].tolerance_angle_rad,
              1e-12);
}

TEST(AcceptedPriors, OfGearsThatNoFileNamedAreThoseThatAnEstimateAssumed) {
  Robot unnamed = drawn_robot();
  for (Joint& joint : unnamed.joints) {
    joint.harmonics.clear();
    joint.harmonic_sigma_rad = 0.0;
  }
  Random random(4);
  std::vector<Calibration> fleet;
  for (int k = 0; k < 5; ++k)
    fleet.push_back(calibration_of(unnamed, unnamed, uneven(), 40, random));
  const FleetPriors priors = learn(unnamed, evidence_of_all(fleet)).priors;
  const auto accepted = std::get<Accepted>(accept(unnamed, priors));
  const Robot again = read_robot(TomlTable::parse(robot_to_toml(accepted.robot), "accepted.toml"));
  Cell cell;
  cell.robot = again;
  const Joint joint = at_level(cell, {}).robot.joints[1];
  EXPECT_EQ(joint.harmonics, (std::vector<int>{1, 2, 3, 4}));
  EXPECT_EQ(joint.harmonic_falloff, 1.0);
  EXPECT_NEAR(joint.harmonic_sigma_rad, offered(*priors.joints[1].of(SpreadKind::kGear)), 1e-12);
}

TEST(AcceptedPriors, OfAnotherNominalGeometryAreRefused) {
  Robot other = drawn_robot();
  other.joints[2].d_m += 1e-6;
  EXPECT_TRUE(std::holds_alternative<OtherNominalGeometry>(accept(other, learned_priors())));
}

TEST(AnError, ThatARobotFileDoesNotAllowStaysForbidden) {
  Robot fixed = drawn_robot();
  fixed.joints[0].tolerance_length_m = 0.0;
  const auto accepted = std::get<Accepted>(accept(fixed, learned_priors()));
  EXPECT_EQ(accepted.robot.joints[0].tolerance_length_m, 0.0);
}

TEST(TheNominalGeometry, IsTheSameWhateverTolerancesMassesGearsLimitsAndNamesSay) {
  Robot other = drawn_robot();
  other.name = "another name";
  other.source = "elsewhere";
  for (Joint& joint : other.joints) {
    joint.tolerance_length_m *= 2.0;
    joint.mass_kg += 1.0;
    joint.harmonics = {1};
    joint.max_rad *= 0.9;
    std::reverse(joint.errors.begin(), joint.errors.end());
    joint.d_m += 1e-14;  // rounding of a unit conversion
  }
  EXPECT_EQ(nominal_geometry_sha256(other), nominal_geometry_sha256(drawn_robot()));
  other.joints[3].sign = -other.joints[3].sign;
  EXPECT_NE(nominal_geometry_sha256(other), nominal_geometry_sha256(drawn_robot()));
}

}  // namespace
}  // namespace cellcal::calib::testing
