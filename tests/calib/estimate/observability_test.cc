// Observability of the geometry by the touches, in the indices of the literature.

#include "calib/estimate/observability.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <Eigen/SVD>
#include <cmath>

#include "calib/estimate/start.h"
#include "calib/identify/identify.h"
#include "calib/identify/identify_once.h"
#include "calib/result/level.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::make_touches;
using testing::one_sphere_cell;
using testing::plain_truth;

std::vector<Touch> touches_of(const Cell& cell, int fit, unsigned seed = 1) {
  return make_touches(cell, plain_truth(cell, seed), {.fit = fit, .seed = seed}).touches;
}

Observability of(const Cell& cell, const std::vector<Touch>& touches) {
  return identify_single_pass(cell, touches).observability;
}

TEST(Observability, IndicesAreTheirFormulas) {
  const double s[] = {1.0, 4.0, 2.0};
  const Observability o = indices_of(s, 16);
  EXPECT_EQ(o.rank, 3);
  EXPECT_EQ(o.determined, 2) << "1 is no better than the tolerance";
  EXPECT_NEAR(o.o1, 2.0 / 4.0, 1e-12);
  EXPECT_NEAR(o.o2, 0.25, 1e-12);
  EXPECT_NEAR(o.o3, 1.0, 1e-12);
  EXPECT_NEAR(o.o4, 0.25, 1e-12);
  EXPECT_NEAR(o.o5, 1.0 / 1.75, 1e-12);
  EXPECT_NEAR(o.condition, 4.0, 1e-12);
  EXPECT_EQ(o.singular_values, (std::vector<double>{4.0, 2.0, 1.0}));
}

TEST(Observability, WhatIsNotSeenLowersTheRankAndLeavesTheIndicesFinite) {
  const double s[] = {4.0, 0.0, 1e-9, 2.0};
  const Observability o = indices_of(s, 4);
  EXPECT_EQ(o.rank, 2);
  EXPECT_EQ(o.directions, 4);
  EXPECT_NEAR(o.condition, 2.0, 1e-12);
  const double nothing[] = {0.0, 0.0};
  const Observability none = indices_of(nothing, 4);
  EXPECT_EQ(none.rank, 0);
  for (const double index : {none.o1, none.o2, none.o3, none.o4, none.o5, none.condition})
    EXPECT_EQ(index, 0.0);
}

/// The demo cell's problem at its nominal values.
struct Stage {
  explicit Stage(const std::vector<Touch>& made)
      : touches(made),
        cell(at_level(demo_cell(), ModelLevel{})),
        arm(cell.robot, cell.tool),
        problem(cell, arm, touches, starting_places(cell, arm, touches)),
        linear(linearise(problem, Eigen::VectorXd::Zero(problem.size()),
                         std::vector<bool>(touches.size(), true))) {}

  const std::vector<Touch>& touches;
  Cell cell;
  ArmModel arm;
  Problem problem;
  Linearisation linear;
};

TEST(Observability, SingularValuesAreThoseOfTheRowsWithTargetsProjectedOut) {
  const auto touches = touches_of(demo_cell(), 100);
  const Stage stage(touches);
  const Problem& problem = stage.problem;
  std::vector<int> geometry, nuisance;
  for (int i = 0; i < problem.size(); ++i) {
    const bool arm = i < problem.arm_size();
    const auto kind =
        arm ? problem.arm().parameters()[static_cast<std::size_t>(i)].kind : ParameterKind::kTheta;
    if (!arm) nuisance.push_back(i);
    if (arm && (kind <= ParameterKind::kBeta || kind >= ParameterKind::kDeflection))
      geometry.push_back(i);
  }
  // Rows of the touches, of the lengths, and of measured diameters and tip; by QR and singular
  // value decomposition, without forming squares.
  const auto measured = stage.linear.jacobian.rows();
  const auto width = static_cast<Eigen::Index>(nuisance.size());
  Eigen::MatrixXd g = Eigen::MatrixXd::Zero(measured + width, geometry.size());
  Eigen::MatrixXd t = Eigen::MatrixXd::Zero(measured + width, width);
  for (std::size_t k = 0; k < geometry.size(); ++k)
    g.col(k).head(measured) = stage.linear.jacobian.col(geometry[k]);
  for (Eigen::Index k = 0; k < width; ++k) {
    t.col(k).head(measured) = stage.linear.jacobian.col(nuisance[static_cast<std::size_t>(k)]);
    t(measured + k, k) =
        problem.unknowns()[static_cast<std::size_t>(nuisance[static_cast<std::size_t>(k)])]
                .held_by_geometry
            ? 1.0
            : 0.0;
  }
  const Eigen::MatrixXd q = Eigen::HouseholderQR<Eigen::MatrixXd>(t).householderQ() *
                            Eigen::MatrixXd::Identity(t.rows(), width);
  g -= q * (q.transpose() * g).eval();
  const Eigen::VectorXd expected = Eigen::JacobiSVD<Eigen::MatrixXd>(g).singularValues();

  // Without named frame directions all are included; the last three are the frame's, unobserved.
  const Observability o = observability(problem, stage.linear, Eigen::MatrixXd(problem.size(), 0));
  ASSERT_EQ(o.singular_values.size(), geometry.size());
  EXPECT_EQ(o.rows, measured);
  EXPECT_EQ(o.unknowns, problem.size());
  for (std::size_t k = 0; k + 3 < geometry.size(); ++k)
    EXPECT_NEAR(o.singular_values[k] / expected[static_cast<Eigen::Index>(k)], 1.0, 1e-4) << k;
  EXPECT_EQ(o.rank, o.directions - 3);

  // Removing the frame directions leaves the others unchanged.
  const Calibration result = identify_single_pass(demo_cell(), touches);
  const Observability& without = result.observability;
  EXPECT_EQ(without.directions, o.directions - 3);
  EXPECT_EQ(without.rank, o.rank);
}

