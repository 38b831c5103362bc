// Guarantees to callers: the same input gives the same result, and insufficient input an error.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "calib/estimate/predict.h"
#include "calib/files/calibration_json.h"
#include "calib/files/files.h"
#include "calib/identify/identify.h"
#include "calib/identify/identify_once.h"
#include "calib/model/linear.h"
#include "tests/calib/findings.h"
#include "tests/calib/simulate.h"
#include "tests/calib/thrown.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::found;
using testing::make_touches;
using testing::one_sphere_cell;
using testing::plain_truth;
using testing::the;
using testing::words_of;

const std::vector<Touch>& with_outliers() {
  static const auto made = make_touches(demo_cell(), plain_truth(demo_cell(), 1),
                                        {.fit = 80, .check = 20, .outlier_share = 0.03});
  return made.touches;
}

IdentifyError refusal(const Cell& cell, const std::vector<Touch>& some) {
  return testing::thrown<IdentifyError>([&] { (void)identify(cell, some); });
}

TEST(Identify, GivesTheSameBitsForTheSameInput) {
  const std::string once = calibration_to_json(identify(demo_cell(), with_outliers()));
  EXPECT_EQ(calibration_to_json(identify(demo_cell(), with_outliers())), once);
}

TEST(Identify, TakesAnyNumberOfTouches) {
  // Rows are gathered in blocks; the last one may be full or empty.
  const auto many =
      make_touches(demo_cell(), plain_truth(demo_cell(), 1), {.fit = 136, .check = 0}).touches;
  for (std::size_t count = 120; count <= 134; ++count) {
    const std::vector<Touch> some(many.begin(), many.begin() + static_cast<std::ptrdiff_t>(count));
    EXPECT_EQ(identify(demo_cell(), some).residuals.size(), count);
  }
}

TEST(Identify, CheckTouchesHaveNoInfluenceWhatever) {
  const Calibration with = identify(demo_cell(), with_outliers());
  std::vector<Touch> moved = with_outliers(), without;
  Random random(1);
  for (Touch& touch : moved) {
    if (touch.set == TouchSet::kFit) {
      without.push_back(touch);
      continue;
    }
    for (double& angle : touch.joint_rad) angle += random.uniform(-0.3, 0.3);
    touch.sigma_m = 1e-7;
  }
  for (const Calibration& other : {identify(demo_cell(), moved), identify(demo_cell(), without)}) {
    ASSERT_EQ(other.parameters.size(), with.parameters.size());
    for (std::size_t i = 0; i < with.parameters.size(); ++i) {
      EXPECT_EQ(other.parameters[i].correction, with.parameters[i].correction) << i;
      EXPECT_EQ(other.parameters[i].sigma, with.parameters[i].sigma) << i;
    }
    EXPECT_EQ(other.covariance, with.covariance);
    EXPECT_EQ(other.chi2_per_dof, with.chi2_per_dof);
    EXPECT_EQ(other.level, with.level);
    EXPECT_EQ(other.after.rms_m, with.after.rms_m);
    EXPECT_EQ(other.predicted_workspace_m, with.predicted_workspace_m);
  }
}

TEST(Identify, TheOrderOfTheTouchesDoesNotMatterBeyondRounding) {
  const Calibration straight = identify(demo_cell(), with_outliers());
  std::vector<Touch> shuffled = with_outliers();
  Random random(2);
  for (std::size_t i = shuffled.size(); i > 1; --i)
    std::swap(shuffled[i - 1], shuffled[random.below(i)]);
  const Calibration other = identify(demo_cell(), shuffled);
  ASSERT_EQ(other.parameters.size(), straight.parameters.size());
  for (std::size_t i = 0; i < straight.parameters.size(); ++i) {
    const ParameterResult &a = straight.parameters[i], &b = other.parameters[i];
    // The solver stops when a step is below a thousandth of the uncertainty.
    EXPECT_NEAR(a.correction, b.correction, 1e-3 * a.sigma) << parameter_name(straight.cell, a.key);
    EXPECT_NEAR(a.sigma, b.sigma, 1e-4 * a.sigma) << parameter_name(straight.cell, a.key);
  }
  EXPECT_EQ(other.outliers.size(), straight.outliers.size());
  EXPECT_NEAR(other.level.transmission, straight.level.transmission, 1e-6);
  EXPECT_NEAR(other.level.ripple_rad, straight.level.ripple_rad, 1e-12);
}

