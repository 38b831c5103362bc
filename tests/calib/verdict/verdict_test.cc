// Reasons for withholding a result, one by one.

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "calib/estimate/region.h"
#include "calib/identify/identify.h"
#include "calib/identify/identify_once.h"
#include "calib/verdict/artefacts.h"
#include "calib/verdict/residuals.h"
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

std::vector<Touch> touches_of(const Cell& cell, int fit, unsigned seed) {
  return make_touches(cell, plain_truth(cell, seed), {.fit = fit, .seed = seed}).touches;
}

/// The demo cell's touches, with only ten of the last sphere, whose centre is not stated.
struct FewOfOne {
  Cell cell = demo_cell();
  std::vector<Touch> touches;
  std::vector<std::size_t> of_it;

  explicit FewOfOne(unsigned seed) {
    Target& last = cell.targets.back();
    last.has_centre = false;
    const std::string id = last.id;
    for (const Touch& touch : touches_of(demo_cell(), 120, seed)) {
      if (touch.target == id && of_it.size() == 10) continue;
      if (touch.target == id) of_it.push_back(touches.size());
      touches.push_back(touch);
    }
    std::erase_if(cell.lengths, [&](const CertifiedLength& length) {
      return length.from == id || length.to == id;
    });
  }
};

TEST(Verdict, OneTouchLeftOutWithholdsOnlyWhereHardlyAnyOthersOfItsTargetAreLeft) {
  const Cell& cell = demo_cell();
  const std::string id = cell.targets.back().id;
  for (const int own : {4, 5}) {
    std::vector<Touch> touches;
    int count = 0;
    for (const Touch& touch :
         make_touches(cell, plain_truth(cell, 3), {.fit = 80, .check = 10, .seed = 3}).touches) {
      if (touch.target == id && touch.set == TouchSet::kFit && ++count > own) continue;
      touches.push_back(touch);
      if (count == 2 && touch.target == id && touch.set == TouchSet::kFit)
        touches.back().joint_rad[0] += 0.02;  // centimetres
    }
    const Calibration c = identify(cell, touches);
    EXPECT_EQ(c.outliers.size(), 1u);
    EXPECT_EQ(c.verdict.publish(), own == 5) << words_of(c);
    const Finding outliers = the(c, FindingKind::kOutliersOfTarget);
    EXPECT_EQ(outliers.about.name == id && value(outliers.evidence, "touches") == 4.0, own == 4)
        << words_of(c);
  }
}

TEST(GrossErrors, AmongFewTouchesOfATargetAreNamedAndTheTargetIsAskedForAgain) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    FewOfOne few(seed);
    for (const std::size_t k : {1, 4})
      few.touches[few.of_it[k]].joint_rad[0] += 0.02;  // centimetres
    const Calibration c = identify(few.cell, few.touches);
    std::vector<std::size_t> named;
    for (const Outlier& outlier : c.outliers) named.push_back(outlier.touch);
    EXPECT_EQ(named, (std::vector<std::size_t>{few.of_it[1], few.of_it[4]})) << seed;
    EXPECT_FALSE(c.verdict.publish());
    const Finding outliers = the(c, FindingKind::kOutliersOfTarget);
    EXPECT_EQ(outliers.about.name, few.cell.targets.back().id) << words_of(c);
    EXPECT_EQ(value(outliers.evidence, "outliers"), 2.0) << words_of(c);
    EXPECT_EQ(value(outliers.evidence, "touches"), 10.0) << words_of(c);
  }
}

TEST(Verdict, OfAHandfulOfTouchesIsWithheldForRank) {
  const Calibration c = identify(one_sphere_cell(), touches_of(one_sphere_cell(), 6, 1));
  EXPECT_FALSE(c.verdict.publish());
  EXPECT_TRUE(found(c, FindingKind::kRank)) << words_of(c);
}

TEST(Verdict, NamesACertifiedLengthThatTheTouchesContradict) {
  Cell cell = demo_cell();
  const auto touches = touches_of(cell, 100, 2);
  ASSERT_TRUE(identify(cell, touches).verdict.publish());
  CertifiedLength twice = cell.lengths.front();
  twice.length_m += 0.5e-3;
  cell.lengths.push_back(twice);
  const Calibration c = identify(cell, touches);
  EXPECT_FALSE(c.verdict.publish());
  const Finding wrong = the(c, FindingKind::kCertifiedLength);
  EXPECT_EQ(wrong.about, about_length(twice.from, twice.to)) << words_of(c);
  EXPECT_NEAR(value(wrong.evidence, "certified"), twice.length_m * 1e3, 1e-6)
      << "the second of the two that cannot both be right is the wrong one\n"
      << words_of(c);
}