TEST(Observability, TakingTheFrameOutLeavesTheOtherSingularValues) {
  const auto touches = touches_of(demo_cell(), 100);
  const Stage stage(touches);
  Eigen::MatrixXd frame = Eigen::MatrixXd::Zero(stage.problem.size(), 1);
  // A rotation of A1's zero moves only the targets: its part of the arm is a single column.
  for (int i = 0; i < stage.problem.arm_size(); ++i)
    if (stage.problem.unknowns()[static_cast<std::size_t>(i)].key ==
        joint_parameter(ParameterKind::kTheta, 0))
      frame(i, 0) = 1.0;
  ASSERT_EQ(frame.sum(), 1.0);
  const Observability all =
      observability(stage.problem, stage.linear, Eigen::MatrixXd(stage.problem.size(), 0));
  const Observability rest = observability(stage.problem, stage.linear, frame);
  ASSERT_EQ(rest.directions, all.directions - 1);
  EXPECT_EQ(rest.rank, all.rank);
  for (int k = 0; k < rest.rank; ++k)
    EXPECT_NEAR(rest.singular_values[static_cast<std::size_t>(k)] /
                    all.singular_values[static_cast<std::size_t>(k)],
                1.0, 1e-3)
        << k;
}

TEST(Observability, TheSameTouchesTwiceTellEachDirectionBetterByTheRootOfTwo) {
  Cell cell = demo_cell();
  cell.lengths.clear();
  cell.radius_offset_sigma_m = 0.0;
  for (Target& target : cell.targets) target.diameter_sigma_m = 0.0;
  auto touches = touches_of(cell, 60);
  IdentifyOptions plain;
  plain.reject_outliers = false;
  plain.level = ModelLevel{};  // the weights must not depend on the level
  const Observability once = identify_single_pass(cell, touches, plain).observability;
  for (std::size_t i = 0; i < 60; ++i) touches.push_back(Touch(touches[i]));
  const Observability twice = identify_single_pass(cell, touches, plain).observability;
  ASSERT_EQ(once.rank, twice.rank);
  EXPECT_NEAR(twice.o1 / once.o1, 1.0, 0.01);
  EXPECT_NEAR(twice.o2 / once.o2, 1.0, 0.01);
  EXPECT_NEAR(twice.o3 / once.o3, std::sqrt(2.0), 0.02);
  EXPECT_NEAR(twice.o4 / once.o4, std::sqrt(2.0), 0.02);
  EXPECT_NEAR(twice.o5 / once.o5, std::sqrt(2.0), 0.02);
  EXPECT_NEAR(twice.condition / once.condition, 1.0, 0.01);
}

TEST(Observability, FourSpheresWithLengthsTellMoreThanOneSphereTouchedAsOften) {
  const Observability one = of(one_sphere_cell(), touches_of(one_sphere_cell(), 60));
  const Observability four = of(demo_cell(), touches_of(demo_cell(), 60));
  EXPECT_EQ(one.directions, four.directions) << "the arm is the same";
  EXPECT_GT(four.determined, one.determined);
  EXPECT_GT(four.o3, 2.0 * one.o3);
  EXPECT_LT(four.condition, one.condition);
}

TEST(Observability, TouchesFromOneSideAreWorseInEveryIndex) {
  const auto from = [](double widest_rad) {
    return of(demo_cell(), make_touches(demo_cell(), plain_truth(demo_cell(), 3),
                                        {.fit = 60, .widest_rad = widest_rad, .seed = 3})
                               .touches);
  };
  const Observability wide = from(3.2), narrow = from(0.6);
  ASSERT_EQ(wide.rank, narrow.rank);
  EXPECT_GT(wide.o1, narrow.o1);
  EXPECT_GT(wide.o3, narrow.o3);
  EXPECT_GT(wide.o5, narrow.o5);
}

TEST(Observability, FewerTouchesThanUnknownsAreSaidToTellFewerDirections) {
  const Observability few = of(demo_cell(), touches_of(demo_cell(), 20));
  EXPECT_LT(few.rows, few.unknowns);
  // Twenty touches and six lengths; the four centres need twelve, the tip's radius none.
  EXPECT_LE(few.rank, few.rows - 12);
  EXPECT_LT(few.rank, few.directions);
  EXPECT_LE(few.determined, few.rank);
  for (const double index : {few.o1, few.o2, few.o3, few.o4, few.o5, few.condition}) {
    EXPECT_TRUE(std::isfinite(index));
    EXPECT_GT(index, 0.0);
  }
}

}  // namespace
}  // namespace cellcal::calib
