// The hidden truth: deterministic for a seed, rigid, and as large as the files state.

#include "sim/cell/truth.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <vector>

#include "calib/files/files.h"

namespace cellcal::sim {
namespace {

const calib::Cell& demo_cell() {
  static const calib::Cell cell = calib::load_cell(CELLCAL_DEMO_CELL);
  return cell;
}

Truth drawn(std::uint64_t seed) {
  TruthOptions options;
  options.seed = seed;
  return draw_truth(demo_cell(), options);
}

TEST(Truth, OfALinearUnitPlacesSpheresAlongItWithoutGearsOrPlayOfItsOwn) {
  calib::Cell cell = demo_cell();
  calib::Joint unit;
  unit.name = "E1";
  unit.guide.emplace();
  unit.guide->along = Eigen::Vector3d::UnitY();
  unit.guide->scale_sigma = 5e-4;
  unit.max_rad = 3.0;
  cell.robot.joints.insert(cell.robot.joints.begin(), unit);
  for (calib::Target& target : cell.targets) target.centre_m.y() += 1.5;
  TruthOptions options;
  options.gear_arcsec = 10.0;
  options.play_arcsec = 5.0;
  const Truth truth = draw_truth(cell, options);
  EXPECT_TRUE(truth.arm.robot().joints[0].harmonics.empty());
  EXPECT_EQ(truth.arm.robot().joints[0].play_sigma_rad, 0.0);
  EXPECT_FALSE(truth.arm.robot().joints[1].harmonics.empty());
  for (std::size_t t = 0; t < cell.targets.size(); ++t)
    EXPECT_LT((truth.centre_m[t] - cell.targets[t].centre_m).norm(), 0.02);
}

TEST(Truth, IsTheSameForTheSameSeedAndAnotherForAnother) {
  const Truth a = drawn(7), b = drawn(7), c = drawn(8);
  EXPECT_EQ(a.errors, b.errors);
  EXPECT_EQ(a.centre_m, b.centre_m);
  EXPECT_EQ(a.radius_m, b.radius_m);
  EXPECT_NE(a.errors, c.errors);
  EXPECT_NE(a.centre_m, c.centre_m);
}

TEST(Truth, KeepsTheCertifiedLengths) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Truth truth = drawn(seed);
    for (const calib::CertifiedLength& length : demo_cell().lengths) {
      const double real = (truth.centre_m[demo_cell().target_index(length.from)] -
                           truth.centre_m[demo_cell().target_index(length.to)])
                              .norm();
      // The file states them to a micrometre.
      EXPECT_NEAR(real, length.length_m, 1.5e-6) << seed << " " << length.from << length.to;
    }
  }
}

/// An arm without errors finds every target where the cell file has it.
void expect_taught(const calib::Cell& cell) {
  TruthOptions exact;
  exact.geometry_scale = exact.deflection = exact.placement_m = exact.placement_rad = 0.0;
  const Truth truth = draw_truth(cell, exact);
  for (std::size_t t = 0; t < truth.centre_m.size(); ++t)
    EXPECT_LT((truth.centre_m[t] - cell.targets[t].centre_m).norm(), 1e-8) << t;
}

TEST(Truth, PutsTheArtefactWhereTheRealArmWasTaughtToFindIt) {
  // Within the scatter of placement and teaching: a few millimetres.
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Truth truth = drawn(seed);
    for (std::size_t t = 0; t < truth.centre_m.size(); ++t)
      EXPECT_LT((truth.centre_m[t] - demo_cell().targets[t].centre_m).norm(), 0.02) << seed;
  }
  expect_taught(demo_cell());
}

TEST(Truth, OfAnArmOnTheCeilingIsTaughtWithItsToolPointingDown) {
  calib::Cell cell = demo_cell();
  cell.robot.gravity_m_s2 = -cell.robot.gravity_m_s2;
  for (calib::Target& target : cell.targets) target.centre_m.z() += 0.8;
  expect_taught(cell);
}

TEST(Truth, OfAToolAlongXOfItsTcpIsTaughtWithTheToolPointingDown) {
  calib::Cell cell = demo_cell();
  cell.tool.tcp.rotate(Eigen::AngleAxisd(-std::numbers::pi / 2.0, Eigen::Vector3d::UnitY()));
  // S1 and S2 are then out of reach of a level tool.
  for (calib::Target& target : cell.targets) target.centre_m.z() -= 1.1;
  expect_taught(cell);
}

