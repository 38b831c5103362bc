// The mistakes that are made again and again lead to a diagnosis and not to a bad calibration.

#include "calib/identify/likely_causes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <random>

#include "calib/files/files.h"
#include "calib/files/shipped_robots.h"
#include "calib/identify/identify.h"
#include "calib/model/error.h"
#include "tests/calib/findings.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::found;
using testing::make_touches;
using testing::words_of;

const std::vector<Touch>& touches() {
  static const std::vector<Touch> made =
      make_touches(demo_cell(), testing::plain_truth(demo_cell(), 5), {.fit = 80, .check = 16})
          .touches;
  return made;
}

/// All that a user is told; asserts that nothing is let through.
std::string told(const Cell& cell, const std::vector<Touch>& of) {
  try {
    const Calibration c = identify(cell, of, {}, shipped_robots);
    EXPECT_FALSE(c.verdict.publish);
    return words_of(c);
  } catch (const IdentifyError& error) {
    return error.what();
  }
}

void expect_told(const Cell& cell, const std::vector<Touch>& of, const std::string& words) {
  const std::string all = told(cell, of);
  EXPECT_NE(all.find(words), std::string::npos) << all;
}

TEST(Diagnosis, OfGoodTouchesIsNothing) {
  EXPECT_TRUE(likely_causes(demo_cell(), touches(), shipped_robots).empty());
}

TEST(Diagnosis, AnAxisThatTurnsTheOtherWayIsNamed) {
  for (const std::size_t joint : {2u, 3u}) {
    Cell cell = demo_cell();
    cell.robot.joints[joint].sign *= -1;
    expect_told(cell, touches(),
                "with " + cell.robot.joints[joint].name + " turning the other way");
  }
}

TEST(Diagnosis, AnglesInRadiansAreNamed) {
  std::vector<Touch> wrong = touches();
  for (Touch& touch : wrong)
    for (double& q : touch.joint_rad) q *= std::numbers::pi / 180.0;
  expect_told(demo_cell(), wrong, "read as radians");
}

/// The touches of an arm that does what its model lacks, ten times what the cell file states.
const std::vector<Touch>& misfit() {
  static const std::vector<Touch> made =
      make_touches(demo_cell(), testing::plain_truth(demo_cell(), 5),
                   {.fit = 80, .check = 0, .noise_m = 0.25e-3})
          .touches;
  return made;
}

TEST(Diagnosis, IsTheSameWhereTheArmScattersTenTimesMoreThanStated) {
  Cell cell = demo_cell();
  cell.touch_sigma_m = 0.025e-3;
  EXPECT_TRUE(likely_causes(cell, misfit()).empty());
  std::vector<Touch> wrong = misfit();
  for (Touch& touch : wrong)
    for (double& q : touch.joint_rad) q *= std::numbers::pi / 180.0;
  expect_told(cell, wrong, "read as radians");
  wrong = misfit();
  for (Touch& touch : wrong) std::swap(touch.joint_rad[3], touch.joint_rad[5]);
  expect_told(cell, wrong, "with the angles of A4 and A6 exchanged");
  Cell turned = cell;
  turned.robot.joints[2].sign *= -1;
  expect_told(turned, misfit(), "turning the other way");
  Cell metres = cell;
  metres.tool.tcp.translation() /= 1000.0;
  metres.tool.length_m /= 1000.0;
  expect_told(metres, misfit(), "give it in millimetres");
}

TEST(Diagnosis, AnAxisThatLostItsMasteringIsNamedWithHowMuchIsMissing) {
  const auto& joints = demo_cell().robot.joints;
  ASSERT_TRUE(std::any_of(joints.begin() + 1, joints.end(), [](const Joint& j) {
    return j.sign < 0;
  })) << "an axis that turns the other way is to be among them";
  for (std::size_t joint = 1; joint + 1 < joints.size();
       ++joint) {  // the last one: the tip is near it
    SCOPED_TRACE(joint);
    std::vector<Touch> wrong = touches();
    for (Touch& touch : wrong) touch.joint_rad[joint] += 2.0 * std::numbers::pi / 180.0;
    const std::string all = told(demo_cell(), wrong);
    const std::size_t at =
        all.find(" deg added to all angles of " + demo_cell().robot.joints[joint].name);
    ASSERT_NE(at, std::string::npos) << all;
    EXPECT_NEAR(std::stod(all.substr(all.rfind("with ", at) + 5)), -2.0, 0.1) << all;
  }
}

