#include "calib/export/corrector.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "calib/estimate/predict.h"
#include "calib/files/files.h"
#include "calib/model/inverse.h"
#include "calib/model/kinematics.h"
#include "calib/model/units.h"
#include "tests/calib/random_calibration.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

constexpr double kPromisedM = 1e-9;  // 1e-6 mm

JointVector inside(const Robot& robot, Random& random, double margin = 0.1) {
  JointVector q;
  for (const Joint& joint : robot.joints)
    q.push_back(random.uniform(joint.min_rad + margin, joint.max_rad - margin));
  return q;
}

/// At least some degrees away from the three singularities.
bool regular(const ArmModel& arm, const JointVector& q) {
  const auto j = arm.nominal_jacobian(q);
  return std::abs((j * j.transpose()).determinant()) > 1e-5;
}

/// Largest difference of the joints [rad].
double apart(const JointVector& a, const JointVector& b) {
  double worst = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) worst = std::max(worst, std::abs(a[i] - b[i]));
  return worst;
}

NotReached refused(const Reach& reach) {
  if (const auto* reason = std::get_if<NotReached>(&reach)) return *reason;
  ADD_FAILURE() << "was reached";
  return {};
}

TEST(Corrector, BringsTheRealTcpToThePoseInTheSeedsConfigurationAndTurns) {
  const Cell& cell = testing::demo_cell();
  Random random(3);
  int reached = 0;
  for (int one = 0; one < 5; ++one) {
    const Calibration c = testing::random_calibration(cell, random);
    const ArmModel nominal(cell);
    const Configurations ways(nominal, 0.0);
    const Corrector corrector(c);
    const Predictor real(c);
    for (int k = 0; k < 200; ++k) {
      const JointVector seed = inside(cell.robot, random);
      if (!regular(nominal, seed)) continue;
      const Eigen::Isometry3d wanted = nominal.nominal_tcp(seed);
      const Reach reach = corrector.joints(wanted, seed);
      const auto* at = std::get_if<Reached>(&reach);
      if (at == nullptr) continue;
      ++reached;
      const Eigen::Isometry3d there = real.calibrated(at->joint_rad).tcp;
      EXPECT_LT((there.translation() - wanted.translation()).norm(), kPromisedM);
      EXPECT_LT((there.linear() - wanted.linear()).norm(), 1e-8);
      EXPECT_LT(apart(at->joint_rad, seed), Corrector::kMostTurn);
      EXPECT_TRUE(ways.posture_of(at->joint_rad) == ways.posture_of(seed));
    }
  }
  EXPECT_GT(reached, 700);
}

TEST(Corrector, OfAnArmWithoutErrorsGivesTheNominalAnglesBack) {
  const Cell& cell = testing::demo_cell();
  Random random(4);
  const Corrector corrector(testing::random_calibration(cell, random, 0.0));
  const ArmModel nominal(cell);
  for (int k = 0; k < 100; ++k) {
    const JointVector seed = inside(cell.robot, random);
    if (!regular(nominal, seed)) continue;
    const Reach reach = corrector.joints(nominal.nominal_tcp(seed), seed);
    ASSERT_TRUE(std::holds_alternative<Reached>(reach)) << k;
    EXPECT_LT(apart(std::get<Reached>(reach).joint_rad, seed), 1e-9);
  }
}

TEST(Corrector, KeepsToAnotherConfigurationWhereTheSeedHasIt) {
  const Cell& cell = testing::demo_cell();
  Random random(5);
  const Corrector corrector(testing::random_calibration(cell, random));
  const ArmModel nominal(cell);
  const Configurations ways(nominal, 0.0);
  const JointVector home = {0.2, -1.4, 1.5, 0.3, 0.8, 0.1};
  const Eigen::Isometry3d wanted = nominal.nominal_tcp(home);
  const auto all = ways.reach(wanted);
  ASSERT_GT(all.size(), 1U);
  for (const JointVector& one : all) {
    const Reach reach = corrector.joints(wanted, one);
    if (const auto* at = std::get_if<Reached>(&reach)) {
      EXPECT_LT(apart(at->joint_rad, one), 0.1);
    }
  }
}

TEST(Corrector, WithoutASeedTakesTheConfigurationNearestToTheLastPosture) {
  const Cell& cell = testing::demo_cell();
  Random random(6);
  const Corrector corrector(testing::random_calibration(cell, random));
  const JointVector last = {0.2, -1.4, 1.5, 0.3, 0.8, 0.1};
  JointVector next = last;
  for (double& q : next) q += 0.02;
  const Reach reach = corrector.nearest(ArmModel(cell).nominal_tcp(next), last);
  ASSERT_TRUE(std::holds_alternative<Reached>(reach));
  EXPECT_LT(apart(std::get<Reached>(reach).joint_rad, next), 0.05);
}