TEST(Identify, ATouchOfItsOwnSigmaWeighsAccordingly) {
  // Touches with a large stated sigma: the result relies on the others.
  std::vector<Touch> some =
      make_touches(demo_cell(), plain_truth(demo_cell(), 1), {.fit = 120}).touches;
  const Calibration equal = identify(demo_cell(), some);
  for (std::size_t i = 0; i < some.size(); i += 2) some[i].sigma_m = 1e-3;
  const Calibration halved = identify(demo_cell(), some);
  EXPECT_GT(halved.predicted_workspace_m, 1.1 * equal.predicted_workspace_m);
  for (std::size_t i = 0; i < some.size(); i += 2)
    EXPECT_LT(std::abs(halved.residuals[i].whitened), 0.5);
}

TEST(Identify, WithoutFitTouchesIsAnError) {
  EXPECT_EQ(refusal(demo_cell(), {}).kind, IdentifyError::Kind::kUndetermined);
  std::vector<Touch> checks = with_outliers();
  for (Touch& touch : checks) touch.set = TouchSet::kCheck;
  EXPECT_EQ(refusal(demo_cell(), checks).kind, IdentifyError::Kind::kUndetermined);
}

TEST(Identify, ATargetWithCheckTouchesOnlyIsNamedAndItsPlaceIsTheirs) {
  std::vector<Touch> some = with_outliers();
  for (Touch& touch : some)
    if (touch.target == "S3") touch.set = TouchSet::kCheck;
  const Calibration c = identify(demo_cell(), some);
  ASSERT_EQ(c.unseen.targets.size(), 1u);
  EXPECT_EQ(c.unseen.targets[0].target, "S3");
  EXPECT_TRUE(std::none_of(c.targets.begin(), c.targets.end(),
                           [](const TargetResult& target) { return target.id == "S3"; }));
}

TEST(Identify, TouchesThatLeadNowhereLeaveTheNominalArmAndWhatItsTolerancesLeaveOpen) {
  Cell cell = demo_cell();
  cell.robot.joints[1].sign *= -1;  // such that the estimate does not converge
  const Calibration c = identify(cell, with_outliers());
  EXPECT_FALSE(c.verdict.publish());
  ASSERT_GE(c.verdict.findings.size(), 2u);
  EXPECT_EQ(c.verdict.findings[0].kind, FindingKind::kLikelyCause);
  EXPECT_EQ(c.verdict.findings[0].cause, LikelyCause::kAxisSign) << words_of(c);
  EXPECT_EQ(c.verdict.findings[0].about, about_joint("A2")) << words_of(c);
  EXPECT_EQ(c.verdict.findings.back().kind, FindingKind::kNotIdentified) << words_of(c);
  for (const ParameterResult& p : c.parameters) {
    EXPECT_EQ(p.decided_by, DecidedBy::kPrior);
    if (p.key.joint >= 0) {
      EXPECT_EQ(p.correction, 0.0) << parameter_name(c.cell, p.key);
    }
  }
  EXPECT_GT(c.predicted_workspace_m, 0.5e-3);
  const Calibration back = calibration_from_json(calibration_to_json(c), "c.json");
  const JointVector& q = with_outliers()[0].joint_rad;
  const Predictor predictor(back);
  EXPECT_TRUE(predictor.calibrated(q).tcp.translation().isApprox(predictor.nominal(q).translation(),
                                                                 1e-12));
  EXPECT_GT(predictor.calibrated(q).u95_m, 1e-3);
}

TEST(Identify, ATargetThatWasNotTouchedIsLeftOut) {
  std::vector<Touch> some = with_outliers();
  std::erase_if(some, [](const Touch& touch) { return touch.target == "S2"; });
  const Calibration result = identify(demo_cell(), some);
  EXPECT_EQ(result.targets.size(), 3u);
  const int left_out = static_cast<int>(demo_cell().target_index("S2"));
  for (const ParameterResult& p : result.parameters) EXPECT_NE(p.key.target, left_out);
}