TEST(Diagnosis, WhatWasWrongAllAlongIsNotToldAsAJumpAfterTheFirstTouches) {
  for (const std::size_t joint : {std::size_t{3}, std::size_t{4}})
    for (const double off_deg : {-5.0, 5.0}) {
      SCOPED_TRACE(joint);
      std::vector<Touch> wrong = touches();
      for (Touch& touch : wrong) touch.joint_rad[joint] += off_deg * std::numbers::pi / 180.0;
      const std::string all = told(demo_cell(), wrong);
      EXPECT_EQ(all.find("jumped"), std::string::npos) << all;
      EXPECT_NE(all.find("deg added to all angles of"), std::string::npos) << all;
    }
  Cell cell = demo_cell();
  cell.tool.tcp.translation() =
      Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitZ()) * cell.tool.tcp.translation();
  const std::string all = told(cell, touches());
  EXPECT_EQ(all.find("knocked tool"), std::string::npos) << all;
  EXPECT_NE(all.find("likely cause"), std::string::npos) << all;
}

TEST(Diagnosis, LostMasteringIsNamedThoughALoneSphereLooksAsIfItHadMoved) {
  Cell cell = demo_cell();
  cell.targets.resize(1);
  cell.lengths.clear();
  auto wrong = make_touches(cell, testing::plain_truth(cell, 5), {.fit = 50, .check = 10}).touches;
  for (Touch& touch : wrong) touch.joint_rad[1] += 2.0 * std::numbers::pi / 180.0;
  expect_told(cell, wrong, "deg added to all angles of A2");
}

TEST(Diagnosis, ColumnsOfTwoAxesThatWereExchangedAreNamed) {
  std::vector<Touch> wrong = touches();
  for (Touch& touch : wrong) std::swap(touch.joint_rad[3], touch.joint_rad[5]);
  expect_told(demo_cell(), wrong, "with the angles of A4 and A6 exchanged");
}

TEST(Diagnosis, AToolInMetresIsNamed) {
  Cell cell = demo_cell();
  cell.tool.tcp.translation() /= 1000.0;
  cell.tool.length_m /= 1000.0;  // the file has it from the tip unless it says otherwise
  expect_told(cell, touches(), "give it in millimetres");
}

TEST(Diagnosis, TwoTargetsThatWereSwappedAreNamed) {
  std::vector<Touch> wrong = touches();
  for (Touch& touch : wrong)
    touch.target = touch.target == "S1" ? "S3" : touch.target == "S3" ? "S1" : touch.target;
  expect_told(demo_cell(), wrong, "with S1 and S3 swapped");
}

TEST(Diagnosis, AnotherToolIsNamedWithHowFarItsTipIsOff) {
  Cell cell = demo_cell();
  cell.tool.tcp.translation() += Eigen::Vector3d(0.012, -0.008, 0.020);
  expect_told(cell, touches(), "with the tool's tip moved by about");
}

TEST(Diagnosis, ALengthOfTheRobotFileThatIsWrongByCentimetresIsNamedWithWhatItShouldBe) {
  const auto told_mm = [](const Cell& cell, const std::string& before) {
    const std::string all = told(cell, touches());
    const std::size_t at = all.find(before);
    EXPECT_NE(at, std::string::npos) << all;
    return at == std::string::npos ? 0.0 : std::stod(all.substr(at + before.size()));
  };
  // 35 mm more behind the wrist puts the tips beyond the spheres' middles, whose far sides they
  // fit.
  Cell longer = demo_cell();
  longer.robot.joints[5].d_m += 0.035;
  EXPECT_NEAR(told_mm(longer, "with d_mm of A6 "), demo_cell().robot.joints[5].d_m * 1e3, 3.0);
  Cell wider = demo_cell();
  wider.robot.joints[1].a_m += 0.1;
  EXPECT_NEAR(told_mm(wider, "with a_mm of A2 "), demo_cell().robot.joints[1].a_m * 1e3, 3.0);
}