TEST(Corrector, NamesTheJointThatWouldPassItsLimit) {
  const Cell& cell = testing::demo_cell();
  Random random(7);
  const Corrector corrector(testing::random_calibration(cell, random));
  JointVector seed = {0.2, -1.4, 1.5, 0.3, 0.8, 0.1};
  seed[0] = cell.robot.joints[0].max_rad + 0.1;
  const NotReached reason = refused(corrector.joints(ArmModel(cell).nominal_tcp(seed), seed));
  EXPECT_EQ(reason.why, Unreached::kBeyondLimit);
  EXPECT_EQ(reason.joint, 0);
  EXPECT_NEAR(reason.joint_rad, seed[0], 0.05);
  EXPECT_NE(words(reason, cell.robot).find("A1"), std::string::npos);
}

TEST(Corrector, SaysWhatLiesTooFarAwayAtASingularityOrIsNoNumber) {
  const Cell& cell = testing::demo_cell();
  Random random(8);
  const Corrector corrector(testing::random_calibration(cell, random));
  const JointVector seed = {0.2, -1.4, 1.5, 0.3, 0.8, 0.1};
  Eigen::Isometry3d far = ArmModel(cell).nominal_tcp(seed);
  far.translation() *= 10.0;
  EXPECT_EQ(refused(corrector.joints(far, seed)).why, Unreached::kTooFar);
  EXPECT_EQ(refused(corrector.nearest(far, seed)).why, Unreached::kTooFar);
  JointVector stretched = seed;
  stretched[4] = 1e-4;  // the wrist: axes 4 and 6 aligned within 0.006 deg
  EXPECT_EQ(refused(corrector.joints(ArmModel(cell).nominal_tcp(stretched), stretched)).why,
            Unreached::kNearSingularity);
  far.translation().x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refused(corrector.joints(far, seed)).why, Unreached::kNotANumber);
}

