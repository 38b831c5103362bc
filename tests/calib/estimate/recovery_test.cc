// Simulated errors are recovered: exactly without noise, otherwise to within the noise.

#include <gtest/gtest.h>

#include "calib/identify/identify.h"
#include "sim/cell/compare.h"
#include "tests/calib/millimetre.h"
#include "tests/calib/simulate.h"
#include "tests/experiments/paper/task.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::kMm;
using testing::make_touches;
using testing::one_sphere_cell;
using testing::plain_truth;

std::vector<JointVector> joints_of(const std::vector<Touch>& touches) {
  std::vector<JointVector> joints;
  for (const Touch& touch : touches) joints.push_back(touch.joint_rad);
  return joints;
}

/// A cell with the tolerances of noise-free touches.
Cell noise_free(Cell cell) {
  cell.touch_sigma_m = 1e-9;
  cell.radius_offset_sigma_m = 1e-9;
  for (Target& target : cell.targets) target.diameter_sigma_m = 0.0;
  for (CertifiedLength& length : cell.lengths) {
    length.sigma_m = 1e-9;
    length.length_m = (cell.targets[cell.target_index(length.from)].centre_m -
                       cell.targets[cell.target_index(length.to)].centre_m)
                          .norm();
  }
  return cell;
}

/// The truth with the errors of the seed paper's Table 2 instead of random ones.
sim::Truth with_table_2(sim::Truth truth) {
  const auto conditions = sim::paper::simulation_conditions();
  for (int p = 0; p < truth.arm.size(); ++p) {
    const ArmParameter& parameter = truth.arm.parameters()[static_cast<std::size_t>(p)];
    double& value = truth.errors[p];
    if (parameter.kind == ParameterKind::kDeflection) value = conditions.deflection;
    if (parameter.joint < 0) continue;
    const auto& e = conditions.errors.at(static_cast<std::size_t>(parameter.joint));
    switch (parameter.kind) {
      case ParameterKind::kTheta: value = e.theta_rad; break;
      case ParameterKind::kD: value = e.d_m; break;
      case ParameterKind::kA: value = e.a_m; break;
      case ParameterKind::kAlpha: value = e.alpha_rad; break;
      case ParameterKind::kBeta: value = e.beta_rad; break;
      default: break;
    }
  }
  return truth;
}

TEST(Recovery, OfThePapersErrorsFromNoiseFreeTouchesIsExactOnOneSphere) {
  const Cell cell = noise_free(one_sphere_cell());
  const sim::Truth truth = with_table_2(plain_truth(cell, 1));
  const auto made = make_touches(cell, truth, {.fit = 50, .check = 30, .noise_m = 0.0});
  const Calibration result = identify(cell, made.touches);
  EXPECT_GT(result.before.rms_m, 0.5 * kMm);
  EXPECT_EQ(result.check.count, 30);
  EXPECT_LT(result.after.max_m, 1e-9);
  EXPECT_LT(result.check.max_m, 1e-9);
  EXPECT_TRUE(result.outliers.empty());
}

TEST(Recovery, OfThePapersErrorsOnFourSpheresIsExactInTheWholeWorkspace) {
  const Cell cell = noise_free(demo_cell());
  const sim::Truth truth = with_table_2(plain_truth(cell, 1));
  const auto made = make_touches(cell, truth, {.fit = 100, .check = 30, .noise_m = 0.0});
  const Calibration result = identify(cell, made.touches);
  EXPECT_LT(result.check.max_m, 1e-9);
  const auto figures = sim::truth_figures(truth, result, joints_of(made.touches));
  EXPECT_GT(figures.workspace.nominal_mean_m, 1.0 * kMm);
  EXPECT_LT(figures.workspace.max_m, 1e-8);
}

TEST(Recovery, WithNoiseGetsBetterWithMoreTouches) {
  double few = 0.0, many = 0.0;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const sim::Truth truth = plain_truth(demo_cell(), seed);
    for (const int touches : {40, 200}) {
      const auto made = make_touches(demo_cell(), truth, {.fit = touches, .seed = seed});
      const Calibration result = identify(demo_cell(), made.touches);
      (touches == 40 ? few : many) +=
          sim::truth_figures(truth, result, joints_of(made.touches)).workspace.mean_m;
    }
  }
  EXPECT_LT(many, 0.7 * few);       // five times the touches: at best 0.45
  EXPECT_LT(many / 5, 0.12 * kMm);  // mean over the workspace
}