TEST(Diagnosis, TheFileOfAnotherRobotIsNamedWithTheOneThatFits) {
  Cell cell = demo_cell();
  cell.robot = load_robot(robots_directories().front() / "kr16_r1610_2.toml");
  expect_told(cell, touches(), "with the robot file kr5_");
  // None is read that is not given.
  EXPECT_FALSE(found(identify(cell, touches()), FindingKind::kLikelyCause));
}

TEST(Diagnosis, FieldsOfTheRobotFileThatTurnItsAxesAboutAreNamed) {
  constexpr double kQuarter = std::numbers::pi / 2.0;
  Cell turned = demo_cell();
  for (const std::size_t joint : {std::size_t{0}, std::size_t{3}})
    turned.robot.joints[joint].sign = -turned.robot.joints[joint].sign;
  expect_told(turned, touches(),
              "with sign of A1 -1 instead of 1, sign of A4 -1 instead of 1 the touches make sense");
  Cell zeros = demo_cell();
  zeros.robot.joints[1].offset_rad -= kQuarter;
  zeros.robot.joints[2].offset_rad += kQuarter;
  expect_told(zeros, touches(),
              "with offset_deg of A2 0 instead of -90, offset_deg of A3 -90 instead of 0 the "
              "touches make sense");
  Cell twist = demo_cell();
  twist.robot.joints[3].alpha_rad = -twist.robot.joints[3].alpha_rad;
  expect_told(twist, touches(), "with alpha_deg of A4 90 instead of -90 the touches make sense");
}

TEST(Diagnosis, WhatChangesNothingIsNotNamedBesideTheFieldThatIsWrong) {
  Cell cell = demo_cell();  // without stated centres the first axis' zero is anybody's
  for (Target& target : cell.targets) target.has_centre = false;
  cell.robot.joints[2].offset_rad += std::numbers::pi / 2.0;
  const std::string all = told(cell, touches());
  EXPECT_NE(all.find("with offset_deg of A3 -90 instead of 0 the touches make sense"),
            std::string::npos)
      << all;
  EXPECT_EQ(all.find("of A1"), std::string::npos) << all;
}

TEST(Diagnosis, TheSignOfAnAxisNearTheTipIsNamedThoughTheNominalArmIsHardlyFartherOff) {
  Cell cell = demo_cell();
  cell.tool.tcp.translation() = Eigen::Vector3d(2e-3, 0.0, 0.3);
  auto wrong = make_touches(cell, testing::plain_truth(cell, 5), {.fit = 80, .check = 16}).touches;
  for (Touch& touch : wrong) touch.joint_rad[5] = -touch.joint_rad[5];
  expect_told(cell, wrong, "with A6 turning the other way the touches make sense");
}

TEST(Diagnosis, FieldsInWhichTheShippedFileDiffersAreNamed) {
  Cell metres = demo_cell();
  for (Joint& joint : metres.robot.joints) {
    joint.a_m *= 1e-3;
    joint.d_m *= 1e-3;
  }
  expect_told(metres, touches(), "it has d_mm of A1 400 instead of 0.4");
}

TEST(Diagnosis, AnArmOnTheWallWhoseFileSaysFloorIsNamed) {
  Cell wall = demo_cell();
  wall.robot.gravity_m_s2 = {9.81, 0.0, 0.0};
  const auto hanging =
      make_touches(wall, testing::plain_truth(wall, 5), {.fit = 80, .check = 16}).touches;
  expect_told(demo_cell(), hanging, "with gravity along +x of the base the touches make sense");
}

TEST(Diagnosis, AStatedCentreThatIsHeldTooFirmlyIsNamed) {
  Cell cell = demo_cell();
  for (Target& target : cell.targets) target.centre_sigma_m = 1e-4;
  const auto made = touches();
  // Where the touches say, but for one.
  const Calibration right = identify(demo_cell(), made);
  for (const TargetResult& t : right.targets)
    cell.targets[cell.target_index(t.id)].centre_m = t.centre_m;
  cell.targets[1].centre_m.y() += 50e-3;
  const std::string all = told(cell, made);
  EXPECT_NE(all.find("likely cause: with S2 not held where the cell file states it"),
            std::string::npos)
      << all;
}

