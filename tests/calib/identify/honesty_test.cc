// Stated uncertainties compared with true errors, in simulations with a correct model.

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "calib/identify/identify.h"
#include "calib/model/linear.h"
#include "sim/cell/compare.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::make_touches;
using testing::plain_truth;

constexpr int kTruths = 50;

/// True minus estimated, in the order of the result's parameters.
Eigen::VectorXd true_errors(const sim::Truth& truth, const Cell& cell, double rho_m,
                            const Calibration& result) {
  Eigen::VectorXd error(static_cast<Eigen::Index>(result.parameters.size()));
  for (Eigen::Index i = 0; i < error.size(); ++i) {
    const ParameterResult& p = result.parameters[static_cast<std::size_t>(i)];
    double real = testing::true_value(truth, p.key);
    const auto t = static_cast<std::size_t>(std::max(p.key.target, 0));
    if (p.key.kind == ParameterKind::kEffectiveRadius) real = rho_m;
    if (p.key.kind == ParameterKind::kCentre) real = truth.centre_m[t][p.key.axis];
    if (p.key.kind == ParameterKind::kRadius)
      real = truth.radius_m[t] - cell.targets[t].diameter_m / 2.0 - cell.tool.tip_radius_m;
    error[i] = real - (p.nominal + p.correction);
  }
  return error;
}

struct Whitened {
  double squares = 0.0;  ///< sum of (error / sigma)^2 over the parameters decided by the data
  int count = 0;
  double mahalanobis = 0.0;  ///< sum over all parameters, correlations included
  int dof = 0;
  double chi2 = 0.0;  ///< mean of chi2_per_dof
};

/// The cell with lengths as certified by a laboratory: with errors of their stated sigma.
Cell certified(const sim::Truth& truth, unsigned seed) {
  Cell cell = demo_cell();
  Random random(seed);
  for (CertifiedLength& length : cell.lengths)
    length.length_m = (truth.centre_m[cell.target_index(length.from)] -
                       truth.centre_m[cell.target_index(length.to)])
                          .norm() +
                      length.sigma_m * random.normal();
  return cell;
}

Whitened over_truths(const IdentifyOptions& options) {
  Whitened sum;
  for (unsigned seed = 1; seed <= kTruths; ++seed) {
    const sim::Truth truth = plain_truth(demo_cell(), 100 + seed);
    // rho consistent with its prior.
    const double rho = 0.3e-3 * std::sin(17.0 * seed);
    const auto made = make_touches(demo_cell(), truth, {.fit = 80, .rho_m = rho, .seed = seed});
    const Cell cell = certified(truth, seed);
    const Calibration result = identify(cell, made.touches, options);
    const Eigen::VectorXd error = true_errors(truth, cell, rho, result);
    for (Eigen::Index i = 0; i < error.size(); ++i) {
      const ParameterResult& p = result.parameters[static_cast<std::size_t>(i)];
      if (p.decided_by != DecidedBy::kData) continue;
      sum.squares += std::pow(error[i] / p.sigma, 2);
      ++sum.count;
    }
    const Eigen::VectorXd sigma = result.covariance.diagonal().cwiseSqrt();
    // Parameters absent from all likely levels are known to be zero.
    const Eigen::VectorXd inverse = (sigma.array() > 0.0).select(sigma.cwiseInverse(), 0.0);
    const Eigen::MatrixXd correlation =
        inverse.asDiagonal() * result.covariance * inverse.asDiagonal();
    const Eigen::VectorXd scaled = error.cwiseProduct(inverse);
    sum.mahalanobis += scaled.dot(correlation.ldlt().solve(scaled));
    sum.dof += static_cast<int>((sigma.array() > 0.0).count());
    sum.chi2 += result.chi2_per_dof / kTruths;
  }
  std::printf("data-decided: rms %.3f over %d; all: %.3f per parameter; chi2 %.3f\n",
              std::sqrt(sum.squares / sum.count), sum.count, sum.mahalanobis / sum.dof, sum.chi2);
  return sum;
}

TEST(Honesty, SigmasAreRightWhenTheModelIs) {
  // The true level: without gears, so no choice is left.
  IdentifyOptions options;
  options.level = ModelLevel{0.0, 0.0, 0.0};
  const Whitened sum = over_truths(options);
  ASSERT_GT(sum.count, 10 * kTruths);
  // 50 independent truths with some 20 correlated parameters each: 1/sqrt(2 * 50 * 4) = 0.05 if
  // only four of them are independent.
  EXPECT_NEAR(std::sqrt(sum.squares / sum.count), 1.0, 0.15);
  // chi^2 of some 2000 degrees of freedom: 0.03. Below 1 because draws are truncated at 2.5 sigma
  // (0.02), and because fits with chi2 > 1 have wider bounds (0.08).
  EXPECT_NEAR(sum.mahalanobis / sum.dof, 0.92, 0.12);
  // 50 fits with 40 degrees of freedom or more: 0.03.
  EXPECT_NEAR(sum.chi2, 1.0, 0.1);
}

TEST(Honesty, SigmasAreNotTooSmallWhenTheLevelIsChosenByEvidence) {
  const Whitened sum = over_truths({});
  EXPECT_LT(std::sqrt(sum.squares / sum.count), 1.15);
  EXPECT_GT(std::sqrt(sum.squares / sum.count), 0.5);  // nor inflated
  EXPECT_LT(sum.mahalanobis / sum.dof, 1.15);
  EXPECT_LT(sum.chi2, 1.15);
}

