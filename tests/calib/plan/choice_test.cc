// The updates of a choice are correct, and a choice is better than a random one.

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <set>

#include "calib/model/error.h"
#include "calib/model/linear.h"
#include "calib/plan/choose.h"
#include "calib/plan/design.h"
#include "calib/plan/plan.h"
#include "tests/calib/plan/random_rows.h"
#include "tests/calib/simulate.h"
#include "tests/calib/thrown.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::random_rows;

/// trace(W S) of a set, computed from scratch.
double left_unknown(const RowMajor& rows, const std::vector<Eigen::Index>& set,
                    const Eigen::MatrixXd& moves) {
  const Eigen::Index n = rows.cols();
  Eigen::MatrixXd information = Eigen::MatrixXd::Identity(n, n);
  for (const Eigen::Index c : set) information += rows.row(c).transpose() * rows.row(c);
  const Eigen::MatrixXd covariance = information.llt().solve(Eigen::MatrixXd::Identity(n, n));
  const Eigen::Index arm = moves.cols();
  return (moves * covariance.topLeftCorner(arm, arm) * moves.transpose()).trace();
}

TEST(Design, GainsAndLossesAreWhatASetFromNothingWouldShow) {
  Random random(1);
  const RowMajor rows = random_rows(30, 9, random);
  const Eigen::MatrixXd moves = random_rows(60, 6, random);  // three unknowns move no tip
  Design design(rows, Eigen::MatrixXd::Identity(9, 9), moves);
  std::vector<Eigen::Index> set;
  for (int k = 0; k < 60; ++k) {
    const auto c = static_cast<Eigen::Index>(random.below(30));
    const double before = left_unknown(rows, set, moves);
    if (design.has(c)) {
      const double loss = design.loss(c);
      const Eigen::VectorXd without = design.gains_without(c);
      design.drop(c);
      for (Eigen::Index other = 0; other < design.size(); ++other)
        EXPECT_NEAR(without[other], design.gain(other), 1e-8 * (1.0 + design.gain(other)));
      set.erase(std::find(set.begin(), set.end(), c));
      EXPECT_NEAR(left_unknown(rows, set, moves) - before, loss, 1e-8 * (before + loss));
    } else {
      const double gain = design.gain(c);
      design.take(c);
      set.push_back(c);
      EXPECT_NEAR(before - left_unknown(rows, set, moves), gain, 1e-8 * before);
    }
  }
  Eigen::MatrixXd information = Eigen::MatrixXd::Identity(9, 9);
  for (const Eigen::Index c : set) information += rows.row(c).transpose() * rows.row(c);
  EXPECT_LT((design.covariance_u() * information - Eigen::MatrixXd::Identity(9, 9)).norm(), 1e-9);
}

double predicted(Criterion criterion, AccuracyRegion region = {}, int touches = 40) {
  PlanOptions options;
  options.fit_touches = touches;
  options.check_touches = 0;
  options.criterion = criterion;
  options.region = region;
  return make_plan(demo_cell(), options).predicted_mean_m;
}

TEST(Choice, OfTheLeastVarianceBeatsAllOthers) {
  const double best = predicted(Criterion::kI);
  for (const Criterion other : {Criterion::kD, Criterion::kEven, Criterion::kRandom})
    EXPECT_LT(best, predicted(other));
  // Equivalent to many more random touches.
  EXPECT_LT(best, predicted(Criterion::kRandom, {}, 60));
}

TEST(Choice, IsBetterForTheRegionThatItWasMadeFor) {
  const AccuracyRegion near{AccuracyRegion::Kind::kBox, {0.8, -0.3, 0.2}, {1.2, 0.3, 0.6}};
  EXPECT_LT(predicted(Criterion::kI, near), predicted(Criterion::kD, near));
  EXPECT_LT(predicted(Criterion::kI, near), predicted(Criterion::kI));  // and less uncertainty
}

/// Candidates around one sphere, without collision checks.
std::vector<Candidate> some_candidates() {
  PlanOptions options;
  options.fit_touches = 60;
  options.check_touches = 0;
  std::vector<Candidate> candidates;
  for (const PlannedTouch& touch : make_plan(demo_cell(), options).touches) {
    Candidate c;
    c.target = demo_cell().target_index(touch.target);
    c.normal = touch.normal;
    const double share = touch.expected_m / touch.search_m;
    for (std::size_t i = 0; i < touch.standoff.size(); ++i)
      c.contact.push_back(touch.standoff[i] + share * (touch.end[i] - touch.standoff[i]));
    candidates.push_back(std::move(c));
  }
  return candidates;
}