TEST(Truth, UnderACeilingOrAtAWallIsTaughtInTheDirectionsThatReach) {
  for (const Eigen::Vector3d& gravity :
       {Eigen::Vector3d(0, 0, 9.81), Eigen::Vector3d(-9.81, 0, 0), Eigen::Vector3d(0, 9.81, 0)}) {
    SCOPED_TRACE(gravity.transpose());
    calib::Cell cell = demo_cell();
    cell.robot.gravity_m_s2 = gravity;
    for (calib::Target& target : cell.targets) target.centre_m.x() += 0.15;
    expect_taught(cell);
  }
}

TEST(Truth, NeedsNoPlaceOfAPlane) {
  calib::Cell cell = demo_cell();
  cell.targets.emplace_back();
  cell.targets.back().id = "P";
  cell.targets.back().kind = calib::TargetKind::kPlane;
  const Truth truth = draw_truth(cell, {});
  ASSERT_EQ(truth.centre_m.size(), 5u);
  for (std::size_t t = 0; t < 4; ++t) EXPECT_EQ(truth.centre_m[t], drawn(1).centre_m[t]);
}

TEST(Truth, DrawsErrorsFromTheTolerancesOfTheRobotFile) {
  constexpr int kSeeds = 200;
  double squares = 0.0, worst = 0.0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const Truth truth = drawn(seed);
    for (int p = 0; p < truth.arm.size(); ++p) {
      const double whitened =
          truth.errors[p] / truth.arm.parameters()[static_cast<std::size_t>(p)].sigma;
      squares += whitened * whitened;
      worst = std::max(worst, std::abs(whitened));
      ++count;
    }
  }
  // No arm is delivered five sigma off: truncated at 2.5. That removes 2 % of the variance; 5000
  // draws have 2 % of scatter.
  EXPECT_LE(worst, 2.5);
  EXPECT_NEAR(squares / count, 0.978, 0.06);
}

TEST(Truth, ToolsOnlySagAndJointsOnlyGive) {
  calib::Cell cell = demo_cell();
  for (calib::Joint& joint : cell.robot.joints) {
    joint.mass_kg = 10.0;
    joint.compliance_sigma_rad_per_nm = 1e-6;
  }
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    TruthOptions options;
    options.seed = seed;
    const Truth truth = draw_truth(cell, options);
    for (int p = 0; p < truth.arm.size(); ++p) {
      const auto kind = truth.arm.parameters()[static_cast<std::size_t>(p)].kind;
      if (kind == calib::ParameterKind::kCompliance || kind == calib::ParameterKind::kDeflection) {
        EXPECT_GE(truth.errors[p], 0.0) << seed;
      }
    }
  }
}

TEST(Truth, AddsGearsOnlyWhereAskedAndScalesTheGeometry) {
  TruthOptions options;
  options.seed = 3;
  const Truth plain = draw_truth(demo_cell(), options);
  options.gear_arcsec = 10.0;
  const Truth geared = draw_truth(demo_cell(), options);
  EXPECT_EQ(geared.arm.size(), plain.arm.size() + 6 * 2 * 2);
  options.gear_arcsec = 0.0;
  options.geometry_scale = 0.0;
  options.deflection = 0.002;
  const Truth ideal = draw_truth(demo_cell(), options);
  for (int p = 0; p < ideal.arm.size(); ++p) {
    const calib::ArmParameter& parameter = ideal.arm.parameters()[static_cast<std::size_t>(p)];
    EXPECT_EQ(ideal.errors[p], parameter.kind == calib::ParameterKind::kDeflection ? 0.002 : 0.0)
        << parameter_name(demo_cell(), parameter);
  }
}

TEST(Truth, StrainWaveGearsHaveSixWavesPerJointOfTheStatedSize) {
  TruthOptions options;
  options.seed = 3;
  options.gear_arcsec = 10.0;
  options.wave_arcsec = 20.0;
  const Truth truth = draw_truth(demo_cell(), options);
  double square = 0.0;
  int waves = 0;
  for (int p = 0; p < truth.arm.size(); ++p) {
    const calib::ArmParameter& parameter = truth.arm.parameters()[static_cast<std::size_t>(p)];
    if (!calib::is_transmission(parameter.kind) || parameter.harmonic < 3) continue;
    EXPECT_GE(parameter.harmonic, 5);
    EXPECT_LE(parameter.harmonic, 35);
    square += truth.errors[p] * truth.errors[p];
    ++waves;
  }
  EXPECT_EQ(waves, 6 * 6 * 2);
  // The mean square of 72 amplitudes is known to a sixth, 1 sigma.
  EXPECT_NEAR(square / 12.0 / std::pow(20.0 * calib::kRadPerArcsec, 2), 1.0, 0.5);
}

