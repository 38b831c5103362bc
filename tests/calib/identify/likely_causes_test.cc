// Common mistakes lead to a diagnosis instead of a wrong calibration.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "calib/files/files.h"
#include "calib/files/robot_file.h"
#include "calib/identify/identify.h"
#include "tests/calib/findings.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::found;
using testing::make_touches;
using testing::words_of;

const std::vector<Touch>& good_touches() {
  static const std::vector<Touch> made =
      make_touches(demo_cell(), testing::plain_truth(demo_cell(), 5), {.fit = 80, .check = 16})
          .touches;
  return made;
}

/// Expects that nothing is published.
Calibration withheld(const Cell& cell, const std::vector<Touch>& of) {
  const Calibration c = identify(cell, of, {}, shipped_robots);
  EXPECT_FALSE(c.verdict.publish());
  return c;
}

/// Expects this likely cause among those named.
Finding expect_cause(const Cell& cell, const std::vector<Touch>& of, LikelyCause cause,
                     const std::string& about = {}) {
  const Calibration c = withheld(cell, of);
  const Finding finding = testing::cause(c, cause);
  EXPECT_EQ(finding.cause, cause) << words_of(c);
  EXPECT_TRUE(about.empty() || finding.about.name == about) << words_of(c);
  return finding;
}

double evidence(const Finding& finding, const char* name) { return value(finding.evidence, name); }

/// "A4 A6": all subjects of a finding.
std::string parts_of(const Finding& finding) {
  std::string all;
  for (const FindingPart& part : finding.parts)
    all += (all.empty() ? "" : " ") + part.about.name +
           (part.about.other_end.empty() ? "" : "-" + part.about.other_end);
  return all;
}

/// "A2.offset_deg 0 instead of -90"
std::string fields_of(const Finding& finding) {
  std::string all;
  for (const FindingPart& part : finding.parts) {
    if (part.about.of != Subject::Of::kJoint) continue;
    all += fmt::format("{}{}.{} {:.6g} instead of {:.6g}", all.empty() ? "" : ", ", part.about.name,
                       part.evidence.at(0).name, part.evidence.at(0).value,
                       value(part.evidence, "stated"));
  }
  return all;
}

TEST(Diagnosis, OfGoodTouchesIsNothing) {
  EXPECT_TRUE(likely_causes(demo_cell(), good_touches(), shipped_robots).empty());
}

TEST(Diagnosis, AnAxisThatTurnsTheOtherWayIsNamed) {
  for (const std::size_t joint : {2u, 3u}) {
    Cell cell = demo_cell();
    cell.robot.joints[joint].sign *= -1;
    (void)expect_cause(cell, good_touches(), LikelyCause::kAxisSign, cell.robot.joints[joint].name);
  }
}

TEST(Diagnosis, AnglesInRadiansAreNamed) {
  std::vector<Touch> wrong = good_touches();
  for (Touch& touch : wrong)
    for (double& q : touch.joint_rad) q *= std::numbers::pi / 180.0;
  EXPECT_LT(evidence(expect_cause(demo_cell(), wrong, LikelyCause::kRadians), "largest"), 6.3);
}

/// Touches of an arm with unmodelled errors ten times the cell file's sigma.
const std::vector<Touch>& misfit() {
  static const std::vector<Touch> made =
      make_touches(demo_cell(), testing::plain_truth(demo_cell(), 5),
                   {.fit = 80, .check = 0, .noise_m = 0.25e-3})
          .touches;
  return made;
}

/// A stated sigma ten times below the arm's scatter.
Cell cell_of_misfit() {
  Cell cell = demo_cell();
  cell.touch_sigma_m = 0.025e-3;
  return cell;
}

TEST(Diagnosis, OfTouchesIsTheSameWhereTheArmScattersTenTimesMoreThanStated) {
  const Cell cell = cell_of_misfit();
  EXPECT_TRUE(likely_causes(cell, misfit()).empty());
  std::vector<Touch> wrong = misfit();
  for (Touch& touch : wrong)
    for (double& q : touch.joint_rad) q *= std::numbers::pi / 180.0;
  (void)expect_cause(cell, wrong, LikelyCause::kRadians);
  wrong = misfit();
  for (Touch& touch : wrong) std::swap(touch.joint_rad[3], touch.joint_rad[5]);
  EXPECT_EQ(parts_of(expect_cause(cell, wrong, LikelyCause::kExchangedColumns)), "A4 A6");
}

