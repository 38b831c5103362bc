// A controller's stated TCP compared with the robot file: many postures distinguish a model, a tool and a base;
// few determine a part only.

#include "calib/check/controller_model.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

#include "calib/files/files.h"
#include "calib/model/linear.h"
#include "calib/model/nominal_arm.h"
#include "calib/model/units.h"

namespace cellcal::calib {
namespace {

using Outcome = ControllerModel::Outcome;

Eigen::Isometry3d frame_of(double x_mm, double y_mm, double z_mm, double a_deg, double b_deg,
                           double c_deg) {
  return to_isometry({{x_mm, y_mm, z_mm}, {a_deg, b_deg, c_deg}});
}

const Robot& kr5() {
  static const Robot robot = load_named_robot("kr5_r1400");
  return robot;
}

/// Angles typical of touches: all axes vary.
std::vector<JointVector> postures(int count, std::uint64_t seed = 3) {
  Random random(seed);
  std::vector<JointVector> all;
  for (int k = 0; k < count; ++k) {
    JointVector q{0.0, -1.3, 1.5, 0.0, 1.0, 0.0};
    for (double& angle : q) angle += random.uniform(-0.6, 0.6);
    all.push_back(q);
  }
  return all;
}

/// Poses reported by a controller with this model of the arm, this $TOOL and this $BASE.
std::vector<StatedPose> stated(const Robot& model, const std::vector<JointVector>& at,
                               const Eigen::Isometry3d& tool = Eigen::Isometry3d::Identity(),
                               const Eigen::Isometry3d& base = Eigen::Isometry3d::Identity()) {
  const NominalArm arm(model, tool);
  std::vector<StatedPose> poses;
  for (const JointVector& q : at) poses.push_back({q, base.inverse() * arm.tcp(q)});
  return poses;
}

const StatedFrames kFlangeAndWorld{Eigen::Isometry3d::Identity(), Eigen::Isometry3d::Identity()};
const Eigen::Isometry3d kTool = frame_of(60, 50, 410, 39, 4, -120);
const Eigen::Isometry3d kBase = frame_of(1000, -500, 812, 90, 0, 180);

TEST(AControllersModel, ThatIsTheRobotFilesAgreesAtASinglePosture) {
  const auto model = compare_controller_model(kr5(), stated(kr5(), postures(1)), kFlangeAndWorld);
  EXPECT_EQ(model.outcome, Outcome::kAgrees);
  EXPECT_NEAR(model.worst_m, 0.0, 1e-12);
  EXPECT_EQ(words(phrase(model, kr5())), "0.00 mm from the robot file over 1 posture");
  EXPECT_FALSE(finding_of(model, kr5()));
}

TEST(AControllersModel, WithoutAnyTcpIsNotCompared) {
  EXPECT_EQ(compare_controller_model(kr5(), {}, {}).outcome, Outcome::kNotStated);
}

TEST(AControllersModel, AgreesWithAnyUnknownToolAndBase) {
  const auto model =
      compare_controller_model(kr5(), stated(kr5(), postures(12), kTool, kBase), StatedFrames{});
  EXPECT_EQ(model.outcome, Outcome::kAgrees);
  EXPECT_LT(model.worst_m, 1e-8);
}

TEST(AControllersModel, WithAnotherToolOrBaseThanConfiguredNamesTheirDifferenceAndNotTheModel) {
  const Eigen::Isometry3d robroot = frame_of(0, 0, 812, 0, 0, 0);
  const auto base = compare_controller_model(
      kr5(), stated(kr5(), postures(12), Eigen::Isometry3d::Identity(), robroot.inverse()),
      kFlangeAndWorld);
  EXPECT_EQ(base.outcome, Outcome::kOtherFrames);
  EXPECT_NEAR(base.base_off_m.value(), 0.812, 1e-6);
  EXPECT_NEAR(base.tool_off_m.value(), 0.0, 1e-6);
  const auto tool = compare_controller_model(
      kr5(), stated(kr5(), postures(12), frame_of(0, 0, 150, 0, 0, 0)), kFlangeAndWorld);
  EXPECT_EQ(tool.outcome, Outcome::kOtherFrames);
  EXPECT_NEAR(tool.tool_off_m.value(), 0.150, 1e-6);
  EXPECT_LT(tool.worst_m, 1e-8);
  EXPECT_FALSE(finding_of(tool, kr5())) << "angles do not depend on it";
}

TEST(AControllersModel, OfAnotherRobotTypeDiffersWhateverToolAndBase) {
  const Robot arc = load_named_robot("kr5_arc");
  for (const StatedFrames& known : {StatedFrames{}, kFlangeAndWorld}) {
    const auto model =
        compare_controller_model(kr5(), stated(arc, postures(20), kTool, kBase), known);
    EXPECT_EQ(model.outcome, Outcome::kDiffers);
    EXPECT_GT(model.worst_m, 5e-3);
    EXPECT_EQ(model.worst_rad.size(), 6u);
  }
  const auto model = compare_controller_model(kr5(), stated(arc, postures(20)), kFlangeAndWorld);
  const auto finding = finding_of(model, kr5());
  ASSERT_TRUE(finding);
  EXPECT_EQ(finding->kind, FindingKind::kControllerModel);
  EXPECT_EQ(finding->severity, Severity::kWarns);
  EXPECT_NEAR(value(finding->evidence, "difference"), model.worst_m * kMmPerM, 1e-9);
  EXPECT_EQ(value(finding->evidence, "postures"), 20.0);
  const std::string sentence = words(*finding);
  for (const char* part :
       {"controller's model: ", " mm from the robot file at A1 ", "20 postures", "$ABS_ACCUR"})
    EXPECT_NE(sentence.find(part), std::string::npos) << sentence;
}

TEST(AControllersModel, IsNotJudgedByLessThanFourPostures) {
  const Robot arc = load_named_robot("kr5_arc");
  for (const int count : {2, 3}) {
    const auto poses = stated(arc, postures(count), kTool, kBase);
    for (const StatedFrames& known : {StatedFrames{}, kFlangeAndWorld})
      EXPECT_EQ(compare_controller_model(kr5(), poses, known).outcome, Outcome::kUndecided)
          << count;
  }
  EXPECT_EQ(compare_controller_model(kr5(), stated(arc, postures(4), kTool, kBase), {}).outcome,
            Outcome::kDiffers);
}

TEST(AControllersModel, OfAbsoluteAccuracyDiffersByWhatTheArmIsOffNominal) {
  Robot measured = kr5();
  Random random(5);
  for (Joint& joint : measured.joints) {
    joint.offset_rad += random.normal() * joint.tolerance_angle_rad;
    joint.alpha_rad += random.normal() * joint.tolerance_angle_rad;
    joint.a_m += random.normal() * joint.tolerance_length_m;
    joint.d_m += random.normal() * joint.tolerance_length_m;
  }
  const auto poses = stated(measured, postures(40), kTool);
  const auto model = compare_controller_model(kr5(), poses, StatedFrames{});
  EXPECT_EQ(model.outcome, Outcome::kDiffers) << model.worst_m;
  EXPECT_GT(model.worst_m, kModelLimitM);
  EXPECT_LT(model.worst_m, 5e-3);
  EXPECT_EQ(compare_controller_model(measured, poses, StatedFrames{}).outcome, Outcome::kAgrees)
      << "given in the robot file";
}

TEST(AControllersModel, IsNotDecidedByPosturesThatAToolOrBaseExplains) {
  const Robot arc = load_named_robot("kr5_arc");
  const auto one = compare_controller_model(kr5(), stated(arc, postures(1)), kFlangeAndWorld);
  EXPECT_EQ(one.outcome, Outcome::kUndecided);
  EXPECT_GT(one.worst_m, 10e-3) << "as configured";
  EXPECT_NE(words(phrase(one, kr5())).find("$ROBROOT"), std::string::npos);
  const auto unknown = compare_controller_model(kr5(), stated(arc, postures(1)), StatedFrames{});
  EXPECT_EQ(unknown.outcome, Outcome::kUndecided);
  EXPECT_EQ(unknown.worst_m, 0.0);
  // A single axis moves: a tool along it is not determined.
  std::vector<JointVector> same(6, postures(1)[0]);
  for (std::size_t k = 0; k < same.size(); ++k) same[k][5] += 0.3 * static_cast<double>(k);
  EXPECT_EQ(compare_controller_model(kr5(), stated(kr5(), same, kTool), StatedFrames{}).outcome,
            Outcome::kUndecided);
}

TEST(AControllersModel, ToleratesDecimalsAndAServoAtRest) {
  auto poses = stated(kr5(), postures(40), kTool, kBase);
  Random random(9);
  for (StatedPose& pose : poses)
    for (double& angle : pose.joint_rad) angle += 5e-4 * kRadPerDeg * random.normal();
  const auto model = compare_controller_model(kr5(), poses, StatedFrames{});
  EXPECT_EQ(model.outcome, Outcome::kAgrees);
  EXPECT_LT(model.worst_m, 0.1e-3);
}

TEST(AControllersModel, OfAnotherNumberOfAxesIsRefused) {
  std::vector<StatedPose> poses{{{0.0, 0.0}, Eigen::Isometry3d::Identity()}};
  EXPECT_THROW(compare_controller_model(kr5(), poses, {}), std::invalid_argument);
}

}  // namespace
}  // namespace cellcal::calib