TEST(Choice, KnowsTheFunctionsThatTheRobotFileStates) {
  const auto candidates = some_candidates();
  const DesignProblem plain = design_problem(demo_cell(), candidates, {});
  const auto of_size = [&](double sigma_rad) {
    Cell cell = demo_cell();
    for (Joint& joint : cell.robot.joints) joint.function_sigma_rad = sigma_rad;
    for (Joint& joint : cell.robot.joints) joint.function_reach_rad = 0.1;
    return design_problem(cell, candidates, {});
  };
  const DesignProblem once = of_size(5e-5), twice = of_size(1e-4);
  const Eigen::Index arm = plain.arm->size(), waves = once.moves_m.cols() - arm;
  EXPECT_EQ(waves, 6 * 5 * 2);
  EXPECT_EQ(once.rows.cols(), plain.rows.cols() + waves);
  EXPECT_TRUE(once.rows.leftCols(arm).isApprox(plain.rows.leftCols(arm)));
  EXPECT_TRUE(once.rows.rightCols(plain.rows.cols() - arm)
                  .isApprox(plain.rows.rightCols(plain.rows.cols() - arm)));
  const auto of_waves = [&](const DesignProblem& p) { return p.rows.middleCols(arm, waves); };
  EXPECT_TRUE(of_waves(twice).isApprox(2.0 * of_waves(once)));
  EXPECT_TRUE(once.covariance_u.block(arm, arm, waves, waves).isIdentity());
}

TEST(Choice, ExchangesOnlyForBetterTouches) {
  const auto candidates = some_candidates();
  ChooseOptions options;
  options.count = 20;
  options.least_per_target = 3;
  options.exchanges = 0;
  const double greedy = choose(demo_cell(), candidates, options).predicted_mean_m;
  options.exchanges = 3;
  EXPECT_LT(choose(demo_cell(), candidates, options).predicted_mean_m, greedy);
}

TEST(Choice, PicksOnlyWhatIsPossibleAndNothingTwice) {
  const auto candidates = some_candidates();
  for (const Criterion criterion :
       {Criterion::kI, Criterion::kD, Criterion::kEven, Criterion::kRandom}) {
    ChooseOptions options;
    options.count = 25;
    options.least_per_target = 3;
    options.criterion = criterion;
    std::set<std::size_t> asked;
    options.possible = [&](std::size_t c) {
      EXPECT_TRUE(asked.insert(c).second) << "asked again";
      return c % 2 == 0;
    };
    const Choice choice = choose(demo_cell(), candidates, options);
    EXPECT_EQ(choice.picked.size(), 25U);
    const std::set<std::size_t> picked(choice.picked.begin(), choice.picked.end());
    EXPECT_EQ(picked.size(), choice.picked.size());
    std::vector<int> of_target(demo_cell().targets.size(), 0);
    for (const std::size_t c : picked) {
      EXPECT_EQ(c % 2, 0U);
      ++of_target[candidates[c].target];
    }
    for (const int touches : of_target) EXPECT_GE(touches, 3);
  }
}

TEST(Choice, OfMoreThanThereIsTakesWhatThereIs) {
  const auto candidates = some_candidates();
  ChooseOptions options;
  options.count = 100;
  EXPECT_EQ(choose(demo_cell(), candidates, options).picked.size(), candidates.size());
  EXPECT_TRUE(choose(demo_cell(), {}, options).picked.empty());
}

TEST(AccuracyRegion, IsReadAndRefusedInWords) {
  EXPECT_EQ(parse_accuracy_region("workspace").kind, AccuracyRegion::Kind::kWorkspace);
  EXPECT_EQ(parse_accuracy_region("targets").kind, AccuracyRegion::Kind::kTargets);
  EXPECT_EQ(parse_accuracy_region("tcp").kind, AccuracyRegion::Kind::kTool);
  const AccuracyRegion box = parse_accuracy_region("box:1200,300,600,800,-300.5,2e2");
  EXPECT_EQ(box.low_m, Eigen::Vector3d(0.8, -0.3005, 0.2));
  EXPECT_EQ(box.high_m, Eigen::Vector3d(1.2, 0.3, 0.6));
  for (const char* wrong :
       {"", "box", "box:", "box:1,2,3", "box:1,2,3,4,5,6,7", "box:1,2,3,4,5,nan",
        "box:1,2,3,4,5,1e9", "box:1,2,3 4,5,6", "box:1,2,3,4,5,6,", "Workspace", "tcp "})
    EXPECT_EQ(testing::thrown<PlanError>([&] { (void)parse_accuracy_region(wrong); }).kind,
              PlanError::Kind::kRequest)
        << wrong;
}

TEST(AccuracyRegion, InABoxOutOfReachIsRefused) {
  PlanOptions options;
  options.fit_touches = 10;
  options.region = {AccuracyRegion::Kind::kBox, {8.0, 0.0, 0.0}, {9.0, 1.0, 1.0}};
  EXPECT_EQ(testing::thrown<PlanError>([&] { (void)make_plan(demo_cell(), options); }).kind,
            PlanError::Kind::kRequest);
}

TEST(AccuracyRegion, InABoxHasItsTipsInside) {
  const ArmModel arm(demo_cell().robot, demo_cell().tool);
  const AccuracyRegion box{AccuracyRegion::Kind::kBox, {0.8, -0.3, 0.2}, {1.2, 0.3, 0.6}};
  const auto postures = accuracy_region_postures(box, arm, {}, {}, 0.05, 50);
  EXPECT_EQ(postures.size(), 50U);
  for (const JointVector& q : postures) {
    const Eigen::Vector3d tip = arm.nominal_tip_m(q);
    EXPECT_TRUE(((tip - box.low_m).array() > -1e-9).all() &&
                ((box.high_m - tip).array() > -1e-9).all())
        << tip.transpose();
  }
}

}  // namespace
}  // namespace cellcal::calib