TEST(Diagnosis, OfFilesIsTheSameWhereTheArmScattersTenTimesMoreThanStated) {
  const Cell cell = cell_of_misfit();
  Cell turned = cell;
  turned.robot.joints[2].sign *= -1;
  (void)expect_cause(turned, misfit(), LikelyCause::kAxisSign);
  Cell metres = cell;
  metres.tool.tcp.translation() /= 1000.0;
  metres.tool.length_m /= 1000.0;
  (void)expect_cause(metres, misfit(), LikelyCause::kToolUnit);
}

TEST(Diagnosis, AMasteringThatTheArmFollowsFarOutsideItsTolerancesIsNamedInAnyScatter) {
  std::vector<Touch> wrong = misfit();
  constexpr double kOff = 3.0 * std::numbers::pi / 180.0;
  for (Touch& touch : wrong) touch.joint_rad[2] += kOff;
  const Finding finding = expect_cause(cell_of_misfit(), wrong, LikelyCause::kMastering, "A3");
  EXPECT_NEAR(evidence(finding, "add"), -3.0, 0.2);
}

TEST(Diagnosis, AnAxisThatLostItsMasteringIsNamedWithHowMuchIsMissing) {
  const auto& joints = demo_cell().robot.joints;
  ASSERT_TRUE(std::any_of(joints.begin() + 1, joints.end(), [](const Joint& j) {
    return j.sign < 0;
  })) << "an axis that turns the other way is to be among them";
  for (std::size_t joint = 1; joint + 1 < joints.size();
       ++joint) {  // not the last one: the tip is near it
    SCOPED_TRACE(joint);
    std::vector<Touch> wrong = good_touches();
    for (Touch& touch : wrong) touch.joint_rad[joint] += 2.0 * std::numbers::pi / 180.0;
    EXPECT_NEAR(evidence(expect_cause(demo_cell(), wrong, LikelyCause::kMastering,
                                      demo_cell().robot.joints[joint].name),
                         "add"),
                -2.0, 0.1);
  }
}

TEST(Diagnosis, WhatWasWrongAllAlongIsNotToldAsAJumpAfterTheFirstTouches) {
  for (const auto& [joint, off_deg] :
       {std::pair{std::size_t{3}, -5.0}, std::pair{std::size_t{4}, 5.0}}) {
    SCOPED_TRACE(joint);
    std::vector<Touch> wrong = good_touches();
    for (Touch& touch : wrong) touch.joint_rad[joint] += off_deg * std::numbers::pi / 180.0;
    const Calibration c = withheld(demo_cell(), wrong);
    EXPECT_FALSE(found(c, FindingKind::kJumped)) << words_of(c);
    EXPECT_EQ(testing::cause(c, LikelyCause::kMastering).cause, LikelyCause::kMastering)
        << words_of(c);
  }
  Cell cell = demo_cell();
  cell.tool.tcp.translation() =
      Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitZ()) * cell.tool.tcp.translation();
  const Calibration c = withheld(cell, good_touches());
  EXPECT_FALSE(found(c, FindingKind::kJumped)) << words_of(c);
  EXPECT_TRUE(found(c, FindingKind::kLikelyCause)) << words_of(c);
}

TEST(Diagnosis, LostMasteringIsNamedThoughALoneSphereLooksAsIfItHadMoved) {
  Cell cell = demo_cell();
  cell.targets.resize(1);
  cell.lengths.clear();
  auto wrong = make_touches(cell, testing::plain_truth(cell, 5), {.fit = 50, .check = 10}).touches;
  for (Touch& touch : wrong) touch.joint_rad[1] += 2.0 * std::numbers::pi / 180.0;
  (void)expect_cause(cell, wrong, LikelyCause::kMastering, "A2");
}

TEST(Diagnosis, ColumnsOfTwoAxesThatWereExchangedAreNamed) {
  std::vector<Touch> wrong = good_touches();
  for (Touch& touch : wrong) std::swap(touch.joint_rad[3], touch.joint_rad[5]);
  EXPECT_EQ(parts_of(expect_cause(demo_cell(), wrong, LikelyCause::kExchangedColumns)), "A4 A6");
}

TEST(Diagnosis, AToolInMetresIsNamed) {
  Cell cell = demo_cell();
  cell.tool.tcp.translation() /= 1000.0;
  cell.tool.length_m /= 1000.0;  // derived from the tip unless the file states it
  (void)expect_cause(cell, good_touches(), LikelyCause::kToolUnit);
}

