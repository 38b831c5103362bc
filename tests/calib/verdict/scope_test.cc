// Undetermined directions are reported in words, and the scope of a result.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "calib/estimate/region.h"
#include "calib/files/files.h"
#include "calib/identify/identify.h"
#include "calib/identify/identify_once.h"
#include "calib/model/linear.h"
#include "tests/calib/findings.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::found;
using testing::make_touches;
using testing::one_sphere_cell;
using testing::plain_truth;
using testing::the;
using testing::tracker_cell;
using testing::words_of;

Calibration of(const Cell& cell, testing::Making making = {}) {
  return identify(cell, make_touches(cell, plain_truth(cell, making.seed), making).touches);
}

/// The first direction of that kind; null if there is none.
const UnidentifiableDirection* first(const Calibration& result, UnidentifiableKind kind) {
  for (const UnidentifiableDirection& direction : result.unidentifiable)
    if (direction.kind == kind) return &direction;
  return nullptr;
}

std::string all_words(const Calibration& result) {
  std::string text;
  for (const UnidentifiableDirection& direction : result.unidentifiable)
    text += words(result.cell, direction) + "\n";
  return text;
}

/// From the first axis to the fully extended flange.
double reach_of(const Robot& robot) {
  double sum = robot.joints.front().a_m;
  for (std::size_t i = 1; i < robot.joints.size(); ++i)
    sum += std::hypot(robot.joints[i].d_m, robot.joints[i].a_m);
  return sum;
}

/// A cell of another arm: tool, positions and lengths scaled by its reach, or slightly less.
Cell with_arm(Cell cell, const std::string& file) {
  const Robot robot = load_robot(CELLCAL_ROBOTS_FOLDER "/" + file);
  const double size = 0.8 * reach_of(robot) / reach_of(cell.robot);
  const double shoulder_m = robot.joints.front().d_m,
               its_shoulder_m = cell.robot.joints.front().d_m;
  cell.robot = robot;
  cell.tool.tcp.translation() *= size;
  cell.tool.com_m *= size;
  cell.tool.length_m *= size;
  cell.tool.mass_kg *= std::min(1.0, std::pow(size, 3));
  for (Target& target : cell.targets) {
    target.centre_m.z() -= its_shoulder_m;
    target.centre_m *= size;
    target.centre_m.z() += shoulder_m;
  }
  for (CertifiedLength& length : cell.lengths) length.length_m *= size;
  return cell;
}

/// The three directions that free spheres cannot determine, and no fourth.
void expect_the_three(const Calibration& result) {
  EXPECT_EQ(result.frame_basis.cols(), 3);
  EXPECT_TRUE(first(result, UnidentifiableKind::kZeroOfFirstJoint)) << all_words(result);
  EXPECT_TRUE(first(result, UnidentifiableKind::kHeightOfBase)) << all_words(result);
  const UnidentifiableDirection* behind = first(result, UnidentifiableKind::kBehindLastJoint);
  ASSERT_TRUE(behind) << all_words(result);
  const int last = static_cast<int>(result.cell.robot.joints.size()) - 1;
  EXPECT_EQ(behind->parameters.front().joint, last) << all_words(result);
  const auto conventions =
      std::count_if(result.unidentifiable.begin(), result.unidentifiable.end(),
                    [](const UnidentifiableDirection& direction) {
                      return direction.kind <= UnidentifiableKind::kNothingMoves;
                    });
  EXPECT_EQ(conventions, 3) << all_words(result);
}

TEST(Scope, OneSphereNamesExactlyTheThreeFrameDirections) {
  for (unsigned seed = 1; seed <= 5; ++seed)
    expect_the_three(of(one_sphere_cell(), {.fit = 60, .seed = seed}));
}

TEST(Scope, FourSpheresNameExactlyTheSameThree) {
  for (unsigned seed = 1; seed <= 5; ++seed)
    expect_the_three(of(demo_cell(), {.fit = 100, .seed = seed}));
}

TEST(Scope, ArmsOfEverySizeNameTheSameThree) {
  for (const char* file : {"kr3_r540.toml", "kr4_r600.toml", "kr6_r700_2.toml", "kr7_r900_3.toml",
                           "kr560_r3100_2.toml"}) {
    SCOPED_TRACE(file);
    expect_the_three(of(with_arm(one_sphere_cell(), file), {.fit = 60}));
    expect_the_three(of(with_arm(demo_cell(), file), {.fit = 100}));
  }
}

