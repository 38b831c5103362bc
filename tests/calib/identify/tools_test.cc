// Several tips and reflectors on one flange: each touch names its own, and each is identified.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "calib/estimate/problem.h"
#include "calib/estimate/region.h"
#include "calib/estimate/seed_paper.h"
#include "calib/identify/identify.h"
#include "calib/model/linear.h"
#include "calib/model/units.h"
#include "tests/calib/findings.h"
#include "tests/calib/millimetre.h"
#include "tests/calib/simulate.h"
#include "tests/calib/thrown.h"

namespace cellcal::calib {
namespace {

using Eigen::Vector3d;
using testing::demo_cell;
using testing::kMm;
using testing::make_touches;
using testing::Making;
using testing::plain_truth;
using testing::words_of;

const ParameterResult& parameter(const Calibration& c, const ParameterKey& key) {
  const ParameterResult* found = find(c, key);
  if (found == nullptr) throw std::runtime_error("no parameter " + parameter_name(c.cell, key));
  return *found;
}

bool has_parameter(const Calibration& c, const ParameterKey& key) {
  return find(c, key) != nullptr;
}

/// A massless plate, `off_m` from the first tool's tip.
Tool beside(const Tool& first, const std::string& id, const Vector3d& off_m, double sigma_m) {
  Tool tool = first;
  tool.id = id;
  tool.tcp.translation() += off_m;
  tool.mass_kg = tool.deflection_sigma = 0.0;
  tool.tcp_sigma_m.setConstant(sigma_m);
  return tool;
}

/// Three reflectors seen by one tracker; all except the first are 1 mm off their stated positions. With `off_rad` all
/// three are read at each posture, of which every joint is off by as much, smoothly in the other angles; else one in turn.
struct Reflectors {
  explicit Reflectors(int count, unsigned seed = 1, double off_rad = 0.0) {
    cell = demo_cell();
    cell.targets.clear();
    cell.lengths.clear();
    Target tracker;
    tracker.id = "L";
    tracker.kind = TargetKind::kTracker;
    cell.targets.push_back(tracker);
    cell.radius_offset_sigma_m = 0.0;
    cell.tool.id = "P1";
    cell.other_tools = {beside(cell.tool, "P2", {0.12, 0.0, -0.03}, 2 * kMm),
                        beside(cell.tool, "P3", {-0.02, 0.11, -0.06}, 2 * kMm)};
    const ArmModel arm(cell);
    Random random(seed);
    x = Eigen::VectorXd::Zero(arm.size());
    for (int p = 0; p < arm.size(); ++p) {
      const ArmParameter& one = arm.parameters()[static_cast<std::size_t>(p)];
      const double draw = std::clamp(random.normal(), -2.0, 2.0);
      x[p] = one.kind == ParameterKind::kTcp          ? 0.5 * one.sigma * draw
             : one.kind == ParameterKind::kDeflection ? one.sigma * std::abs(draw)
                                                      : one.sigma * draw;
    }
    Eigen::Isometry3d tracker_in_base = Eigen::Isometry3d::Identity();
    tracker_in_base.translate(Vector3d(3.0, -1.0, 0.5));
    tracker_in_base.rotate(Eigen::AngleAxisd(2.0, Vector3d(0.1, -0.2, 1.0).normalized()));
    const auto poses = workspace_poses(arm, count, seed + 7);
    const std::size_t at_each = off_rad > 0.0 ? 3 : 1;
    JointVector stands;
    for (std::size_t i = 0; i < at_each * poses.size(); ++i) {
      const int tool = static_cast<int>(i % 3);
      const JointVector& pose = poses[i / at_each];
      if (i % at_each == 0) {
        stands = pose;
        for (std::size_t k = 0; off_rad > 0.0 && k < stands.size(); ++k)
          stands[k] += off_rad * std::sin(static_cast<double>(seed + k) + 1.3 * pose[(k + 1) % 6] -
                                          pose[(k + 2) % 6] + 0.7 * pose[(k + 3) % 6]);
      }
      Vector3d p = arm.position(arm.prepare(stands, tool), x.data());
      for (int k = 0; k < 3; ++k) p[k] += 0.02 * kMm * random.normal();
      const Vector3d m = tracker_in_base.inverse() * p;
      Touch touch;
      touch.joint_rad = pose;
      touch.target = "L";
      touch.tool = tool == 0 ? "" : arm.tool(tool).id;
      touch.sigma_m = 0.02 * kMm;
      touch.set = i % 7 == 0 ? TouchSet::kCheck : TouchSet::kFit;
      for (int k = 0; k < 3; ++k) touch.tracker_m[k] = m[k];
      touches.push_back(touch);
    }
  }

  double truth(const ParameterKey& key) const {
    const ArmModel arm(cell);
    for (int p = 0; p < arm.size(); ++p)
      if (arm.parameters()[static_cast<std::size_t>(p)] == key) return x[p];
    throw std::runtime_error("no parameter " + parameter_name(cell, key));
  }