TEST(Diagnosis, TwoTargetsThatWereSwappedAreNamed) {
  std::vector<Touch> wrong = good_touches();
  for (Touch& touch : wrong)
    touch.target = touch.target == "S1" ? "S3" : touch.target == "S3" ? "S1" : touch.target;
  EXPECT_EQ(parts_of(expect_cause(demo_cell(), wrong, LikelyCause::kTargetNames)), "S1-S3 S3-S1");
}

TEST(Diagnosis, AnotherToolIsNamedWithHowFarItsTipIsOff) {
  Cell cell = demo_cell();
  cell.tool.tcp.translation() += Eigen::Vector3d(0.012, -0.008, 0.020);
  EXPECT_NEAR(evidence(expect_cause(cell, good_touches(), LikelyCause::kToolTip), "z"), -20.0, 3.0);
}

double dimension_mm(const Cell& cell, const std::string& joint, const char* field) {
  const Finding finding = expect_cause(cell, good_touches(), LikelyCause::kDimension);
  if (finding.parts.size() != 1) return 0.0;
  EXPECT_EQ(finding.parts[0].about, about_joint(joint));
  return value(finding.parts[0].evidence, field);
}

TEST(Diagnosis, ALengthOfTheRobotFileThatIsWrongByCentimetresIsNamedWithWhatItShouldBe) {
  // An excess of 35 mm after the wrist puts the tips beyond the spheres' centres, where they fit
  // the far sides.
  Cell longer = demo_cell();
  longer.robot.joints[5].d_m += 0.035;
  EXPECT_NEAR(dimension_mm(longer, "A6", "d_mm"), demo_cell().robot.joints[5].d_m * 1e3, 3.0);
  Cell wider = demo_cell();
  wider.robot.joints[1].a_m += 0.1;
  EXPECT_NEAR(dimension_mm(wider, "A2", "a_mm"), demo_cell().robot.joints[1].a_m * 1e3, 3.0);
}

TEST(Diagnosis, TheFileOfAnotherRobotIsNamedWithTheOneThatFits) {
  Cell cell = demo_cell();
  cell.robot = load_robot(robots_directories().front() / "kr16_r1610_2.toml");
  const Finding other = expect_cause(cell, good_touches(), LikelyCause::kOtherRobot);
  EXPECT_TRUE(other.about.name.starts_with("kr5_")) << other.about.name;
  // Robot files are read only if given.
  EXPECT_FALSE(found(identify(cell, good_touches()), FindingKind::kLikelyCause));
}

TEST(Diagnosis, FieldsOfTheRobotFileThatTurnItsAxesAboutAreNamed) {
  constexpr double kQuarter = std::numbers::pi / 2.0;
  Cell turned = demo_cell();
  for (const std::size_t joint : {std::size_t{0}, std::size_t{3}})
    turned.robot.joints[joint].sign = -turned.robot.joints[joint].sign;
  EXPECT_EQ(fields_of(expect_cause(turned, good_touches(), LikelyCause::kAxisConvention)),
            "A1.sign -1 instead of 1, A4.sign -1 instead of 1");
  Cell zeros = demo_cell();
  zeros.robot.joints[1].offset_rad -= kQuarter;
  zeros.robot.joints[2].offset_rad += kQuarter;
  EXPECT_EQ(fields_of(expect_cause(zeros, good_touches(), LikelyCause::kAxisConvention)),
            "A2.offset_deg 0 instead of -90, A3.offset_deg -90 instead of 0");
  Cell twist = demo_cell();
  twist.robot.joints[3].alpha_rad = -twist.robot.joints[3].alpha_rad;
  EXPECT_EQ(fields_of(expect_cause(twist, good_touches(), LikelyCause::kAxisConvention)),
            "A4.alpha_deg 90 instead of -90");
}

TEST(Diagnosis, WhatChangesNothingIsNotNamedBesideTheFieldThatIsWrong) {
  Cell cell = demo_cell();  // without stated centres the first axis' zero is arbitrary
  for (Target& target : cell.targets) target.has_centre = false;
  cell.robot.joints[2].offset_rad += std::numbers::pi / 2.0;
  const Calibration c = withheld(cell, good_touches());
  EXPECT_EQ(fields_of(testing::cause(c, LikelyCause::kAxisConvention)),
            "A3.offset_deg -90 instead of 0");
  for (const Finding& one : c.verdict.findings) {
    EXPECT_NE(one.about.name, "A1") << words_of(c);
    for (const FindingPart& part : one.parts) EXPECT_NE(part.about.name, "A1") << words_of(c);
  }
}

