// The seed paper's estimator, on its own task and beyond its assumptions.

#include <gtest/gtest.h>

#include "calib/estimate/seed_paper.h"
#include "tests/calib/thrown.h"
#include "tests/experiments/paper/task.h"

namespace cellcal::calib {
namespace {

using sim::paper::Task;

constexpr double kMm = 1e-3;

const Task& simulation() {
  static const Task task = make_task(sim::paper::simulation_conditions());
  return task;
}

const Task& experiment() {
  static const Task task = make_task(sim::paper::experiment_conditions());
  return task;
}

/// A task with errors scaled by `share` of the paper's: the residual must decrease with its square.
double unseen_residual(double share) {
  sim::paper::Conditions conditions = sim::paper::simulation_conditions();
  for (sim::paper::JointErrors& e : conditions.errors)
    e = {share * e.theta_rad, share * e.d_m, share * e.a_m, share * e.alpha_rad,
         share * e.beta_rad};
  conditions.deflection *= share;
  const Task task = make_task(conditions);
  PaperOptions options;
  options.lambda = 1e-9;  // small: the residual is due to the linearisation
  return identify_paper(task.cell, task.touches, options).check.mean_m;
}

TEST(PaperEstimator, LeavesSomeMicronsOnUnseenNoiseFreeTouchesAndNotTheTwoThirdsThatItPublishes) {
  const Calibration result = identify_paper(simulation().cell, simulation().touches);
  EXPECT_GT(result.check.mean_m, 0.001 * kMm);  // its linearised model cannot reach zero
  EXPECT_LT(result.check.mean_m, 0.02 * kMm);
  EXPECT_LT(result.check.max_m, 0.05 * kMm);
  EXPECT_GT(result.before.mean_m, 0.5 * kMm);
}

TEST(PaperEstimator, ItsRemainderIsOfSecondOrderInTheErrors) {
  const double full = unseen_residual(1.0), half = unseen_residual(0.5);
  EXPECT_GT(full / half, 3.0);
  EXPECT_LT(full / half, 5.5);
}

TEST(PaperEstimator, EndsAtTheNoiseUnderTheExperimentsConditions) {
  const Calibration result = identify_paper(experiment().cell, experiment().touches);
  EXPECT_LT(result.check.mean_m, 0.05 * kMm);
  EXPECT_GT(result.check.mean_m, 0.01 * kMm);
}

TEST(PaperEstimator, ASmallLambdaWandersWhereTheTouchesDoNotTell) {
  PaperOptions wide, small;
  wide.lambda = 1e-4;
  small.lambda = 1e-8;
  const auto exact = [](const PaperOptions& options) {
    return check_on_exact_chain(experiment(),
                                identify_paper(experiment().cell, experiment().touches, options))
        .mean_m;
  };
  EXPECT_GT(exact(small), 3.0 * exact(wide));
}

TEST(PaperEstimator, ItsResidualOnTheSphereIsNotAccuracyInTheWorkspace) {
  const Calibration result = identify_paper(simulation().cell, simulation().touches);
  EXPECT_GT(workspace_error(simulation(), result).mean_m, 50.0 * result.check.mean_m);
}

TEST(PaperEstimator, HasTwentyEightUnknownsAndNeverPublishes) {
  const Calibration result = identify_paper(simulation().cell, simulation().touches);
  EXPECT_EQ(result.parameters.size(), 28u);
  EXPECT_EQ(result.covariance.rows(), 28);
  EXPECT_EQ(result.method, "paper");
  EXPECT_FALSE(result.verdict.publish());
  ASSERT_EQ(result.verdict.findings.size(), 1u);
  EXPECT_EQ(result.verdict.findings[0].kind, FindingKind::kReferenceMethod);
}

TEST(PaperEstimator, RecordsEachIterationFromTheStart) {
  PaperTrace trace;
  PaperOptions options;
  options.iterations = 7;
  const Calibration result =
      identify_paper(simulation().cell, simulation().touches, options, &trace);
  ASSERT_EQ(trace.iterations.size(), 8u);
  EXPECT_DOUBLE_EQ(trace.iterations.front().mean_m, result.before.mean_m);
  EXPECT_DOUBLE_EQ(trace.iterations.back().mean_m, result.after.mean_m);
  EXPECT_LT(trace.iterations[2].mean_m, trace.iterations[0].mean_m);
}

TEST(PaperEstimator, LinearModelAgreesWithTheExactChainForSmallErrors) {
  // Errors of a hundredth: the two models differ by a ten-thousandth of the full second-order term.
  EXPECT_LT(unseen_residual(0.01), 1e-5 * kMm);
}

IdentifyError refusal(const Cell& cell, const std::vector<Touch>& touches,
                      const PaperOptions& options = {}) {
  return testing::thrown<IdentifyError>([&] { (void)identify_paper(cell, touches, options); });
}

TEST(PaperEstimator, RefusesASecondSphereByName) {
  Cell cell = simulation().cell;
  cell.targets.push_back(cell.targets[0]);
  cell.targets[1].id = "S2";
  std::vector<Touch> touches = simulation().touches;
  touches.back().target = "S2";
  const IdentifyError error = refusal(cell, touches);
  EXPECT_EQ(error.kind, IdentifyError::Kind::kTouches);
  EXPECT_EQ(error.target, "S2");
  EXPECT_NE(std::string(error.what()).find("S1 and S2"), std::string::npos) << error.what();
}

TEST(PaperEstimator, RefusesPointsTooFewTouchesAndWrongJointCounts) {
  Cell points = simulation().cell;
  points.targets[0].kind = TargetKind::kPoint;
  using Kind = IdentifyError::Kind;
  EXPECT_EQ(refusal(points, simulation().touches).kind, Kind::kTouches);
  EXPECT_EQ(refusal(simulation().cell, {}).kind, Kind::kUndetermined);
  std::vector<Touch> few(simulation().touches.begin(), simulation().touches.begin() + 3);
  EXPECT_EQ(refusal(simulation().cell, few).kind, Kind::kUndetermined);
  std::vector<Touch> short_row = simulation().touches;
  short_row[4].joint_rad.pop_back();
  EXPECT_EQ(refusal(simulation().cell, short_row).kind, Kind::kTouches);
  PaperOptions options;
  options.lambda = 0.0;
  EXPECT_EQ(refusal(simulation().cell, simulation().touches, options).kind, Kind::kOptions);
}

}  // namespace
}  // namespace cellcal::calib