TEST(Corrector, StatesNoTurnNearASingularityThatIsWhereTheIterationEnded) {
  const Robot& robot = testing::demo_cell().robot;
  const auto of = [&](double deg) {
    return words(NotReached{Unreached::kNearSingularity, 3, deg * kRadPerDeg}, robot);
  };
  EXPECT_NE(of(-45.0).find("A4 would have to turn by -45.0 deg"), std::string::npos) << of(-45.0);
  for (const double deg : {829.6, -91.0, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_EQ(of(deg).find_first_of("0123456789"), of(deg).find("4")) << of(deg);
}

TEST(Corrector, CorrectsAnArmOfSevenJointsByNewtonFromTheSeed) {
  Cell cell = testing::demo_cell();
  cell.robot = load_robot(CELLCAL_ROBOTS_FOLDER "/iiwa14.toml");
  Random random(9);
  const Calibration c = testing::random_calibration(cell, random);
  const Corrector corrector(c);
  const Predictor real(c);
  const JointVector seed = {0.3, 0.5, -0.2, -1.2, 0.4, 0.9, 0.1};
  const Eigen::Isometry3d wanted = ArmModel(cell).nominal_tcp(seed);
  const Reach reach = corrector.joints(wanted, seed);
  ASSERT_TRUE(std::holds_alternative<Reached>(reach));
  const JointVector q = std::get<Reached>(reach).joint_rad;
  EXPECT_LT((real.calibrated(q).tcp.translation() - wanted.translation()).norm(), kPromisedM);
  EXPECT_LT(apart(q, seed), 0.1);
}

TEST(Corrector, AnotherToolIsStiffAndLoadsTheJointsByItsOwnMass) {
  const Cell& cell = testing::demo_cell();
  Random random(10);
  Tool tool;
  tool.tcp.translation() = Eigen::Vector3d(0.0, 0.0, 0.25);
  tool.mass_kg = 4.0;
  tool.com_m = Eigen::Vector3d(0.0, 0.0, 0.1);
  const Calibration other = with_tool(testing::random_calibration(cell, random), tool);
  const JointVector seed = {0.2, -1.4, 1.5, 0.3, 0.8, 0.1};
  const Eigen::Isometry3d wanted = ArmModel(cell.robot, tool).nominal_tcp(seed);
  const Reach reach = Corrector(other).joints(wanted, seed);
  ASSERT_TRUE(std::holds_alternative<Reached>(reach));
  const Eigen::Isometry3d there =
      Predictor(other).calibrated(std::get<Reached>(reach).joint_rad).tcp;
  EXPECT_LT((there.translation() - wanted.translation()).norm(), kPromisedM);
}

TEST(OneOfTheTools, IsPredictedWithWhatWasFoundOfIt) {
  Random random(4);
  Cell cell = testing::demo_cell();
  cell.tool.id = "T1";
  cell.other_tools = {cell.tool};
  cell.other_tools[0].id = "T2";
  cell.other_tools[0].tcp.translation() += Eigen::Vector3d(0.05, -0.02, 0.01);
  const Calibration c = testing::random_calibration(cell, random);
  const ArmModel arm(at_level(c.cell, c.level));
  const Eigen::VectorXd x = arm_values(arm, c);
  const JointVector q = {0.2, -1.4, 1.5, 0.3, 0.8, 0.1};
  for (const char* id : {"T1", "T2", ""}) {
    const Prediction at = Predictor(with_tool(c, std::string(id))).calibrated(q);
    EXPECT_LT((at.tcp.translation() -
               arm.shape(arm.prepare(q, arm.tool_index(id)), x.data()).tcp.translation())
                  .norm(),
              1e-12)
        << id;
    EXPECT_GT(at.u95_m, 0.0);
  }
  EXPECT_THROW((void)with_tool(c, std::string("T3")), std::out_of_range);
}

struct LoadOnTheFlange : ::testing::Test {
  Calibration c = [] {
    Random random(10);
    Cell cell = testing::demo_cell();
    cell.tool.deflection_sigma = 0.0;
    return testing::random_calibration(cell, random);
  }();
  JointVector pose{0.2, -1.0, 1.2, 0.3, 0.8, 0.1};
  double sag_m(const Calibration& loaded) const {
    return (Predictor(loaded).calibrated(pose).tcp.translation() -
            Predictor(c).calibrated(pose).tcp.translation())
        .norm();
  }
};

TEST_F(LoadOnTheFlange, ThatIsTheToolsOwnChangesNothing) {
  const Tool& tool = c.cell.tool;
  EXPECT_LT(sag_m(with_load(c, {tool.mass_kg, tool.com_m})), kPromisedM);
}

TEST_F(LoadOnTheFlange, IsBorneByTheJointsWithOtherBounds) {
  const FlangeLoad load{5.0, Eigen::Vector3d(0.02, 0.0, 0.15)};
  Calibration as_tool = c;
  as_tool.cell.tool.mass_kg = load.mass_kg;
  as_tool.cell.tool.com_m = load.com_m;
  const Predictor loaded(with_load(c, load)), of_tool(as_tool);
  EXPECT_LT((loaded.calibrated(pose).tcp.translation() - of_tool.calibrated(pose).tcp.translation())
                .norm(),
            kPromisedM);
  EXPECT_GT(sag_m(with_load(c, load)), 1e-6);
  EXPECT_NE(loaded.calibrated(pose).u95_m, Predictor(c).calibrated(pose).u95_m);
}

TEST_F(LoadOnTheFlange, OfTheCellFileComesToTheTool) {
  const Tool& tool = c.cell.tool;
  c.cell.loads = {{"full", 5.0, Eigen::Vector3d(0.02, 0.0, 0.15)}};
  const Load& full = c.cell.loads.front();
  const double all_kg = tool.mass_kg + full.mass_kg;
  const Eigen::Vector3d com_m = (tool.mass_kg * tool.com_m + full.mass_kg * full.com_m) / all_kg;
  EXPECT_NEAR(sag_m(with_load(c, "full")), sag_m(with_load(c, {all_kg, com_m})), kPromisedM);
  EXPECT_GT(sag_m(with_load(c, "full")), 1e-6);
  EXPECT_EQ(sag_m(with_load(c, "")), 0.0);
  EXPECT_THROW((void)with_load(c, "empty"), std::out_of_range);
}

TEST_F(LoadOnTheFlange, OfTheSameMassWithAnotherCentreIsAMomentAlone) {
  const Tool& tool = c.cell.tool;
  const FlangeLoad load{tool.mass_kg, tool.com_m + Eigen::Vector3d(0.3, 0.0, 0.0)};
  Calibration as_tool = c;
  as_tool.cell.tool.com_m = load.com_m;
  EXPECT_NEAR(sag_m(with_load(c, load)), sag_m(as_tool), kPromisedM);
  EXPECT_GT(sag_m(as_tool), 1e-6);
}

TEST(FarCorrection, IsTheOneThatIsFarthestBeyondItsToleranceAndNoneOfAnArmWithin) {
  const Cell& cell = testing::demo_cell();
  Random random(9);
  Calibration c = testing::random_calibration(cell, random);
  EXPECT_FALSE(far_correction(c));
  for (ParameterResult& one : c.parameters) {
    const std::string name = parameter_name(cell, one.key);
    if (name == "A2.a") one.correction = 30e-3;
    if (name == "A3.theta") one.correction = 0.01;
  }
  const auto far = far_correction(c);
  ASSERT_TRUE(far);
  EXPECT_EQ(far->parameter, "A2.a");
  EXPECT_NEAR(far->correction, 30.0, 1e-9);
  EXPECT_NEAR(far->most, 10.0 * far->sigma, 1e-9);
  EXPECT_TRUE(words(*far).starts_with("30.000 mm correction of A2.a, at most ")) << words(*far);
}

TEST(FarCorrection, LetsAnUpdateMasterAJointAndMoveTheTipButNoLength) {
  const Cell& cell = testing::demo_cell();
  Random random(9);
  Calibration c = testing::random_calibration(cell, random);
  c.update.emplace();
  for (ParameterResult& one : c.parameters)
    if (parameter_name(cell, one.key) == "A3.theta") one.correction = 2.0 * kRadPerDeg;
  EXPECT_FALSE(far_correction(c));
  for (ParameterResult& one : c.parameters)
    if (parameter_name(cell, one.key) == "A2.a") one.correction = -30e-3;
  ASSERT_TRUE(far_correction(c));
  EXPECT_EQ(far_correction(c)->parameter, "A2.a");
}

}  // namespace
}  // namespace cellcal::calib
