// The hidden truth: the same for the same seed, rigid, and as large as the files say.

#include "sim/cell/truth.h"

#include <gtest/gtest.h>

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

TEST(Truth, PutsTheArtefactWhereTheRealArmWasTaughtToFindIt) {
  // Within what placement and the looks' scatter leave: a few millimetres.
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Truth truth = drawn(seed);
    for (std::size_t t = 0; t < truth.centre_m.size(); ++t)
      EXPECT_LT((truth.centre_m[t] - demo_cell().targets[t].centre_m).norm(), 0.02) << seed;
  }
  TruthOptions exact;
  exact.geometry_scale = exact.deflection = exact.placement_m = exact.placement_rad = 0.0;
  const Truth truth = draw_truth(demo_cell(), exact);
  for (std::size_t t = 0; t < truth.centre_m.size(); ++t)
    EXPECT_LT((truth.centre_m[t] - demo_cell().targets[t].centre_m).norm(), 1e-8);
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
  // Nobody ships an arm five sigma off: 2.5 is the end. That takes 2 % of the variance; 5000 draws
  // leave 2 % of scatter.
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

}  // namespace
}  // namespace cellcal::sim