  Cell cell;
  Eigen::VectorXd x;
  std::vector<Touch> touches;
};

TEST(Tools, OfSeveralReflectorsOnOneFlangeEachIsFound) {
  const Reflectors made(90);
  const Calibration c = identify(made.cell, made.touches);
  EXPECT_TRUE(c.verdict.publish()) << words_of(c);
  for (const std::size_t tool : {1, 2})
    for (const int axis : {0, 1, 2}) {
      const ParameterKey key = tool_parameter(ParameterKind::kTcp, tool, axis);
      const ParameterResult& p = parameter(c, key);
      const std::string name = parameter_name(c.cell, key);
      EXPECT_LT(std::abs(p.correction - made.truth(key)), 4.0 * p.sigma) << name;
      EXPECT_LT(p.sigma, 0.2 * kMm) << name;
    }
  EXPECT_FALSE(has_parameter(c, tool_parameter(ParameterKind::kTcp, 0)))
      << "it is stated to be known";
  EXPECT_TRUE(has_parameter(c, tool_parameter(ParameterKind::kDeflection, 0)));
  EXPECT_LT(c.check.rms_m, 0.1 * kMm);
}

TEST(Tools, ReadAtOnePostureDoNotMakeItsErrorsKnownBetter) {
  constexpr double kOffRad = 120.0 * kRadPerArcsec;
  for (const unsigned seed : {2u, 3u}) {
    const Reflectors made(50, seed, kOffRad);
    std::vector<Touch> of_first;
    for (const Touch& touch : made.touches)
      if (touch.tool.empty()) of_first.push_back(touch);
    const Calibration all = identify(made.cell, made.touches), one = identify(made.cell, of_first);
    EXPECT_GT(all.predicted_workspace_m, 0.95 * one.predicted_workspace_m) << seed;
  }
}

TEST(Tools, ATouchThatNamesTheWrongOneIsAnOutlier) {
  Reflectors made(90);
  ASSERT_EQ(made.touches[31].tool, "P2");
  ASSERT_EQ(made.touches[31].set, TouchSet::kFit);
  made.touches[31].tool = "P3";
  const Calibration c = identify(made.cell, made.touches);
  ASSERT_EQ(c.outliers.size(), 1u) << words_of(c);
  EXPECT_EQ(c.outliers[0].touch, 31u);
}

TEST(Tools, OneThatNoFitTouchIsOfStaysAsItIsStated) {
  Reflectors made(90);
  std::erase_if(made.touches, [](const Touch& touch) { return touch.tool == "P3"; });
  const Calibration c = identify(made.cell, made.touches);
  EXPECT_TRUE(c.verdict.publish()) << words_of(c);
  EXPECT_TRUE(has_parameter(c, tool_parameter(ParameterKind::kTcp, 1)));
  EXPECT_FALSE(has_parameter(c, tool_parameter(ParameterKind::kTcp, 2)));
}

TEST(Tools, TheNameOfAToolThatIsNotThereIsAnError) {
  Reflectors made(30);
  made.touches[3].tool = "P9";
  EXPECT_THROW((void)identify(made.cell, made.touches), std::out_of_range);
}

TEST(Tools, ThePapersEstimatorKnowsOne) {
  Cell cell = testing::one_sphere_cell();
  cell.tool.id = "T1";
  cell.other_tools = {beside(cell.tool, "T2", {0.05, -0.02, 0.01}, 0.0)};
  Making making;
  making.fit = 40;
  auto touches = make_touches(cell, plain_truth(cell, 1), making).touches;
  EXPECT_NO_THROW((void)identify_paper(cell, touches));
  touches[5].tool = "T2";
  EXPECT_EQ(testing::thrown<IdentifyError>([&] { (void)identify_paper(cell, touches); }).kind,
            IdentifyError::Kind::kTouches);
}

TEST(Tools, EveryTipHasItsOwnEffectiveRadius) {
  constexpr unsigned kSeed = 3;
  const Vector3d off(0.8 * kMm, -0.5 * kMm, 0.4 * kMm);
  Cell cell = demo_cell();
  cell.tool.id = "T1";
  cell.other_tools = {beside(cell.tool, "T2", {0.05, -0.02, 0.01}, 2 * kMm)};
  cell.other_tools[0].tip_radius_m = 3 * kMm;

  const sim::Truth first = plain_truth(demo_cell(), kSeed);
  Cell with_second = demo_cell();  // the same arm holding the second tip
  with_second.tool = cell.other_tools[0];
  with_second.tool.tcp.translation() += off;
  with_second.tool.tcp_sigma_m.setZero();
  with_second.tool.mass_kg = cell.tool.mass_kg;  // the joints still carry the first one
  sim::Truth second = plain_truth(with_second, kSeed);
  for (int p = 0; p < second.arm.size(); ++p) ASSERT_EQ(second.errors[p], first.errors[p]);
  second.centre_m = first.centre_m;
  second.radius_m = first.radius_m;
  for (double& r : second.radius_m) r += 3 * kMm;

  Making making;
  making.fit = 60;
  making.check = 8;
  making.noise_m = 0.02 * kMm;
  making.rho_m = 0.05 * kMm;
  std::vector<Touch> touches = make_touches(demo_cell(), first, making).touches;
  making.rho_m = 0.30 * kMm;
  making.seed = 2;
  for (Touch touch : make_touches(with_second, second, making).touches) {
    touch.tool = "T2";
    touches.push_back(touch);
  }
  const Calibration c = identify(cell, touches);
  EXPECT_TRUE(c.verdict.publish()) << words_of(c);
  const auto near = [&](const ParameterKey& key, double truth) {
    const ParameterResult& p = parameter(c, key);
    const std::string name = parameter_name(c.cell, key);
    EXPECT_LT(std::abs(p.correction - truth), 4.0 * p.sigma) << name << ": " << p.correction;
    EXPECT_LT(p.sigma, 0.15 * kMm) << name;
  };
  near(tool_parameter(ParameterKind::kEffectiveRadius, 0), 0.05 * kMm);
  near(tool_parameter(ParameterKind::kEffectiveRadius, 1), 0.30 * kMm);
  for (const int axis : {0, 1, 2}) near(tool_parameter(ParameterKind::kTcp, 1, axis), off[axis]);
  for (const TargetResult& target : c.targets)  // of the first tool that touched it
    EXPECT_NEAR(
        target.effective_radius_m,
        30.7 * kMm + parameter(c, tool_parameter(ParameterKind::kEffectiveRadius, 0)).correction,
        0.01 * kMm);
}

TEST(Tools, InAListOfOneIsTheSameArmAsATableAlone) {
  Cell listed = demo_cell();
  listed.tool.id = "torch";
  Making making;
  making.fit = 40;
  making.check = 8;
  const auto touches = make_touches(demo_cell(), plain_truth(demo_cell(), 5), making).touches;
  const Calibration alone = identify(demo_cell(), touches), c = identify(listed, touches);
  ASSERT_EQ(c.parameters.size(), alone.parameters.size());
  for (std::size_t i = 0; i < c.parameters.size(); ++i) {
    EXPECT_EQ(c.parameters[i].correction, alone.parameters[i].correction)
        << parameter_name(c.cell, c.parameters[i].key);
    EXPECT_EQ(c.parameters[i].key, alone.parameters[i].key);
  }
  EXPECT_EQ(c.parameters.size(), alone.parameters.size());
  const ParameterKey rho = tool_parameter(ParameterKind::kEffectiveRadius, 0),
                     bending = tool_parameter(ParameterKind::kDeflection, 0);
  EXPECT_TRUE(has_parameter(alone, rho) && has_parameter(alone, bending));
  EXPECT_EQ(parameter_name(alone.cell, rho), "touch.rho");
  EXPECT_EQ(parameter_name(c.cell, rho), "torch.rho");
  EXPECT_EQ(parameter_name(c.cell, bending), "torch.c_t");
}

TEST(Tools, ThatHangOnTheFlangeTogetherLoadTheJointsTogether) {
  Cell cell = demo_cell();
  for (Joint& joint : cell.robot.joints) joint.compliance_sigma_rad_per_nm = 1e-5;
  const std::vector<double> q = {0.1, -1.0, 1.2, 0.2, 0.5, 0.3};
  const ArmModel one(cell);
  Tool half = cell.tool;
  half.mass_kg /= 2.0;
  const ArmModel halves(cell.robot, half, {half});
  const PreparedPose a = one.prepare(q), b = halves.prepare(q, 1);
  int loaded = 0;
  for (int p = 0; p < one.size(); ++p) {
    if (one.parameters()[static_cast<std::size_t>(p)].kind != ParameterKind::kCompliance) continue;
    loaded += std::abs(a.factor[p]) > 1.0 ? 1 : 0;
    EXPECT_NEAR(a.factor[p], b.factor[p], 1e-12 + 1e-12 * std::abs(a.factor[p]));
  }
  EXPECT_GE(loaded, 3);
}

TEST(Loads, OfTheFitTouchesAreStatedByTheResult) {
  Cell cell = demo_cell();
  auto touches = make_touches(cell, plain_truth(cell, 3), {.fit = 40, .check = 4}).touches;
  EXPECT_TRUE(identify(cell, touches).touched_loads.empty()) << "the cell has none";
  cell.loads = {{"full", 1.0, Eigen::Vector3d(0.0, 0.0, 0.1)},
                {"half", 0.5, Eigen::Vector3d::Zero()}};
  for (std::size_t i = 0; i < touches.size(); ++i)
    touches[i].load = touches[i].set == TouchSet::kCheck ? "half" : i % 2 == 0 ? "full" : "";
  EXPECT_EQ(identify(cell, touches).touched_loads, (std::vector<std::string>{"", "full"}));
}

}  // namespace
}  // namespace cellcal::calib