TEST(Identify, TouchesThatLieFlatDoNotMakeASphereOfUnknownPlace) {
  sim::TruthOptions perfect;  // so that they are flat for the nominal arm
  perfect.geometry_scale = perfect.deflection = perfect.placement_m = perfect.placement_rad = 0.0;
  Cell cell = one_sphere_cell();
  const sim::Truth truth = sim::draw_truth(cell, perfect);
  const auto flat = make_touches(cell, truth, {.fit = 30, .noise_m = 0.0, .widest_rad = 0.03});
  const auto three = make_touches(cell, truth, {.fit = 3});
  cell.targets[0].has_centre = false;
  cell.targets[0].centre_sigma_m = 0.0;
  for (const auto& touches : {flat.touches, three.touches}) {
    const auto why =
        testing::thrown<IdentifyError>([&] { (void)identify_single_pass(cell, touches); });
    EXPECT_EQ(why.kind, IdentifyError::Kind::kUndetermined);
    EXPECT_EQ(why.target, "S1");
    // The message to the user.
    const std::string words = the(identify(cell, touches), FindingKind::kNotIdentified).text;
    EXPECT_EQ(words, why.what());
    EXPECT_EQ(
        words.find(fmt::format("target S1: {} fit touches do not span a sphere. ", touches.size())),
        0U)
        << words;
  }
}

TEST(Identify, FewTouchesOfAKnownPlaceAreUsedButNotLetThrough) {
  std::vector<Touch> few;
  for (const Touch& touch : with_outliers())
    if (touch.target == "S1" && few.size() < 3) few.push_back(touch);
  const Calibration result = identify(one_sphere_cell(), few);
  EXPECT_FALSE(result.verdict.publish());
}

TEST(Identify, WithNothingToIdentifyIsAnError) {
  Cell rigid = demo_cell();
  for (Joint& joint : rigid.robot.joints) joint.tolerance_angle_rad = joint.tolerance_length_m = 0;
  rigid.tool.deflection_sigma = 0.0;
  IdentifyOptions plain;
  plain.level = ModelLevel{false, 0.0, 0.0};
  EXPECT_EQ(
      testing::thrown<IdentifyError>([&] { (void)identify(rigid, with_outliers(), plain); }).kind,
      IdentifyError::Kind::kCell);
}

bool is_off_nominal(const Calibration& c, const ParameterKey& parameter) {
  const Finding far = the(c, FindingKind::kOffNominal);
  return far.withholds() &&
         std::any_of(far.parts.begin(), far.parts.end(), [&](const FindingPart& one) {
           return one.about == about_parameter(c.cell, parameter);
         });
}

/// Reason why a result is not published; empty if it is.
std::string blocked(const Cell& cell, const std::vector<Touch>& some) {
  try {
    const Calibration result = identify(cell, some);
    if (result.verdict.publish()) return {};
    return words_of(result);
  } catch (const IdentifyError& error) {
    return error.what();
  }
}

TEST(Identify, TouchesOfAnotherRobotDoNotPassForACalibration) {
  EXPECT_EQ(blocked(demo_cell(), with_outliers()), "");
  // The two public forms of the KR 5 differ by 80 mm in a3, which could explain the touches.
  Cell other = demo_cell();
  other.robot.joints[2].a_m += 0.080;
  EXPECT_TRUE(
      is_off_nominal(identify(other, with_outliers()), joint_parameter(ParameterKind::kA, 2)))
      << blocked(other, with_outliers());
  other = demo_cell();
  other.robot.joints[1].a_m += 0.150;
  EXPECT_NE(blocked(other, with_outliers()), "");
  other = demo_cell();
  other.robot.joints[2].sign = -other.robot.joints[2].sign;
  EXPECT_NE(blocked(other, with_outliers()), "");
}

TEST(Identify, AnArmThatWasMasteredWronglyIsFoundAndNamed) {
  std::vector<Touch> shifted = with_outliers();
  for (Touch& touch : shifted) touch.joint_rad[3] += 0.02;  // 1.1 deg: one tooth
  const Calibration c = identify(demo_cell(), shifted);
  EXPECT_FALSE(c.verdict.publish());
  EXPECT_TRUE(is_off_nominal(c, joint_parameter(ParameterKind::kTheta, 3))) << words_of(c);
}