TEST(Scope, AToolThatBendsByCentimetresNamesTheSameThree) {
  Cell cell = demo_cell();
  const sim::Truth stiff = plain_truth(cell, 1);
  sim::Truth soft = stiff;
  for (int p = 0; p < soft.arm.size(); ++p)
    if (soft.arm.parameters()[static_cast<std::size_t>(p)].kind == ParameterKind::kDeflection)
      soft.errors[p] = 0.05;
  expect_the_three(identify(cell, make_touches(cell, soft, {.fit = 100}).touches));
}

TEST(Scope, AComplianceThatMovesNothingIsNoMatterOfFrame) {
  const Calibration result = of(with_arm(one_sphere_cell(), "kr3_r540.toml"), {.fit = 60});
  const ParameterKey wrist = joint_parameter(ParameterKind::kCompliance, 5);
  const auto names_it = [&](const UnidentifiableDirection& direction) {
    return std::count(direction.parameters.begin(), direction.parameters.end(), wrist) > 0;
  };
  bool no_effect = false;
  for (const UnidentifiableDirection& direction : result.unidentifiable) {
    no_effect = no_effect || (direction.kind == UnidentifiableKind::kNoEffect &&
                              names_it(direction) && direction.parameters.size() == 1);
    EXPECT_FALSE(direction.kind <= UnidentifiableKind::kNothingMoves && names_it(direction))
        << all_words(result);
  }
  EXPECT_TRUE(no_effect) << all_words(result);
  const ParameterResult* compliance = find(result, wrist);
  ASSERT_TRUE(compliance);
  EXPECT_EQ(compliance->decided_by, DecidedBy::kPrior);
}

TEST(Scope, FrameDirectionsMoveNoTouch) {
  const Cell cell = one_sphere_cell();
  const auto made = make_touches(cell, plain_truth(cell, 1), {.fit = 60});
  const Calibration result = identify(cell, made.touches);
  // A step along each direction, of the size of the tolerances, in arm and centre together.
  const Cell levelled = at_level(cell, result.level);
  const ArmModel arm(levelled.robot, levelled.tool);
  const auto n = static_cast<Eigen::Index>(result.parameters.size());
  Eigen::VectorXd at(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const ParameterResult& p = result.parameters[static_cast<std::size_t>(i)];
    at[i] = p.nominal + p.correction;
  }
  Eigen::Index centre = 0;
  while (result.parameters[static_cast<std::size_t>(centre)].key !=
         target_parameter(ParameterKind::kCentre, 0))
    ++centre;
  for (Eigen::Index c = 0; c < result.frame_basis.cols(); ++c) {
    const Eigen::VectorXd step = 0.1 * result.frame_basis.col(c);
    double worst = 0.0;
    for (const Touch& touch : made.touches) {
      const PreparedPose pose = arm.prepare(touch.joint_rad);
      const auto distance = [&](const Eigen::VectorXd& x) {
        return (arm.position(pose, x.data()) - x.segment<3>(centre)).norm();
      };
      worst = std::max(worst, std::abs(distance(at + step) - distance(at - step)) / 2);
    }
    EXPECT_LT(worst, 1e-6) << "direction " << c;  // a millimetre or a milliradian moves tips 1 mm
  }
}

TEST(Scope, OneSphereClaimsNothingAwayFromItself) {
  const Calibration result = of(one_sphere_cell(), {.fit = 60, .check = 10});
  EXPECT_FALSE(result.verdict.workspace);
  EXPECT_EQ(the(result, FindingKind::kScaleByNothing, "lengths"), 0.0);
}

TEST(Scope, CertifiedLengthsTouchedAtBothEndsOpenTheWorkspace) {
  const Calibration result = of(demo_cell(), {.fit = 100, .check = 20});
  EXPECT_TRUE(result.verdict.publish()) << words_of(result);
  EXPECT_TRUE(result.verdict.workspace);
  EXPECT_TRUE(found(result, FindingKind::kScaleByLengths));
}

TEST(Scope, ALengthTouchedAtOneEndOnlyDoesNot) {
  auto made = make_touches(demo_cell(), plain_truth(demo_cell(), 1), {.fit = 160});
  std::erase_if(made.touches, [](const Touch& touch) { return touch.target != "S1"; });
  EXPECT_FALSE(identify(demo_cell(), made.touches).verdict.workspace);
}