/// sigma of rho [m] with the tool held within `cone_rad` of the normal; checks it against the
/// truth.
double rho_sigma(unsigned seed, int fit, double cone_rad, double* whitened) {
  const sim::Truth truth = plain_truth(demo_cell(), seed);
  const double rho = (seed % 2 == 0 ? 0.15 : -0.25) * kMm;
  const auto made = make_touches(demo_cell(), truth,
                                 {.fit = fit, .rho_m = rho, .cone_rad = cone_rad, .seed = seed});
  const Calibration result = identify(demo_cell(), made.touches);
  for (std::size_t t = 0; t < 4; ++t)
    EXPECT_NEAR(result.targets[t].effective_radius_m - truth.radius_m[t], rho, 0.3 * kMm)
        << "seed " << seed << " sphere " << t;
  const ParameterResult* p = find(result, tool_parameter(ParameterKind::kEffectiveRadius, 0));
  if (p == nullptr) {
    ADD_FAILURE() << "no effective radius";
    return 0.0;
  }
  EXPECT_LT(std::abs(p->correction - rho), 3.0 * p->sigma) << "seed " << seed;
  *whitened += std::pow((p->correction - rho) / p->sigma, 2);
  return p->sigma;
}

TEST(Recovery, OfTheEffectiveRadiusIsRightToFifteenMicrometresAndSaysSoWhereTheToolTilts) {
  double whitened = 0.0;
  for (unsigned seed = 1; seed <= 10; ++seed)
    EXPECT_LT(rho_sigma(seed, 100, 1.4, &whitened), 0.015 * kMm);
  EXPECT_LT(whitened / 10, 2.5);  // chi^2 of 10: exceeded by 1 in 200
}

TEST(Recovery, OfTheEffectiveRadiusIsSaidToBeUncertainWhereTheToolStandsOnTheSphere) {
  // Along the normal a longer tool and a larger sphere are indistinguishable.
  double whitened = 0.0;
  for (unsigned seed = 1; seed <= 10; ++seed)
    EXPECT_GT(rho_sigma(seed, 100, 0.5, &whitened), 0.05 * kMm);
  EXPECT_LT(whitened / 10, 2.5);
}

TEST(Recovery, OfAnUnknownTcpAndComplianceIsTakenOverIntoThePrediction) {
  Cell cell = demo_cell();
  cell.tool.tcp_sigma_m.setConstant(0.5 * kMm);
  for (std::size_t j = 1; j < 5; ++j) {
    cell.robot.joints[j].mass_kg = 15.0;
    cell.robot.joints[j].com_m = {-0.15, 0.0, 0.0};
    cell.robot.joints[j].compliance_sigma_rad_per_nm = 2e-6;
  }
  const sim::Truth truth = plain_truth(cell, 2);
  const auto made = make_touches(cell, truth, {.fit = 200, .check = 40, .seed = 2});
  const Calibration result = identify(cell, made.touches);
  EXPECT_LT(result.check.rms_m, 0.05 * kMm);
  const auto figures = sim::truth_figures(truth, result, joints_of(made.touches));
  EXPECT_LT(figures.workspace.mean_m, 0.15 * kMm);
  EXPECT_GT(figures.workspace.nominal_mean_m, 10.0 * figures.workspace.mean_m);
}

TEST(Recovery, WorksForAPointInASocket) {
  Cell cell = demo_cell();
  for (Target& target : cell.targets) target.kind = TargetKind::kPoint;
  const sim::Truth truth = plain_truth(cell, 3);
  const auto made = make_touches(cell, truth, {.fit = 60, .check = 20, .seed = 3});
  const Calibration result = identify(cell, made.touches);
  EXPECT_LT(result.check.rms_m, 0.1 * kMm);  // a distance in three components
  EXPECT_TRUE(result.verdict.workspace);
  for (const TargetResult& target : result.targets) EXPECT_EQ(target.effective_radius_m, 0.0);
  EXPECT_LT(sim::truth_figures(truth, result, joints_of(made.touches)).workspace.mean_m,
            0.15 * kMm);
}

TEST(Recovery, WorksForWires) {
  Cell cell = demo_cell();
  cell.lengths.clear();
  for (Target& target : cell.targets) target.kind = TargetKind::kWire;
  const sim::Truth truth = plain_truth(cell, 4);
  const auto made = make_touches(cell, truth, {.fit = 120, .check = 30, .seed = 4});
  const Calibration result = identify(cell, made.touches);
  EXPECT_LT(result.check.rms_m, 0.05 * kMm);
  EXPECT_GT(result.check_before.rms_m, 0.5 * kMm);
  EXPECT_NEAR(result.chi2_per_dof, 1.0, 0.5);
}

TEST(Recovery, MixesKindsOfTargets) {
  Cell cell = demo_cell();
  cell.lengths.clear();
  cell.targets[1].kind = TargetKind::kPoint;
  cell.targets[2].kind = TargetKind::kWire;
  const sim::Truth truth = plain_truth(cell, 5);
  const auto made = make_touches(cell, truth, {.fit = 120, .check = 40, .seed = 5});
  const Calibration result = identify(cell, made.touches);
  EXPECT_LT(result.check.rms_m, 0.06 * kMm);
  EXPECT_EQ(result.targets.size(), 4u);
}

}  // namespace
}  // namespace cellcal::calib