TEST(Diagnosis, TheSignOfAnAxisNearTheTipIsNamedThoughTheNominalArmIsHardlyFartherOff) {
  Cell cell = demo_cell();
  cell.tool.tcp.translation() = Eigen::Vector3d(2e-3, 0.0, 0.3);
  auto wrong = make_touches(cell, testing::plain_truth(cell, 5), {.fit = 80, .check = 16}).touches;
  for (Touch& touch : wrong) touch.joint_rad[5] = -touch.joint_rad[5];
  (void)expect_cause(cell, wrong, LikelyCause::kAxisSign, "A6");
}

TEST(Diagnosis, FieldsInWhichTheShippedFileDiffersAreNamed) {
  Cell metres = demo_cell();
  for (Joint& joint : metres.robot.joints) {
    joint.a_m *= 1e-3;
    joint.d_m *= 1e-3;
  }
  const Finding other = expect_cause(metres, good_touches(), LikelyCause::kOtherRobot);
  EXPECT_NE(fields_of(other).find("A1.d_mm 400 instead of 0.4"), std::string::npos);
}

TEST(Diagnosis, AnArmOnTheWallWhoseFileSaysFloorIsNamed) {
  Cell wall = demo_cell();
  wall.robot.gravity_m_s2 = {9.81, 0.0, 0.0};
  const auto hanging =
      make_touches(wall, testing::plain_truth(wall, 5), {.fit = 80, .check = 16}).touches;
  EXPECT_GT(evidence(expect_cause(demo_cell(), hanging, LikelyCause::kGravity), "x"), 9.0);
}

TEST(Diagnosis, AStatedCentreThatIsHeldTooFirmlyIsNamed) {
  Cell cell = demo_cell();
  for (Target& target : cell.targets) target.centre_sigma_m = 1e-4;
  const auto made = good_touches();
  // At the touched centres, except for one.
  const Calibration right = identify(demo_cell(), made);
  for (const TargetResult& t : right.targets)
    cell.targets[cell.target_index(t.id)].centre_m = t.centre_m;
  cell.targets[1].centre_m.y() += 50e-3;
  EXPECT_NEAR(evidence(expect_cause(cell, made, LikelyCause::kStatedCentre, "S2"), "off"), 50.0,
              1.0);
}

TEST(Diagnosis, AToolThatIsNotStatedIsNamed) {
  Cell cell = demo_cell();
  cell.tool.tcp.translation().setZero();
  cell.tool.length_m = 0.0;
  EXPECT_NEAR(evidence(expect_cause(cell, good_touches(), LikelyCause::kToolTip), "x"),
              demo_cell().tool.tcp.translation().x() * 1e3, 3.0);
}

TEST(Diagnosis, NamesThatWentRoundAmongThreeTargetsAreNamed) {
  std::vector<Touch> wrong = good_touches();
  for (Touch& touch : wrong)
    touch.target = touch.target == "S1"   ? "S2"
                   : touch.target == "S2" ? "S3"
                   : touch.target == "S3" ? "S1"
                                          : touch.target;
  EXPECT_EQ(parts_of(expect_cause(demo_cell(), wrong, LikelyCause::kTargetNames)),
            "S1-S3 S2-S1 S3-S2");
  wrong = good_touches();
  for (Touch& touch : wrong)
    touch.target = touch.target == "S1"   ? "S2"
                   : touch.target == "S2" ? "S1"
                   : touch.target == "S3" ? "S4"
                                          : "S3";
  EXPECT_EQ(parts_of(expect_cause(demo_cell(), wrong, LikelyCause::kTargetNames)),
            "S1-S2 S2-S1 S3-S4 S4-S3");
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
  const Calibration c = withheld(cell, wrong);
  EXPECT_EQ(parts_of(testing::cause(c, LikelyCause::kTargetNames)), "S1-S2 S2-S1") << words_of(c);
  EXPECT_EQ(testing::cause(c, LikelyCause::kLengthsOfTarget).cause, std::nullopt) << words_of(c);
}