TEST(Diagnosis, AToolThatIsNotStatedIsNamed) {
  Cell cell = demo_cell();
  cell.tool.tcp.translation().setZero();
  cell.tool.length_m = 0.0;
  const std::string all = told(cell, touches());
  const std::string before = "with the tool's tip moved by about (";
  const std::size_t at = all.find(before);
  ASSERT_NE(at, std::string::npos) << all;
  EXPECT_NEAR(std::stod(all.substr(at + before.size())),
              demo_cell().tool.tcp.translation().x() * 1e3, 3.0)
      << all;
}

TEST(Diagnosis, NamesThatWentRoundAmongThreeTargetsAreNamed) {
  std::vector<Touch> wrong = touches();
  for (Touch& touch : wrong)
    touch.target = touch.target == "S1"   ? "S2"
                   : touch.target == "S2" ? "S3"
                   : touch.target == "S3" ? "S1"
                                          : touch.target;
  expect_told(demo_cell(), wrong,
              "with the touches of S1 taken for S3's, of S2 for S1's, of S3 for S2's all makes "
              "sense");
  wrong = touches();
  for (Touch& touch : wrong)
    touch.target = touch.target == "S1"   ? "S2"
                   : touch.target == "S2" ? "S1"
                   : touch.target == "S3" ? "S4"
                                          : "S3";
  expect_told(demo_cell(), wrong, "of S3 for S4's, of S4 for S3's all makes sense");
}

TEST(Diagnosis, ASwapIsNotToldAsATargetThatStandsElsewhere) {
  Cell cell = demo_cell();
  cell.targets.resize(3);
  for (Target& target : cell.targets) target.has_centre = false;
  std::erase_if(cell.lengths,
                [](const CertifiedLength& l) { return l.from == "S4" || l.to == "S4"; });
  ASSERT_EQ(cell.lengths.size(), 3u);
  auto wrong = make_touches(cell, testing::plain_truth(cell, 5), {.fit = 80, .check = 16}).touches;
  for (Touch& touch : wrong)
    touch.target = touch.target == "S1" ? "S2" : touch.target == "S2" ? "S1" : touch.target;
  const std::string all = told(cell, wrong);
  EXPECT_TRUE(all.find("with S1 and S2 swapped") != std::string::npos ||
              all.find("with the touches of S1 taken for S2's, of S2 for S1's") !=
                  std::string::npos)
      << all;
  EXPECT_EQ(all.find("does it stand where it stood"), std::string::npos) << all;
}

TEST(Diagnosis, TouchesUnderNamesAtRandomAreSeenToLieAllOver) {
  std::vector<Touch> wrong = touches();
  std::vector<std::string> names;
  for (const Touch& touch : wrong) names.push_back(touch.target);
  std::mt19937 random(1);
  for (std::size_t i = names.size(); i-- > 1;) std::swap(names[i], names[random() % (i + 1)]);
  for (std::size_t i = 0; i < wrong.size(); ++i) wrong[i].target = names[i];
  expect_told(demo_cell(), wrong, "3 other targets); check the target column");
}

TEST(Diagnosis, ARobotFileWithoutGravityIsNamed) {
  Cell heavy = demo_cell();
  heavy.tool.deflection_sigma = 0.01;
  const auto made = make_touches(heavy, testing::plain_truth(heavy, 2), {.fit = 200}).touches;
  heavy.robot.gravity_m_s2.setZero();
  expect_told(heavy, made, "with gravity along -z of the base the touches make sense");
}

TEST(Diagnosis, AnotherDiameterIsNamed) {
  Cell cell = demo_cell();
  for (Target& target : cell.targets) target.diameter_m += 0.006;
  expect_told(cell, touches(), "diameter");
}

