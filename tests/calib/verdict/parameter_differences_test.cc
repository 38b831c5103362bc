// Two calibrations of one cell, parameter by parameter.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "calib/verdict/change.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;

ParameterResult at(const ParameterKey& key, double value, double sigma) {
  ParameterResult one;
  one.key = key;
  one.nominal = value;
  one.sigma = sigma;
  return one;
}

/// A2's zero, compliance of A2, and a centre of each target, at its number in metres.
Calibration with_centres() {
  Calibration c;
  c.cell = demo_cell();
  c.parameters.push_back(at(joint_parameter(ParameterKind::kTheta, 1), 0.0, 1e-5));
  for (std::size_t t = 0; t < c.cell.targets.size(); ++t)
    c.parameters.push_back(
        at(target_parameter(ParameterKind::kCentre, t), static_cast<double>(t), 1e-5));
  return c;
}

TEST(ParameterDifferences, AreNoneOfTheSameTargetsInAnotherOrder) {
  const Calibration before = with_centres();
  Calibration after = before;
  std::ranges::reverse(after.cell.targets);
  const std::size_t last = after.cell.targets.size() - 1;
  for (ParameterResult& one : after.parameters)
    if (one.key.target >= 0) one.key.target = static_cast<int>(last) - one.key.target;
  const ParameterDifferences none = parameter_differences(before, after);
  EXPECT_TRUE(none.moved.empty());
  EXPECT_TRUE(none.only_before.empty());
  EXPECT_TRUE(none.only_after.empty());
}

TEST(ParameterDifferences, BeginAtTwiceTheRootOfBothVariances) {
  const Calibration before = with_centres();
  Calibration after = before;
  constexpr double kExpanded = 2.8284e-5;  // 2 * sqrt(2) * 1e-5
  after.parameters[0].correction = 0.99 * kExpanded;
  after.parameters[1].correction = -1.01 * kExpanded;
  after.parameters[2].correction = 3.0 * kExpanded;
  const auto moved = parameter_differences(before, after).moved;
  ASSERT_EQ(moved.size(), 2u);
  EXPECT_EQ(moved[0].name, demo_cell().targets[1].id + ".x") << "the farthest first";
  EXPECT_EQ(moved[1].name, demo_cell().targets[0].id + ".x");
  EXPECT_NEAR(moved[1].expanded, kExpanded, 1e-9);
  EXPECT_NEAR(moved[1].after - moved[1].before, -1.01 * kExpanded, 1e-12);
}

TEST(ParameterDifferences, WhatTheFrameDecidesIsNoneAndIsNamed) {
  const Calibration before = with_centres();
  Calibration after = before;
  after.parameters[0].correction = 1e-3;
  after.parameters[0].decided_by = DecidedBy::kFrame;
  for (const auto& differences :
       {parameter_differences(before, after), parameter_differences(after, before)}) {
    EXPECT_TRUE(differences.moved.empty());
    EXPECT_EQ(differences.not_compared, std::vector<std::string>{"A2.theta"});
  }
  EXPECT_TRUE(parameter_differences(before, before).not_compared.empty());
}

TEST(ParameterDifferences, WhatOnlyOneHasIsNamed) {
  const Calibration before = with_centres();
  Calibration after = before;
  const std::string gone = after.cell.targets.back().id;
  after.cell.targets.back().id = "new";
  after.parameters.push_back(at(joint_parameter(ParameterKind::kCompliance, 1), 1e-6, 1e-7));
  const ParameterDifferences both = parameter_differences(before, after);
  EXPECT_TRUE(both.moved.empty());
  EXPECT_EQ(both.only_before, (std::vector<std::string>{gone + ".x"}));
  EXPECT_EQ(both.only_after, (std::vector<std::string>{"new.x", "A2.compliance"}));
}

/// An update frees a knocked tool, which the calibration before had as stated.
TEST(ParameterDifferences, OfAToolThatOnlyOneIdentifiedAreFromWhereItIsStated) {
  const Calibration before = with_centres();
  Calibration after = before;
  for (const int axis : {0, 1})
    after.parameters.push_back(at(tool_parameter(ParameterKind::kTcp, 0, axis), 0.0, 1e-5));
  after.parameters.back().correction = 6e-4;
  const ParameterDifferences there = parameter_differences(before, after),
                             back = parameter_differences(after, before);
  for (const ParameterDifferences& one : {there, back}) {
    ASSERT_EQ(one.moved.size(), 1u);
    EXPECT_EQ(one.moved[0].name, "tool.y");
    EXPECT_NEAR(one.moved[0].expanded, 2e-5, 1e-12);
    EXPECT_TRUE(one.only_before.empty() && one.only_after.empty());
  }
  EXPECT_NEAR(there.moved[0].after - there.moved[0].before, 6e-4, 1e-12);
  EXPECT_NEAR(back.moved[0].after - back.moved[0].before, -6e-4, 1e-12);
}

}  // namespace
}  // namespace cellcal::calib