TEST(Verdict, LengthsThatAreRightAreNotContradicted) {
  double most = 0.0, squares = 0.0;
  int lengths = 0;
  for (unsigned seed = 1; seed <= 30; ++seed) {
    sim::TruthOptions truth;
    truth.seed = seed;
    truth.gear_arcsec = 20.0;
    const auto made =
        make_touches(demo_cell(), sim::draw_truth(demo_cell(), truth), {.fit = 80, .seed = seed});
    for (const LengthResult& length : identify(demo_cell(), made.touches).lengths) {
      most = std::max(most, contradiction(length));
      squares += std::pow(contradiction(length), 2);
      ++lengths;
    }
  }
  EXPECT_EQ(lengths, 180);
  EXPECT_LT(most, 4.0);
  EXPECT_LT(std::sqrt(squares / lengths), 1.1);
  EXPECT_GT(std::sqrt(squares / lengths), 0.5) << "sigmas that are too large hide what is wrong";
}

TEST(Verdict, ALengthDoesNotConfirmItself) {
  // Twice, the second time with exchanged ends; among all, and these two alone.
  for (const bool alone : {false, true}) {
    SCOPED_TRACE(alone);
    Cell cell = demo_cell();
    const auto touches = touches_of(cell, 100, 2);
    if (alone) cell.lengths.resize(1);
    CertifiedLength& first = cell.lengths.front();
    first.length_m += alone ? 0.02 : 0.5e-3;
    CertifiedLength again = first;
    std::swap(again.from, again.to);
    cell.lengths.push_back(again);
    const Calibration c = identify(cell, touches);
    EXPECT_FALSE(c.verdict.publish());
    EXPECT_TRUE(found(c, FindingKind::kLikelyCause)) << words_of(c);
  }
}

TEST(Verdict, ALengthIsNotBelievedForBeingCertifiedToNothing) {
  Cell cell = demo_cell();
  const auto touches = touches_of(cell, 100, 2);
  cell.lengths.resize(1);
  cell.lengths[0].length_m += 0.02;
  cell.lengths[0].sigma_m = 1e-9;
  const Calibration c = identify(cell, touches);
  ASSERT_EQ(c.lengths.size(), 1u);
  EXPECT_FALSE(c.verdict.publish()) << words_of(c);
}

TEST(Verdict, SaysThatNothingChecksALoneLength) {
  Cell cell = demo_cell();
  const auto touches = touches_of(cell, 100, 2);
  EXPECT_FALSE(found(identify(cell, touches), FindingKind::kUncheckedLength));
  cell.lengths.resize(2);
  EXPECT_FALSE(found(identify(cell, touches), FindingKind::kUncheckedLength));
  cell.lengths.resize(1);
  cell.lengths[0].length_m += 0.5e-3;
  for (const bool written_twice : {false, true}) {
    SCOPED_TRACE(written_twice);
    if (written_twice) cell.lengths.push_back(cell.lengths[0]);
    const Calibration c = identify(cell, touches);
    EXPECT_TRUE(c.verdict.publish()) << words_of(c);
    EXPECT_EQ(the(c, FindingKind::kUncheckedLength).about,
              about_length(cell.lengths[0].from, cell.lengths[0].to))
        << words_of(c);
    EXPECT_EQ(the(c, FindingKind::kScaleByLengths, "lengths"), 1.0) << words_of(c);
  }
}

TEST(Verdict, AFewFirstTouchesAreNotSaidToHoldTheScaleNorToHangOnOneCertificate) {
  const Calibration c = identify(demo_cell(), touches_of(demo_cell(), 8, 2));
  EXPECT_FALSE(c.verdict.publish());
  EXPECT_FALSE(c.verdict.workspace);
  EXPECT_FALSE(found(c, FindingKind::kScaleByLengths)) << words_of(c);
  EXPECT_FALSE(found(c, FindingKind::kUncheckedLength)) << words_of(c);
}

TEST(Verdict, WithholdsWhatIsForeseenToBeWorseThanAskedFor) {
  Cell cell = demo_cell();
  const auto touches = touches_of(cell, 60, 2);
  const Calibration usual = identify(cell, touches);
  EXPECT_TRUE(usual.verdict.publish()) << words_of(usual);
  EXPECT_EQ(the(usual, FindingKind::kGain, "required"), 2.0) << words_of(usual);
  EXPECT_EQ(the(usual, FindingKind::kGain, "required_is_stated"), 0.0) << words_of(usual);
  cell.required_m = 0.9 * usual.predicted_workspace_m;
  const Calibration withheld = identify(cell, touches);
  EXPECT_FALSE(withheld.verdict.publish());
  EXPECT_TRUE(found(withheld, FindingKind::kRequired)) << words_of(withheld);
  cell.required_m = 1.1 * usual.predicted_workspace_m;
  EXPECT_TRUE(identify(cell, touches).verdict.publish());
}