TEST(Diagnosis, TouchesUnderNamesAtRandomAreSeenToLieAllOver) {
  std::vector<Touch> wrong = good_touches();
  std::vector<std::string> names;
  for (const Touch& touch : wrong) names.push_back(touch.target);
  std::mt19937 random(1);
  for (std::size_t i = names.size(); i-- > 1;) std::swap(names[i], names[random() % (i + 1)]);
  for (std::size_t i = 0; i < wrong.size(); ++i) wrong[i].target = names[i];
  EXPECT_EQ(evidence(expect_cause(demo_cell(), wrong, LikelyCause::kScatteredTouches), "others"),
            3.0);
}

TEST(Diagnosis, ARobotFileWithoutGravityIsNamed) {
  Cell heavy = demo_cell();
  heavy.tool.deflection_sigma = 0.01;
  const auto made = make_touches(heavy, testing::plain_truth(heavy, 2), {.fit = 200}).touches;
  heavy.robot.gravity_m_s2.setZero();
  EXPECT_LT(evidence(expect_cause(heavy, made, LikelyCause::kGravity), "z"), -9.0);
}

TEST(Diagnosis, AnotherDiameterIsNamed) {
  Cell cell = demo_cell();
  for (Target& target : cell.targets) target.diameter_m += 0.006;
  EXPECT_NEAR(evidence(expect_cause(cell, good_touches(), LikelyCause::kAllDiameters), "off"), -6.0,
              1.5);
}

TEST(Diagnosis, AWrongCertifiedLengthIsNamedWithWhatItShouldBe) {
  int contradictions = 0;
  for (const double off_m : {0.3e-3, 1.5e-3, -0.054, 0.7}) {
    SCOPED_TRACE(off_m);
    Cell cell = demo_cell();
    ASSERT_GE(cell.lengths.size(), 2u);
    CertifiedLength& wrong = cell.lengths[1];
    const double is_mm = wrong.length_m * 1e3;
    wrong.length_m += off_m;
    const Calibration c = withheld(cell, good_touches());
    const Finding finding = testing::cause(c, LikelyCause::kCertifiedLength);
    EXPECT_EQ(finding.about.name + finding.about.other_end, wrong.from + wrong.to) << words_of(c);
    EXPECT_NEAR(evidence(finding, "measured"), is_mm, 0.1) << words_of(c);
    EXPECT_FALSE(found(c, FindingKind::kMovedTarget)) << words_of(c);
    // The fit with the wrong length measures it otherwise.
    const Finding* contradicted = first(c.verdict.findings, FindingKind::kCertifiedLength);
    if (contradicted == nullptr) continue;
    EXPECT_EQ(*find(contradicted->evidence, "measured"), *find(finding.evidence, "measured"))
        << words_of(c);
    const Quantity &is = *find(finding.evidence, "measured"),
                   &stated = *find(contradicted->evidence, "certified");
    EXPECT_NEAR(evidence(*contradicted, "apart"),
                std::abs(is.value - stated.value) / std::hypot(is.sigma, stated.sigma), 1e-9);
    ++contradictions;
  }
  EXPECT_GT(contradictions, 0);
}

TEST(Diagnosis, AWrongLengthIsNamedWhereItMakesAllTouchesOfASphereOutliers) {
  for (const std::size_t few : {5u, 7u}) {
    SCOPED_TRACE(few);
    Cell cell = demo_cell();
    CertifiedLength& wrong = cell.lengths[1];
    std::vector<Touch> touches = good_touches();
    std::size_t seen = 0;
    std::erase_if(touches, [&](const Touch& touch) {
      return touch.target == wrong.from && touch.set == TouchSet::kFit && ++seen > few;
    });
    wrong.length_m += 3e-3;
    const Finding finding = expect_cause(cell, touches, LikelyCause::kCertifiedLength, wrong.from);
    EXPECT_EQ(finding.about.other_end, wrong.to);
  }
}

TEST(Diagnosis, ATenthOfAMillimetreInALengthShowsAmongManyTouches) {
  const auto many =
      make_touches(demo_cell(), testing::plain_truth(demo_cell(), 7), {.fit = 400, .check = 16});
  for (std::size_t k = 0; k < demo_cell().lengths.size(); ++k) {
    SCOPED_TRACE(k);
    Cell cell = demo_cell();
    cell.lengths[k].length_m += 0.1e-3;
    const Calibration c = withheld(cell, many.touches);
    const Finding finding = testing::cause(c, LikelyCause::kCertifiedLength);
    EXPECT_EQ(finding.about.name, cell.lengths[k].from) << words_of(c);
    EXPECT_EQ(finding.about.other_end, cell.lengths[k].to) << words_of(c);
    EXPECT_FALSE(found(c, FindingKind::kMovedTarget)) << words_of(c);
  }
}