TEST(Truth, TrueRadiiHoldTheTipAndTheDiametersTolerance) {
  calib::Cell cell = demo_cell();
  cell.tool.tip_radius_m = 0.6e-3;
  TruthOptions options;
  for (const double radius : draw_truth(cell, options).radius_m)
    EXPECT_NEAR(radius, 0.0614 / 2 + 0.6e-3, 2.5 * 1e-6);
  cell.targets[2].kind = calib::TargetKind::kPoint;
  EXPECT_EQ(draw_truth(cell, options).radius_m[2], 0.0);
}

TEST(Truth, SaysWhichTargetTheArmCannotReach) {
  calib::Cell cell = demo_cell();
  cell.targets[1].centre_m = {4.0, 0.0, 0.0};
  try {
    (void)draw_truth(cell, {});
    FAIL() << "reached 4 m";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("S2"), std::string::npos) << error.what();
  }
}

TruthOptions like_a_real_arm(std::uint64_t seed) {
  TruthOptions options;
  options.seed = seed;
  options.gear_arcsec = 7.0;
  options.compliance_rad_per_nm = 5e-6;
  options.play_arcsec = 10.0;
  options.tip_offset_m = 0.5e-3;
  options.growth = 25e-6;
  return options;
}

double sag_of(const Truth& truth, calib::ParameterKind kind, std::span<const double> q) {
  const calib::PreparedPose pose = truth.arm.prepare(q);
  double largest = 0.0;
  for (int i = 0; i < truth.arm.size(); ++i)
    if (truth.arm.parameters()[static_cast<std::size_t>(i)].kind == kind)
      largest = std::max(largest, std::abs(pose.factor[i] * truth.errors[i]));
  return largest;
}

TEST(Truth, HasWhatRealArmsHaveOnlyWhereItIsAskedFor) {
  const std::vector<double> stretched{0.0, -0.2, 0.3, 0.0, 0.5, 0.0};
  const Truth plain = drawn(3), real = draw_truth(demo_cell(), like_a_real_arm(3));
  using Kind = calib::ParameterKind;
  EXPECT_EQ(sag_of(plain, Kind::kCompliance, stretched), 0.0);
  EXPECT_EQ(sag_of(plain, Kind::kPlay, stretched), 0.0);
  EXPECT_EQ(plain.growth, 0.0);
  // Links of about 25 kg at arm's length: a few hundred N m, a deflection of joints by a mrad.
  const double sag = sag_of(real, Kind::kCompliance, stretched);
  EXPECT_GT(sag, 1e-4);
  EXPECT_LT(sag, 1e-2);
  EXPECT_GT(sag_of(real, Kind::kPlay, stretched), 1e-6);
  EXPECT_LT(sag_of(real, Kind::kPlay, stretched), 2.5 * 10.0 / 206264.8);
}

TEST(Truth, GivesAndPlaysToTheSideOfTheLoad) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Truth truth = draw_truth(demo_cell(), like_a_real_arm(seed));
    for (int i = 0; i < truth.arm.size(); ++i) {
      const auto kind = truth.arm.parameters()[static_cast<std::size_t>(i)].kind;
      if (kind == calib::ParameterKind::kCompliance || kind == calib::ParameterKind::kPlay) {
        EXPECT_GE(truth.errors[i], 0.0) << seed;
      }
    }
  }
}

TEST(Truth, PutsTheTipWhereTheCellFileDoesNotHaveIt) {
  double most = 0.0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Truth truth = draw_truth(demo_cell(), like_a_real_arm(seed));
    const Eigen::Vector3d off =
        truth.arm.tool().tcp.translation() - demo_cell().tool.tcp.translation();
    EXPECT_LE(off.cwiseAbs().maxCoeff(), 0.5e-3);
    most = std::max(most, off.norm());
    // The controller that taught the places uses the file's tip: they are still found near them.
    for (std::size_t t = 0; t < truth.centre_m.size(); ++t)
      EXPECT_LT((truth.centre_m[t] - demo_cell().targets[t].centre_m).norm(), 0.03) << seed;
  }
  EXPECT_GT(most, 0.4e-3);
}

TEST(Truth, WarmsUpFromPowerOn) {
  Truth truth = drawn(1);
  truth.warm_up_s = 60.0;
  EXPECT_EQ(truth.warm_at(0.0), 0.0);
  EXPECT_NEAR(truth.warm_at(60.0), 1.0 - std::exp(-1.0), 1e-15);
  EXPECT_GT(truth.warm_at(600.0), 0.9999);
}

}  // namespace
}  // namespace cellcal::sim