TEST(Verdict, WithholdsWhatIsHardlyBetterThanTheNominalArm) {
  Cell cell = demo_cell();
  const auto touches = touches_of(cell, 60, 2);
  for (Joint& joint : cell.robot.joints) {  // drawn and mastered to microns
    joint.tolerance_length_m = 1e-6;
    joint.tolerance_angle_rad = 1e-6;
  }
  cell.touch_sigma_m = 10e-3;
  const Calibration c = identify(cell, touches);
  EXPECT_FALSE(c.verdict.publish());
  EXPECT_TRUE(found(c, FindingKind::kNoGain)) << words_of(c);
}

TEST(Verdict, NamesTwoStatedCentresThatWereExchanged) {
  Cell cell = demo_cell();
  const auto touches = touches_of(cell, 100, 2);
  std::swap(cell.targets[0].centre_m, cell.targets[1].centre_m);
  const Calibration c = identify(cell, touches);
  const Finding exchanged = the(c, FindingKind::kExchangedCentres);
  ASSERT_EQ(exchanged.parts.size(), 2u) << words_of(c);
  EXPECT_EQ(exchanged.parts[0].about.name, "S1");
  EXPECT_EQ(exchanged.parts[1].about.name, "S2");
}

TEST(Verdict, BeforeIsWithTheToolWhereTheTouchesPutItAsFarAsTheCellFileLeavesItOpen) {
  Cell cell = demo_cell();
  const auto touches = touches_of(cell, 60, 2);
  const double known_m = identify_single_pass(cell, touches).before.mean_m;
  cell.tool.tcp.translation() += Eigen::Vector3d(4e-3, -4e-3, 3e-3);  // a guess
  cell.tool.tcp_sigma_m.setConstant(5e-3);
  const Calibration guessed = identify_single_pass(cell, touches);
  EXPECT_LT(guessed.before.mean_m, 1.3 * known_m);
  EXPECT_GT(guessed.before.mean_m, 2.0 * guessed.after.mean_m);
}

TEST(Verdict, ALengthThatWasMeasuredTwiceIsChecked) {
  Cell cell = demo_cell();
  const auto touches = touches_of(cell, 100, 2);
  cell.lengths.resize(1);
  CertifiedLength again = cell.lengths[0];
  std::swap(again.from, again.to);
  again.length_m += again.sigma_m;
  cell.lengths.push_back(again);
  const Calibration right = identify(cell, touches);
  EXPECT_TRUE(right.verdict.publish()) << words_of(right);
  EXPECT_FALSE(found(right, FindingKind::kUncheckedLength)) << words_of(right);
  EXPECT_FALSE(found(right, FindingKind::kUncheckedLengths)) << words_of(right);
  cell.lengths[1].length_m += 0.5e-3;
  const Calibration wrong = identify(cell, touches);
  EXPECT_FALSE(wrong.verdict.publish());
  EXPECT_TRUE(found(wrong, FindingKind::kCertifiedTwice)) << words_of(wrong);
}

TEST(Verdict, ACheckLengthIsComparedAndNeverFitted) {
  Cell cell = demo_cell();
  const auto touches = touches_of(cell, 100, 2);
  Cell without = cell;
  without.lengths.pop_back();
  const Calibration plain = identify(without, touches);
  cell.lengths.back().is_check = true;
  const Calibration c = identify(cell, touches);
  EXPECT_TRUE(c.verdict.publish()) << words_of(c);
  ASSERT_EQ(c.parameters.size(), plain.parameters.size());
  for (std::size_t i = 0; i < c.parameters.size(); ++i)
    EXPECT_NEAR(c.parameters[i].correction, plain.parameters[i].correction,
                1e-6 * plain.parameters[i].sigma)
        << i;
  ASSERT_EQ(c.lengths.size(), cell.lengths.size());
  const LengthResult& check = c.lengths.back();
  EXPECT_TRUE(check.is_check);
  EXPECT_EQ(check.certified_sigma_m, cell.lengths.back().sigma_m);
  EXPECT_LT(contradiction(check), 4.0);
  EXPECT_GT(check.sigma_m, 0.0);
  EXPECT_LT(check.sigma_m, 0.1e-3);
}