TEST(Diagnosis, ATargetThatStandsElsewhereThanWhenItsLengthsWereMeasuredIsNamed) {
  Cell cell = demo_cell();
  for (CertifiedLength& length : cell.lengths)
    if (length.from == "S2" || length.to == "S2") length.length_m += 0.8e-3;
  EXPECT_EQ(
      evidence(expect_cause(cell, good_touches(), LikelyCause::kLengthsOfTarget, "S2"), "lengths"),
      3.0);
}

TEST(Diagnosis, TwoWrongLengthsAreNotTakenForATargetThatMoved) {
  for (const auto& [a, b] : {std::pair{0u, 5u}, std::pair{0u, 3u}}) {
    SCOPED_TRACE(b);
    Cell cell = demo_cell();
    cell.lengths[a].length_m += 0.5e-3;
    cell.lengths[b].length_m += 0.5e-3;
    const Calibration c = withheld(cell, good_touches());
    const Finding moved = testing::the(c, FindingKind::kMovedTarget);
    const bool or_lengths = find(moved.evidence, "or_lengths") != nullptr;
    EXPECT_TRUE(moved.kind != FindingKind::kMovedTarget || or_lengths) << words_of(c);
    EXPECT_EQ(testing::cause(c, LikelyCause::kMoved).cause, std::nullopt) << words_of(c);
    // Two at one sphere can also resemble an error of its diameter.
    EXPECT_TRUE(
        or_lengths || found(c, FindingKind::kCertifiedLength) ||
        find(testing::cause(c, LikelyCause::kArtefactSize).evidence, "lengths") != nullptr ||
        testing::cause(c, LikelyCause::kCertifiedLength).cause == LikelyCause::kCertifiedLength)
        << words_of(c);
  }
}

TEST(Diagnosis, TwoCertifiedLengthsThatWereExchangedAreNamed) {
  Cell cell = demo_cell();
  std::swap(cell.lengths[0].length_m, cell.lengths[4].length_m);
  EXPECT_EQ(parts_of(expect_cause(cell, good_touches(), LikelyCause::kExchangedLengths)),
            "S1-S2 S2-S4");
}

TEST(Diagnosis, CertifiedLengthsInInchesOrMetresAreNamed) {
  for (const double mm : {25.4, 1000.0}) {
    SCOPED_TRACE(mm);
    Cell cell = demo_cell();
    for (CertifiedLength& length : cell.lengths) length.length_m /= mm;
    const Finding finding = expect_cause(cell, good_touches(), LikelyCause::kLengthsUnit);
    EXPECT_EQ(evidence(finding, "unit"), mm);
  }
}

TEST(Diagnosis, ALoneLengthThatContradictsTheArmIsNamed) {
  for (const double off_m : {0.01, 0.03}) {
    SCOPED_TRACE(off_m);
    Cell cell = demo_cell();
    cell.lengths.resize(1);
    cell.lengths[0].length_m += off_m;
    (void)expect_cause(cell, good_touches(), LikelyCause::kCertifiedLength, cell.lengths[0].from);
  }
}

TEST(Diagnosis, ATargetThatMovedOnTheWayIsNamedWithHowFar) {
  // The sphere was knocked by half a centimetre half-way through the session; its later touches are
  // at the new position.
  Cell cell = demo_cell();
  const sim::Truth truth = testing::plain_truth(cell, 5);
  sim::Truth later = truth;
  later.centre_m[1] += Eigen::Vector3d(0.004, 0.003, 0.0);
  const auto before = make_touches(cell, truth, {.fit = 80}).touches;
  const auto after = make_touches(cell, later, {.fit = 80}).touches;
  std::vector<Touch> both(before.begin(), before.begin() + 40);
  both.insert(both.end(), after.begin() + 40, after.end());
  const Calibration c = withheld(cell, both);
  EXPECT_EQ(testing::the(c, FindingKind::kMovedTarget).about.name, "S2") << words_of(c);
  EXPECT_NEAR(testing::the(c, FindingKind::kMovedTarget, "shift"), 4.98, 0.02) << words_of(c);
}

}  // namespace
}  // namespace cellcal::calib
