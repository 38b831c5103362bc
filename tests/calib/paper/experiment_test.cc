// The rerun of the seed paper: its task meets its conditions, and the results of cellcal.

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/experiments/paper/figures.h"
#include "tests/experiments/paper/table.h"
#include "tests/experiments/paper/task.h"

namespace cellcal::sim::paper {
namespace {

constexpr double kMm = 1e-3;

const Solved& simulation() {
  static const Solved solved = solve(make_task(simulation_conditions()));
  return solved;
}

const Solved& experiment() {
  static const Solved solved = solve(make_task(experiment_conditions()));
  return solved;
}

TEST(PaperTask, EveryTipLiesOnTheSphereAndEveryAngleInsideTheLimits) {
  const Task& task = simulation().task;
  const calib::ArmModel model(task.cell.robot, task.cell.tool);
  ASSERT_EQ(task.touches.size(), 80u);
  for (std::size_t i = 0; i < task.touches.size(); ++i) {
    const std::vector<double>& q = task.touches[i].joint_rad;
    const Eigen::Vector3d tip = model.position(model.prepare(q), task.true_errors.data());
    EXPECT_NEAR((tip - sphere_centre()).norm(), 0.030, 1e-12) << i;
    for (std::size_t j = 0; j < q.size(); ++j) {
      EXPECT_GE(q[j], task.cell.robot.joints[j].min_rad) << i;
      EXPECT_LE(q[j], task.cell.robot.joints[j].max_rad) << i;
    }
  }
}

TEST(PaperTask, TouchesSpreadOverTheSphereAndTheToolComesFromOutside) {
  const Task& task = simulation().task;
  const calib::ArmModel model(task.cell.robot, task.cell.tool);
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < task.touches.size(); ++i) {
    const Eigen::Vector3d normal = (task.tip_m[i] - task.centre_m).normalized();
    spread += normal * normal.transpose() / static_cast<double>(task.touches.size());
    const Eigen::Vector3d z = model.nominal_tcp(task.touches[i].joint_rad).linear() *
                              task.cell.tool.tcp.linear().transpose().col(2);
    EXPECT_GT(-z.dot(normal), 0.45) << i;  // within 60 deg and the errors
  }
  EXPECT_GT(spread.selfadjointView<Eigen::Lower>().eigenvalues()[0], 0.1);
}

TEST(PaperTask, TheExperimentsTouchesScatterByItsNoise) {
  const Task& task = experiment().task;
  double sum = 0.0;
  for (const Eigen::Vector3d& tip : task.tip_m)
    sum += std::pow((tip - task.centre_m).norm() - task.radius_m, 2);
  EXPECT_NEAR(std::sqrt(sum / static_cast<double>(task.tip_m.size())), 0.03 * kMm, 0.008 * kMm);
}

TEST(PaperTask, TheSameSeedGivesTheSameTouchesAndAnotherSeedOthers) {
  Conditions conditions = simulation_conditions();
  EXPECT_EQ(make_task(conditions).touches, simulation().task.touches);
  conditions.seed = 2;
  EXPECT_NE(make_task(conditions).touches, simulation().task.touches);
}

TEST(PaperTask, ErrorsForTheWrongNumberOfJointsAreRefused) {
  Conditions conditions = simulation_conditions();
  conditions.errors.pop_back();
  EXPECT_THROW(make_task(conditions), std::runtime_error);
}

TEST(Rerun, CellcalExplainsUnseenNoiseFreeTouchesToAMillionthOfAMillimetre) {
  EXPECT_EQ(simulation().ours.check.count, 30);
  EXPECT_LT(simulation().ours.check.max_m, 1e-6 * kMm);
}

TEST(Rerun, CellcalIsRightInTheWorkspaceWithoutNoiseWhereThePaperIsNot) {
  EXPECT_LT(workspace_error(simulation().task, simulation().ours).max_m, 1e-5 * kMm);
  EXPECT_GT(workspace_error(simulation().task, simulation().paper).mean_m, 0.1 * kMm);
}

TEST(Rerun, BothEndAtTheNoiseOnUnseenTouchesOfTheExperiment) {
  EXPECT_LT(experiment().ours.check.mean_m, 0.04 * kMm);
  EXPECT_LT(experiment().paper.check.mean_m, 0.04 * kMm);
}

TEST(Rerun, CellcalsBoundForASingleSphereDoesNotClaimTheWorkspace) {
  EXPECT_FALSE(experiment().ours.verdict.workspace);
}

TEST(Rerun, TheTableSaysPlainlyWhatDoesNotComeOut) {
  const std::string table = comparison(simulation(), experiment(), {});
  EXPECT_NE(table.find("does NOT come out: simulation, mean after, paper's estimator"),
            std::string::npos);
  EXPECT_NE(table.find("0.665 / 1.104"), std::string::npos);
  EXPECT_NE(table.find("0.383 / 1.153"), std::string::npos);
}

TEST(Rerun, WritesTheFourFiguresAndAPageThatHoldsThem) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "cellcal-paper-figures";
  std::filesystem::remove_all(folder);
  write_figures(make_figures(simulation(), experiment()), "a < b & c", folder);
  for (const char* name : {"figure-6.svg", "figure-7.svg", "figure-8.svg", "figure-11.svg"})
    EXPECT_GT(std::filesystem::file_size(folder / name), 2000u) << name;
  std::ifstream page(folder / "figures.html");
  std::stringstream text;
  text << page.rdbuf();
  EXPECT_NE(text.str().find("a &lt; b &amp; c"), std::string::npos);
  EXPECT_EQ(text.str().find("nan"), std::string::npos);
  EXPECT_EQ(text.str().find("inf"), std::string::npos);
  std::filesystem::remove_all(folder);
}

TEST(Rerun, AFolderThatCannotBeWrittenIsNamed) {
  try {
    write_figures({{"figure-6.svg", "", "<svg/>"}}, "", "/proc/no-such-place");
    FAIL() << "wrote into /proc";
  } catch (const std::exception& error) {
    EXPECT_NE(std::string(error.what()).find("/proc/no-such-place"), std::string::npos);
  }
}

}  // namespace
}  // namespace cellcal::sim::paper