TEST(Diagnosis, AWrongCertifiedLengthIsNamedWithWhatItShouldBe) {
  for (const double off_m : {0.3e-3, 1.5e-3, -0.054, 0.7}) {
    SCOPED_TRACE(off_m);
    Cell cell = demo_cell();
    ASSERT_GE(cell.lengths.size(), 2u);
    CertifiedLength& wrong = cell.lengths[1];
    const double is_mm = wrong.length_m * 1e3;
    wrong.length_m += off_m;
    const std::string all = told(cell, touches());
    const std::string words = "without the certified length of " + wrong.from + " and " + wrong.to +
                              " everything makes sense, and they lie ";
    const std::size_t at = all.find(words);
    ASSERT_NE(at, std::string::npos) << all;
    EXPECT_NEAR(std::stod(all.substr(at + words.size())), is_mm, 0.1) << all;
    EXPECT_EQ(all.find("moved target"), std::string::npos) << all;
  }
}

TEST(Diagnosis, ATenthOfAMillimetreInALengthShowsAmongManyTouches) {
  const auto many =
      make_touches(demo_cell(), testing::plain_truth(demo_cell(), 7), {.fit = 400, .check = 16});
  for (std::size_t k = 0; k < demo_cell().lengths.size(); ++k) {
    SCOPED_TRACE(k);
    Cell cell = demo_cell();
    cell.lengths[k].length_m += 0.1e-3;
    const std::string all = told(cell, many.touches);
    EXPECT_NE(all.find("without the certified length of " + cell.lengths[k].from + " and " +
                       cell.lengths[k].to),
              std::string::npos)
        << all;
    EXPECT_EQ(all.find("moved target"), std::string::npos) << all;
  }
}

TEST(Diagnosis, ATargetThatStandsElsewhereThanWhenItsLengthsWereMeasuredIsNamed) {
  Cell cell = demo_cell();
  for (CertifiedLength& length : cell.lengths)
    if (length.from == "S2" || length.to == "S2") length.length_m += 0.8e-3;
  expect_told(cell, touches(), "without the 3 certified lengths of S2 everything makes sense");
}

TEST(Diagnosis, TwoWrongLengthsAreNotTakenForATargetThatMoved) {
  for (const auto& [a, b] : {std::pair{0u, 5u}, std::pair{0u, 3u}}) {
    SCOPED_TRACE(b);
    Cell cell = demo_cell();
    cell.lengths[a].length_m += 0.5e-3;
    cell.lengths[b].length_m += 0.5e-3;
    const std::string all = told(cell, touches());
    EXPECT_EQ(all.find("moved target:"), std::string::npos) << all;
    EXPECT_EQ(all.find("seems to have moved"), std::string::npos) << all;
    // Two at one sphere can look like its diameter, too.
    EXPECT_TRUE(all.find("certified length S") != std::string::npos ||
                all.find("and its certified lengths") != std::string::npos ||
                all.find("or wrong certified lengths (without them nothing moved)") !=
                    std::string::npos)
        << all;
  }
}

TEST(Diagnosis, TwoCertifiedLengthsThatWereExchangedAreNamed) {
  Cell cell = demo_cell();
  std::swap(cell.lengths[0].length_m, cell.lengths[4].length_m);
  expect_told(cell, touches(), "with the certified lengths of S1-S2 and S2-S4 exchanged");
}

TEST(Diagnosis, ALoneLengthThatContradictsTheArmIsNamed) {
  for (const double off_m : {0.01, 0.03}) {
    SCOPED_TRACE(off_m);
    Cell cell = demo_cell();
    cell.lengths.resize(1);
    cell.lengths[0].length_m += off_m;
    expect_told(cell, touches(), "without the certified length of " + cell.lengths[0].from);
  }
}

TEST(Diagnosis, ATargetThatMovedOnTheWayIsNamedWithHowFar) {
  // The sphere was knocked half a centimetre half-way through: its later touches were all made
  // where it stands then.
  Cell cell = demo_cell();
  const sim::Truth truth = testing::plain_truth(cell, 5);
  sim::Truth later = truth;
  later.centre_m[1] += Eigen::Vector3d(0.004, 0.003, 0.0);
  const auto before = make_touches(cell, truth, {.fit = 80}).touches;
  const auto after = make_touches(cell, later, {.fit = 80}).touches;
  std::vector<Touch> both(before.begin(), before.begin() + 40);
  both.insert(both.end(), after.begin() + 40, after.end());
  expect_told(cell, both, "moved target: S2 moved by 4.98");
}

}  // namespace
}  // namespace cellcal::calib