TEST(Verdict, ACheckLengthThatTheCalibratedArmDoesNotReproduceWithholds) {
  Cell cell = demo_cell();
  const auto touches = touches_of(cell, 100, 2);
  cell.lengths.back().is_check = true;
  const LengthResult right = identify(cell, touches).lengths.back();
  cell.lengths.back().length_m += 0.5e-3;
  const Calibration c = identify(cell, touches);
  EXPECT_FALSE(c.verdict.publish());
  EXPECT_EQ(the(c, FindingKind::kCertifiedLength).about.name, cell.lengths.back().from)
      << words_of(c);
  EXPECT_NEAR(c.lengths.back().by_others_m, right.by_others_m, 1e-7) << "it is not fitted";
}

TEST(Verdict, CheckLengthsAloneDoNotHoldTheScale) {
  Cell cell = demo_cell();
  for (CertifiedLength& one : cell.lengths) one.is_check = true;
  const Calibration c = identify(cell, touches_of(demo_cell(), 100, 2));
  EXPECT_FALSE(c.verdict.workspace) << words_of(c);
  EXPECT_EQ(c.lengths.size(), cell.lengths.size());
}

TEST(Verdict, AWrongLengthDoesNotHideInTheScatterThatItMakes) {
  Cell cell = demo_cell();
  const auto touches = touches_of(cell, 48, 2);
  ASSERT_TRUE(identify(cell, touches).verdict.publish());
  cell.lengths[0].length_m += 1e-3;
  const Calibration c = identify(cell, touches);
  EXPECT_FALSE(c.verdict.publish());
  EXPECT_TRUE(found(c, FindingKind::kCertifiedLength)) << words_of(c);
}

TEST(Verdict, ClaimsTheWorkspaceOnlyOfLengthsThatAreCertain) {
  Cell cell = demo_cell();
  const auto touches = touches_of(cell, 100, 3);
  EXPECT_TRUE(identify(cell, touches).verdict.workspace);
  for (CertifiedLength& length : cell.lengths) length.sigma_m = 5e-3;
  const Calibration c = identify(cell, touches);
  EXPECT_FALSE(c.verdict.workspace);
  EXPECT_GT(the(c, FindingKind::kScaleByNothing, "lengths_with_held_ends"), 0.0) << words_of(c);
}

TEST(Verdict, TouchesThatAreOthersAgainToTheLastDigitAreNotCountedTwice) {
  const Cell& cell = demo_cell();
  const auto once = touches_of(cell, 100, 3);
  auto twice = once;
  twice.insert(twice.end(), once.begin(), once.end());
  const Calibration c = identify(cell, twice);
  EXPECT_FALSE(c.verdict.publish());
  const Finding copies = the(c, FindingKind::kDuplicateTouches);
  EXPECT_EQ(value(copies.evidence, "duplicates"), 100.0) << words_of(c);
  ASSERT_EQ(copies.parts.size(), 2u);
  EXPECT_EQ(copies.parts[0].about.touch, 100u);
  EXPECT_EQ(copies.parts[1].about.touch, 0u);
  // Measured again, once by chance with the same digits.
  auto again = once;
  again.push_back(once.front());
  EXPECT_TRUE(identify(cell, again).verdict.publish());
  // Nor are repeated touches with angles rounded to hundredths copies.
  constexpr double kStepRad = 0.01 * std::numbers::pi / 180.0;
  auto rounded = once;
  std::mt19937 random(1);
  std::normal_distribution<double> search(0.0, 0.2 * kStepRad);
  for (int lap = 1; lap < 3; ++lap)
    for (Touch touch : once) {
      for (double& angle : touch.joint_rad) angle += search(random);
      rounded.push_back(touch);
    }
  for (Touch& touch : rounded)
    for (double& angle : touch.joint_rad) angle = std::round(angle / kStepRad) * kStepRad;
  EXPECT_FALSE(found(identify(cell, rounded), FindingKind::kDuplicateTouches));
  // Unless all of them recur in the same order.
  std::copy_n(rounded.begin(), 100, rounded.begin() + 100);
  EXPECT_TRUE(found(identify(cell, rounded), FindingKind::kDuplicateTouches));
  // Copies do not test the fit either.
  auto held_out = once;
  for (std::size_t i = 0; i < 20; ++i) {
    held_out.push_back(once[i]);
    held_out.back().set = TouchSet::kCheck;
  }
  EXPECT_EQ(the(identify(cell, held_out), FindingKind::kDuplicateTouches, "duplicates"), 20.0);
}