TEST(Scope, SpheresWithoutLengthsDoNot) {
  Cell cell = demo_cell();
  cell.lengths.clear();
  EXPECT_FALSE(of(cell, {.fit = 100}).verdict.workspace);
}

TEST(Scope, TheWorkspaceIsPredictedWorseWithoutALength) {
  Cell cell = demo_cell();
  const auto made = make_touches(cell, plain_truth(cell, 1), {.fit = 100});
  const double with = identify(cell, made.touches).predicted_workspace_m;
  cell.lengths.clear();
  EXPECT_GT(identify(cell, made.touches).predicted_workspace_m, 1.2 * with);
}

TEST(Verdict, TakesTouchesThatScatterMoreThanTheCellFileSaysForWhatTheyAre) {
  const Calibration result = of(demo_cell(), {.fit = 100, .noise_m = 2e-4});
  EXPECT_TRUE(result.verdict.publish()) << words_of(result);
  EXPECT_TRUE(found(result, FindingKind::kModelError)) << words_of(result);
  EXPECT_GT(result.predicted_workspace_m, 2e-4);
}

TEST(Verdict, AsStatedBlocksTouchesThatScatterMoreAndSaysWhatToDo) {
  const auto made =
      make_touches(demo_cell(), plain_truth(demo_cell(), 1), {.fit = 100, .noise_m = 2e-4});
  const Calibration result = identify_single_pass(demo_cell(), made.touches);
  EXPECT_FALSE(result.verdict.publish());
  EXPECT_NEAR(the(result, FindingKind::kTouchScatter, "ratio"), 4.0, 1.0) << words_of(result);
}

TEST(Verdict, BlocksASphereTouchedAtOneSpotOnly) {
  const Calibration result = of(demo_cell(), {.fit = 100, .widest_rad = 0.02});
  EXPECT_FALSE(result.verdict.publish());
  EXPECT_TRUE(found(result, FindingKind::kTooFewDirections)) << words_of(result);
}

TEST(Verdict, BlocksAResultWithTooManyOutliers) {
  const Calibration result = of(demo_cell(), {.fit = 100, .outlier_share = 0.3});
  EXPECT_FALSE(result.verdict.publish());
  EXPECT_TRUE(found(result, FindingKind::kManyOutliers)) << words_of(result);
}

TEST(Verdict, SaysWhenNoTouchWasHeldOut) {
  EXPECT_TRUE(found(of(demo_cell(), {.fit = 100}), FindingKind::kNoCheckTouches));
}

TEST(Scope, IsNearTheTouchesWhereAJointWasNeverTurned) {
  const Cell cell = tracker_cell();
  const sim::Truth truth = plain_truth(demo_cell(), 3);
  const auto readings = [&](double a6_to, std::size_t every) {
    Random random(1);
    std::vector<Touch> touches;
    for (JointVector q : workspace_poses(ArmModel(cell), 60, 7)) {
      q[5] = 0.3 + (touches.size() % every == 0 ? random.uniform(0.0, a6_to) : 0.0);
      Touch& touch = touches.emplace_back();
      touch.target = "T1";
      touch.joint_rad = q;
      const Eigen::Vector3d tip = truth.arm.position(truth.arm.prepare(q), truth.errors.data());
      for (int axis = 0; axis < 3; ++axis)
        touch.tracker_m[axis] = tip[axis] + 0.02e-3 * random.normal();
    }
    return touches;
  };
  // In every touch, and save outlying ones.
  for (const Calibration& still :
       {identify(cell, readings(0.0, 1)), identify(cell, readings(0.5, 5))}) {
    EXPECT_TRUE(still.verdict.publish()) << words_of(still);
    EXPECT_FALSE(still.verdict.workspace);
    const Finding why = the(still, FindingKind::kScopeOfTouches);
    EXPECT_EQ(why.severity, Severity::kWarns);
    ASSERT_EQ(why.parts.size(), 1u);
    EXPECT_EQ(why.parts[0].about.name, cell.robot.joints[5].name);
  }
  const Calibration turned = identify(cell, readings(0.5, 1));
  EXPECT_TRUE(turned.verdict.workspace) << words_of(turned);
}

}  // namespace
}  // namespace cellcal::calib