TEST(Honesty, TheStatedBoundHoldsNineteenOfTwentyTrueErrors) {
  double local = 0.0, workspace = 0.0, worst = 1.0, predicted = 0.0, real = 0.0;
  constexpr int kRuns = 20;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    const sim::Truth truth = plain_truth(demo_cell(), 500 + seed);
    const auto made = make_touches(demo_cell(), truth, {.fit = 80, .seed = seed});
    const Calibration result = identify(demo_cell(), made.touches);
    std::vector<JointVector> around;
    for (const Touch& touch : made.touches) around.push_back(touch.joint_rad);
    const auto figures = sim::truth_figures(truth, result, around);
    local += figures.local.covered / kRuns;
    workspace += figures.workspace.covered / kRuns;
    worst = std::min(worst, figures.workspace.covered);
    predicted += result.predicted_workspace_m / kRuns;
    real += figures.workspace.mean_m / kRuns;
  }
  std::printf("covered: local %.3f workspace %.3f, worst run %.3f; m3 %.4f predicted %.4f mm\n",
              local, workspace, worst, real * 1e3, predicted * 1e3);
  EXPECT_GE(local, 0.93);
  EXPECT_GE(workspace, 0.93);
  // Errors of one arm are correlated, so single runs scatter; none may fail completely.
  EXPECT_GE(worst, 0.6);
  // The bound is not excessively large.
  EXPECT_LT(predicted, 2.0 * real);
  EXPECT_GT(predicted, 0.5 * real);
}

TEST(Honesty, GearErrorsThatTheRobotFileDoesNotNameWidenTheBounds) {
  double covered = 0.0, chi2 = 0.0;
  int seen = 0;
  constexpr int kRuns = 10;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    sim::TruthOptions options;
    options.seed = 900 + seed;
    options.gear_arcsec = 20.0;
    const sim::Truth truth = sim::draw_truth(demo_cell(), options);
    const auto made = make_touches(demo_cell(), truth, {.fit = 200, .seed = seed});
    const Calibration result = identify(demo_cell(), made.touches);
    std::vector<JointVector> around;
    for (const Touch& touch : made.touches) around.push_back(touch.joint_rad);
    covered += sim::truth_figures(truth, result, around).workspace.covered / kRuns;
    chi2 += result.chi2_per_dof / kRuns;
    seen += result.level.transmission > 0.0 || result.level.ripple_rad > 0.0;
  }
  std::printf("gears: covered %.3f chi2 %.3f, seen in %d of %d\n", covered, chi2, seen, kRuns);
  EXPECT_GE(covered, 0.90);
  EXPECT_EQ(seen, kRuns);
}

TEST(Honesty, AnArmThatGivesByATenthOfWhatOneWouldExpectIsNotTakenForAStiffOne) {
  double worst = 1.0, mean = 0.0;
  constexpr int kRuns = 8;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    sim::TruthOptions options;
    options.seed = 900 + seed;
    options.gear_arcsec = 7.0;
    options.compliance_rad_per_nm = 1e-6;  // 0.5 mrad under 500 N m
    const sim::Truth truth = sim::draw_truth(demo_cell(), options);
    const auto made = make_touches(demo_cell(), truth, {.fit = 100, .seed = seed});
    const Calibration result = identify(demo_cell(), made.touches);
    std::vector<JointVector> around;
    for (const Touch& touch : made.touches) around.push_back(touch.joint_rad);
    const double covered = sim::truth_figures(truth, result, around).workspace.covered;
    mean += covered / kRuns;
    worst = std::min(worst, covered);
  }
  EXPECT_GE(mean, 0.95);
  EXPECT_GE(worst, 0.85);
}

TEST(Honesty, ChiSquaredIsTheSumOfTheSquaresAndItsDegreesAreWhatTheUnknownsLeave) {
  const auto touches = make_touches(demo_cell(), plain_truth(demo_cell(), 2),
                                    {.fit = 100, .check = 10, .outlier_share = 0.05})
                           .touches;
  const Calibration result = identify(demo_cell(), touches);
  ASSERT_FALSE(result.outliers.empty());
  double sum = 0.0;
  int used = 0;
  for (const TouchResidual& r : result.residuals) {
    if (r.outlier || touches[r.touch].set == TouchSet::kCheck) continue;
    sum += r.whitened * r.whitened;
    ++used;
  }
  EXPECT_NEAR(result.chi2, sum, 1e-6 * sum);
  EXPECT_NEAR(result.chi2_per_dof, result.chi2 / result.degrees_of_freedom, 1e-12);
  // All 22 directions of the geometry and three of each of four places are decided by the touches,
  // except those decided by the lengths; gears and compliance take a part.
  EXPECT_LT(result.degrees_of_freedom, used - 22);
  EXPECT_GT(result.degrees_of_freedom, used - static_cast<int>(result.parameters.size()));
}

TEST(Honesty, NoiseTwiceTheStatedOneShowsInChiSquareAndInTheBounds) {
  const sim::Truth truth = plain_truth(demo_cell(), 1);
  IdentifyOptions options;
  options.level = ModelLevel{true, 0.0, 0.0};
  const auto calm =
      identify(demo_cell(), make_touches(demo_cell(), truth, {.fit = 150, .noise_m = 3e-5}).touches,
               options);
  const auto loud =
      identify(demo_cell(), make_touches(demo_cell(), truth, {.fit = 150, .noise_m = 6e-5}).touches,
               options);
  // The same random numbers: the ratio holds to second order, the size to 1/sqrt(2 * 100) = 7 %.
  EXPECT_NEAR(loud.chi2_per_dof / calm.chi2_per_dof, 4.0, 0.8);
  EXPECT_NEAR(loud.touch_noise_m, 6e-5, 1.5e-5);
  EXPECT_GT(loud.predicted_workspace_m, 1.5 * calm.predicted_workspace_m);
}

}  // namespace
}  // namespace cellcal::calib