TEST(Identify, AnglesThatAreNotNumbersAreAnErrorThatNamesTheTouch) {
  for (const double bad : {std::nan(""), HUGE_VAL}) {
    std::vector<Touch> poisoned = with_outliers();
    poisoned[5].joint_rad[2] = bad;
    const IdentifyError error = refusal(demo_cell(), poisoned);
    EXPECT_EQ(error.kind, IdentifyError::Kind::kTouches);
    EXPECT_EQ(error.touch, 5U);
    EXPECT_NE(std::string(error.what()).find("touch 6"), std::string::npos) << error.what();
  }
}

TEST(Identify, AnglesOfAnotherNumberAndUnknownTargetsAreErrors) {
  std::vector<Touch> wrong = with_outliers();
  wrong[5].joint_rad.pop_back();
  EXPECT_THROW((void)identify(demo_cell(), wrong), std::exception);
  wrong = with_outliers();
  wrong[5].target = "S9";
  EXPECT_THROW((void)identify(demo_cell(), wrong), std::exception);
}

TEST(Identify, SaysWhoDecidedEachParameter) {
  const Calibration result = identify(demo_cell(), with_outliers());
  int data = 0, frame = 0;
  for (const ParameterResult& p : result.parameters) {
    const std::string name = parameter_name(result.cell, p.key);
    EXPECT_GT(p.sigma, 0.0) << name;
    data += p.decided_by == DecidedBy::kData;
    frame += p.decided_by == DecidedBy::kFrame;
    const bool zero = p.key.kind == ParameterKind::kTheta;
    if (p.key.joint == 0 && (zero || p.key.kind == ParameterKind::kD)) {
      EXPECT_EQ(p.decided_by, DecidedBy::kFrame) << name;
    }
    if (zero && (p.key.joint == 1 || p.key.joint == 2)) {
      EXPECT_EQ(p.decided_by, DecidedBy::kData) << name;
    }
  }
  EXPECT_GT(data, 15);
  EXPECT_GE(frame, 2);
}

TEST(Identify, CovarianceIsSymmetricPositiveAndItsDiagonalIsTheSigmas) {
  const Calibration result = identify(demo_cell(), with_outliers());
  const auto n = static_cast<Eigen::Index>(result.parameters.size());
  ASSERT_EQ(result.covariance.rows(), n);
  ASSERT_EQ(result.covariance.cols(), n);
  EXPECT_LT((result.covariance - result.covariance.transpose()).norm(),
            1e-12 * result.covariance.norm());
  for (Eigen::Index i = 0; i < n; ++i)
    EXPECT_NEAR(std::sqrt(result.covariance(i, i)),
                result.parameters[static_cast<std::size_t>(i)].sigma,
                1e-12 * result.parameters[static_cast<std::size_t>(i)].sigma);
}

TEST(Predictor, WithoutCorrectionIsTheNominalArmAndWithItTheTrueOne) {
  const sim::Truth truth = plain_truth(demo_cell(), 1);
  const Predictor predictor(identify(demo_cell(), with_outliers()));
  const ArmModel nominal(demo_cell().robot, demo_cell().tool);
  double before = 0.0, after = 0.0;
  for (const Touch& touch : with_outliers()) {
    EXPECT_EQ(predictor.nominal(touch.joint_rad).translation(),
              nominal.nominal_tcp(touch.joint_rad).translation());
    // Height is free by convention; differences of positions are not.
    const Eigen::Vector3d real =
        truth.arm.position(truth.arm.prepare(touch.joint_rad), truth.errors.data());
    before += (predictor.nominal(touch.joint_rad).translation() - real).norm();
    const Prediction prediction = predictor.calibrated(touch.joint_rad);
    after += (prediction.tcp.translation() - real).norm();
    EXPECT_GT(prediction.u95_m, 0.0);
    EXPECT_LT(prediction.u95_m, 2e-3);
  }
  EXPECT_LT(after, before);
}

}  // namespace
}  // namespace cellcal::calib