TEST(Verdict, VisitsReadWithFewDigitsAreNoCopies) {
  const Cell cell = tracker_cell();
  const sim::Truth truth = plain_truth(demo_cell(), 3);
  const auto postures = workspace_poses(ArmModel(cell), 60, 7);
  std::mt19937 random(1);
  std::normal_distribution<double> scatter(0.0, 0.02e-3);
  std::vector<Touch> touches;
  for (int lap = 0; lap < 3; ++lap)
    for (const JointVector& q : postures) {
      Touch& touch = touches.emplace_back();
      touch.target = "T1";
      touch.joint_rad = q;
      const Eigen::Vector3d tip = truth.arm.position(truth.arm.prepare(q), truth.errors.data());
      for (int axis = 0; axis < 3; ++axis)
        touch.tracker_m[axis] = std::round((tip[axis] + scatter(random)) * 1e4) / 1e4;
    }
  EXPECT_FALSE(duplicate_touches(touches));
  // Unless they recur in the same order, or with digits that no visit has again.
  auto pasted = touches;
  pasted.insert(pasted.end(), touches.begin(), touches.end());
  EXPECT_TRUE(duplicate_touches(pasted));
  for (std::size_t i = 60; i < 180; ++i) {
    std::ranges::copy(touches[i - 60].tracker_m, touches[i].tracker_m);
    if (i % 4 == 0) touches[i].tracker_m[0] += 1e-5;
  }
  EXPECT_FALSE(duplicate_touches(touches));
  for (Touch& touch : touches) touch.tracker_m[2] += 3e-6;
  EXPECT_TRUE(duplicate_touches(touches));
}

TEST(Verdict, ASessionPastedAgainWithFewerDigitsIsNotCountedTwice) {
  const Cell& cell = demo_cell();
  for (const double step_deg : {1e-3, 1e-4, 1e-5}) {
    const double step_rad = step_deg * std::numbers::pi / 180.0;
    auto twice = touches_of(cell, 100, 3);
    for (std::size_t i = 0; i < 100; ++i) {
      twice.push_back(twice[i]);
      for (double& angle : twice.back().joint_rad) angle = std::round(angle / step_rad) * step_rad;
    }
    const Calibration c = identify(cell, twice);
    EXPECT_FALSE(c.verdict.publish()) << step_deg;
    EXPECT_EQ(the(c, FindingKind::kDuplicateTouches, "duplicates"), 100.0) << words_of(c);
    EXPECT_EQ(c.repeats.degrees_of_freedom, 0.0) << "rounding is no noise";
  }
}

TEST(Verdict, SaysThatATargetStandsElsewhereThanStated) {
  Cell cell = demo_cell();
  const auto touches = touches_of(cell, 100, 3);
  cell.targets[1].centre_m.x() += 0.1;
  cell.targets[1].centre_sigma_m = 0.01;
  const Calibration c = identify(cell, touches);
  const Finding far = the(c, FindingKind::kStatedCentre);
  ASSERT_EQ(far.parts.size(), 1u) << words_of(c);
  EXPECT_EQ(far.parts[0].about.name, "S2");
}

TEST(Verdict, NamesTargetsThatWereNotTouched) {
  const Cell& cell = demo_cell();
  auto touches = touches_of(cell, 120, 3);
  EXPECT_FALSE(found(identify(cell, touches), FindingKind::kNotTouched));
  std::erase_if(touches, [](const Touch& touch) { return touch.target == "S4"; });
  const Calibration c = identify(cell, touches);
  EXPECT_TRUE(c.verdict.publish()) << words_of(c);
  const Finding untouched = the(c, FindingKind::kNotTouched);
  ASSERT_EQ(untouched.parts.size(), 1u) << words_of(c);
  EXPECT_EQ(untouched.parts[0].about.name, "S4");
  EXPECT_EQ(value(untouched.evidence, "idle_lengths"), 3.0);
}

TEST(Verdict, NamesASignOfGravityThatIsWrong) {
  Cell cell = demo_cell();
  const sim::Truth truth = plain_truth(cell, 4);
  const auto touches = make_touches(cell, truth, {.fit = 120, .seed = 4}).touches;
  const Calibration right = identify(cell, touches);
  cell.robot.gravity_m_s2 *= -1.0;
  const Calibration c = identify(cell, touches);
  const double bending =
      std::abs(testing::true_value(truth, tool_parameter(ParameterKind::kDeflection, 0)));
  EXPECT_TRUE(right.verdict.publish()) << words_of(right);
  ASSERT_GT(bending, 1e-3) << "this arm's tool hardly bends; take another";
  EXPECT_FALSE(c.verdict.publish());
  EXPECT_EQ(the(c, FindingKind::kNegativeCompliance).about,
            about_parameter(c.cell, tool_parameter(ParameterKind::kDeflection, 0)))
      << words_of(c);
}

}  // namespace
}  // namespace cellcal::calib
