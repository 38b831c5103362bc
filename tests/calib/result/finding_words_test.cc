// Sentences of findings; tested here only.

#include <gtest/gtest.h>

#include <vector>

#include "calib/result/calibration.h"
#include "calib/result/finding.h"
#include "tests/calib/result/target.h"

namespace cellcal::calib {
namespace {

using testing::target;

Subject touch(std::size_t index, int line, const std::string& of, const std::string& lies_on = {}) {
  Touch one;
  one.target = of;
  one.line = line;
  Subject subject = about_touch(index, one);
  subject.other_end = lies_on;
  return subject;
}

std::string said(FindingKind kind, const Subject& about, const std::vector<Quantity>& evidence,
                 const std::vector<FindingPart>& parts = {}, const std::string& text = {},
                 Severity severity = Severity::kWithholds) {
  return words(Finding{kind, severity, about, evidence, parts, text});
}

TEST(FindingNames, AreReadBackAsTheyAreWritten) {
  for (int k = 0; k <= static_cast<int>(FindingKind::kRecorded); ++k) {
    const auto kind = static_cast<FindingKind>(k);
    EXPECT_STRNE(to_string(kind), "") << k;
    EXPECT_EQ(by_own_name<FindingKind>(to_string(kind)), kind) << k;
  }
  EXPECT_FALSE(by_own_name<FindingKind>("chi^2"));
  for (const Severity one : {Severity::kWithholds, Severity::kWarns, Severity::kInforms})
    EXPECT_EQ(by_own_name<Severity>(to_string(one)), one);
  for (int k = 0; k <= static_cast<int>(Subject::Of::kRobot); ++k)
    EXPECT_EQ(by_own_name<Subject::Of>(to_string(static_cast<Subject::Of>(k))),
              static_cast<Subject::Of>(k));
}

TEST(FindingWords, AreASentenceForEveryKindWhateverItsEvidence) {
  for (int k = 0; k < static_cast<int>(FindingKind::kRecorded); ++k) {
    Finding bare;
    bare.kind = static_cast<FindingKind>(k);
    bare.text = "text";
    EXPECT_FALSE(sentence(bare).empty()) << to_string(bare.kind);
    EXPECT_TRUE(words(bare).ends_with(sentence(bare))) << to_string(bare.kind);
  }
}

TEST(FindingWords, OfJointsThatWereNeverTurned) {
  EXPECT_EQ(
      said(FindingKind::kScopeOfTouches, {}, {{"predicted", 0.25, "mm"}},
           {{about_joint("A4"), {}}, {about_joint("A6"), {}}}),
      "scope: A4, A6: at one angle in most touches; the result is valid near the touched places only "
      "(0.250 mm). Touch with all joints turned to extend it");
}

TEST(FindingWords, OfTouches) {
  EXPECT_EQ(
      said(FindingKind::kTouchScatter, {},
           {{"scatter", 0.2, "mm"}, {"ratio", 4.0, ""}, {"stated", 0.05, "mm"}}),
      "touch scatter (chi^2): 0.200 mm, 0.050 mm stated by sigma_mm in the cell file; chi^2/dof "
      "16.0. State the measured repeatability in sigma_mm, not the residual of the fit: touch five "
      "places four times each to measure it");
  EXPECT_EQ(
      said(FindingKind::kUncheckedTouch, touch(4, 6, "S1"),
           {{"unseen", 3.0, "mm"}, {"shift", 2.14, "mm"}, {"predicted", 0.2, "mm"}}),
      "unchecked touch: errors below 3.0 mm of touch 5 (line 6) of S1 are not detectable, and "
      "would shift the TCP by up to 2.14 mm (predicted error 0.20 mm). Calibrate with more "
      "touches");
  EXPECT_EQ(
      said(FindingKind::kDuplicateTouches, {}, {{"duplicates", 100.0, ""}, {"touches", 200.0, ""}},
           {{touch(100, 102, "S1"), {}}, {touch(0, 2, "S1"), {}}}),
      "duplicate touches: 100 of 200 touches equal others to the last digit (touch 101 (line "
      "102) is touch 1 (line 2)); a file may have been pasted twice. Leave them out");
  EXPECT_EQ(said(FindingKind::kOutliersOfTarget, about_target(target("P", TargetKind::kPoint)),
                 {{"outliers", 2.0, ""}, {"touches", 10.0, ""}}),
            "outliers: 2 of 10 fit touches of P are outliers; the others are too few to determine "
            "its place. Check that the tip seats in it and touch it again");
  EXPECT_EQ(said(FindingKind::kCheckTouches, {}, {{"rms", 0.5, "mm"}, {"ratio", 3.2, ""}},
                 {{touch(4, 0, "S1", "S2"), {}}}),
            "check touches: 0.500 mm rms at held-out touches, 3.2 times the predicted error. "
            "touch 5 of S1 lies on S2: correct its target");
  const FindingPart off{touch(4, 0, "S1"), {{"off", 1.2, "mm"}}};
  EXPECT_EQ(
      said(FindingKind::kGrossCheckTouches, {}, {}, {off, off, off, off}, {}, Severity::kWarns),
      "gross check touches: touch 5 of S1 1.20 mm off, touch 5 of S1 1.20 mm off, touch 5 of "
      "S1 1.20 mm off, and 1 more. Left out of the verdict");
  const auto not_judged = [](const Target& of, const std::vector<Quantity>& evidence) {
    return said(FindingKind::kUnseenNotJudged, about_target(of), evidence);
  };
  EXPECT_EQ(not_judged(target("S4"), {{"touches", 4.0, ""}, {"place_alone", 1.0, ""}}),
            "not judged: S4, which has no fit touch: 4 check touches hold its place and little "
            "more; touch it more often, or make some of them fit touches");
  EXPECT_EQ(not_judged(target("S4"), {{"touches", 1.0, ""}, {"no_place", 1.0, ""}}),
            "not judged: S4, which has no fit touch: 1 check touch does not determine its place. "
            "Touch it from more sides, or add centre_mm to the cell file");
  EXPECT_EQ(not_judged(target("P", TargetKind::kPlane),
                       {{"touches", 3.0, ""}, {"other_normal", 1.0, ""}}),
            "not judged: P, which has no fit touch: normal of the touched plane far off the stated "
            "one. Check its normal in the cell file");
  EXPECT_EQ(
      not_judged(target("T", TargetKind::kTracker), {{"touches", 3.0, ""}, {"unusable", 1.0, ""}}),
      "not judged: T, which has no fit touch: a reading is not a number. Leave it out");
  EXPECT_EQ(
      said(FindingKind::kControllerModel, about_robot("", "KR 5"),
           {{"difference", 12.3, "mm"}, {"postures", 40.0, ""}}, {}, "A1 0.0, A2 -90.0 deg",
           Severity::kWarns),
      "controller's model: 12.30 mm from the robot file at A1 0.0, A2 -90.0 deg, over 40 "
      "postures with $TOOL and $BASE estimated: another robot type, or absolute accuracy is "
      "active ($ABS_ACCUR). Compare the type plate with the robot file. The calibration holds "
      "for joint angles; 'cellcal correct' refuses programs");
  EXPECT_EQ(said(FindingKind::kTemperature, {},
                 {{"coldest", -1.2, "degrees C"},
                  {"hottest", 21.5, "degrees C"},
                  {"stated", 2.0, ""},
                  {"touches", 4.0, ""}}),
            "temperature: -1.2 to 21.5 degrees C at 2 of 4 touches. No model corrects for it; 10 K "
            "make 0.1 to 0.2 mm per metre");
  EXPECT_EQ(said(FindingKind::kTooFewDirections, about_target(target("W", TargetKind::kWire)),
                 {{"touches", 1.0, ""}}),
            "too few directions: W: 1 reading from too few directions. Measure from more sides");
  EXPECT_EQ(said(FindingKind::kNotTouched, {}, {{"idle_lengths", 1.0, ""}},
                 {{about_target(target("S4")), {}}}),
            "not touched: S4 of the cell file; 1 certified length there is unused");
}

TEST(FindingWords, OfWhatTheFilesState) {
  EXPECT_EQ(said(FindingKind::kCertifiedLength, about_length("S1", "S2"),
                 {{"certified", 400.0, "mm", 0.01},
                  {"measured", 400.1, "mm", 0.01},
                  {"apart", 7.0, "sigma"},
                  {"others", 0.0, ""}}),
            "certified length S1-S2: 400.000 mm stated, 400.100 ± 0.010 mm measured (7 sigma). "
            "Measure it again, or check that neither target was moved");
  EXPECT_EQ(said(FindingKind::kCertifiedTwice, about_length("S1", "S2"),
                 {{"certified", 400.0, "mm"}, {"certified_again", 400.5, "mm"}}),
            "certified length S1-S2: 400.000 mm and 400.500 mm stated, one of them is wrong. "
            "Leave it out");
  EXPECT_EQ(said(FindingKind::kArtefactSize, about_target(target("S2")),
                 {{"stated", 61.4, "mm"}, {"measured", 61.8, "mm", 0.02}, {"apart", 9.0, "sigma"}}),
            "diameter of S2: 61.400 mm stated, 61.80 ± 0.02 mm measured (9 sigma). "
            "Check diameter_mm, and clean it");
  EXPECT_EQ(
      said(FindingKind::kArtefactSize, {}, {{"longer", -0.4, "mm", 0.05}, {"apart", 8.0, "sigma"}}),
      "all wires: readings 0.40 ± 0.05 mm too long (8 sigma). Check where the wire reads zero");
  Subject a4_theta;
  a4_theta.of = Subject::Of::kParameter;
  a4_theta.name = "A4.theta";
  EXPECT_EQ(said(FindingKind::kOffNominal, {}, {{"may_be_so", 1.0, ""}},
                 {{a4_theta, {{"off", 1.1, "deg"}, {"tolerances", 22.0, ""}}}}),
            "far from nominal: A4.theta off by 1.1 deg (22 tolerances). Check robot file and "
            "tool, and whether the arm is mastered; if all are right, state a larger tolerance");
  EXPECT_EQ(said(FindingKind::kEffectiveRadius, {}, {{"off", -1.5, "mm"}, {"apart", 5.0, "sigma"}},
                 {}, {}, Severity::kWarns),
            "radius offset: -1.50 mm off (5.0 times radius_offset_sigma_mm), as if all diameters "
            "were 3.0 mm smaller than stated. Check diameter_mm and tip_radius_mm");
}

TEST(FindingWords, OfScopeAndAccuracy) {
  EXPECT_EQ(
      said(FindingKind::kScaleByLengths, {}, {{"lengths", 6.0, ""}, {"unseen", 0.62, "%"}}),
      "scope: 6 certified lengths hold the scale, touched at both ends; an error common to all "
      "is detectable above 0.62 %");
  EXPECT_EQ(
      sentence({FindingKind::kScaleByLengths, Severity::kInforms, {}, {{"lengths", 1.0, ""}}}),
      "1 certified length holds the scale, touched at both ends");
  EXPECT_EQ(said(FindingKind::kUncheckedLength, about_length("S1", "S2"),
                 {{"unseen", 1.5, "mm"}, {"certified", 700.0, "mm"}}),
            "unchecked scale: errors below 1.5 mm of certified length S1-S2 (700.000 mm) are not "
            "detectable, and scale all lengths of the arm. Certify a second length between touched "
            "targets, or have this one measured again");
  const std::vector<Quantity> foreseen = {{"predicted", 0.13, "mm"},       {"nominal", 4.5, "mm"},
                                          {"nominal_u", 0.12, "mm"},       {"of_nominal", 2.9, "%"},
                                          {"most_of_nominal", 80.0, "%"},  {"required", 2.0, "mm"},
                                          {"required_is_stated", 0.0, ""}, {"workspace", 1.0, ""}};
  EXPECT_EQ(
      said(FindingKind::kGain, {}, foreseen),
      "accuracy: 0.130 mm predicted over the workspace, 4.500 ± 0.120 mm (k=2) with the nominal arm (2.9 %); 2.000 mm "
      "allowed (required_mm not stated)");
  EXPECT_TRUE(said(FindingKind::kRequired, {},
                   {{"predicted", 0.10632, "mm"},
                    {"required", 0.1063, "mm"},
                    {"required_is_stated", 1.0, ""},
                    {"workspace", 1.0, ""}})
                  .find("0.10632 mm predicted over the workspace, 0.10630 mm required") !=
              std::string::npos)
      << "the reason shows";
  EXPECT_EQ(
      said(FindingKind::kModelError, {},
           {{"sigma", 0.1, "mm"}, {"estimated", 0.0, ""}, {"scatter", 0.2, "mm"}}),
      "model error: 0.100 mm in every bound: touch scatter 0.200 mm, no repeated touches. Touch "
      "five places four times each: the scatter of repeated touches is noise and is left out of "
      "the bounds");
  EXPECT_EQ(said(FindingKind::kModelError, {},
                 {{"sigma", 0.05, "mm"},
                  {"estimated", 1.0, ""},
                  {"noise", 0.03, "mm"},
                  {"stated", 0.02, "mm"},
                  {"reach", 20.0, "deg"}}),
            "model error: 0.050 mm (1 sigma per direction) in every bound, touch noise 0.030 mm, "
            "correlation length 20 deg of the main axes. More touches do not reduce it. Touch five "
            "places four times each, and state the measured repeatability in sigma_mm (0.020 mm "
            "stated)");
  EXPECT_EQ(said(FindingKind::kArmScale, {}, {{"off", 0.3, "%", 0.05}, {"apart", 6.0, "sigma"}}),
            "scale: all lengths of the arm +0.30 % from nominal, 6 times the tolerance of 0.05 %. "
            "Check what holds the scale: certified lengths, readings of trackers and wires, "
            "diameters");
}

TEST(FindingWords, OfUpdates) {
  const std::vector<Quantity> shift = {{"shift", 1.3, "mm", 0.02},
                                       {"probability", 99.0, "%"},
                                       {"touches", 8.0, ""},
                                       {"reached", 0.12, "mm"},
                                       {"before", 0.11, "mm"}};
  EXPECT_EQ(
      said(FindingKind::kUpdated, about_tool("tool"), shift, {}, "session 1"),
      "updated: tool shifted by 1.30 ± 0.04 mm (k=2), probability 99.0 %, 8 touches on top "
      "of session 1; 0.120 mm predicted over the workspace, 0.110 mm before the change. Check "
      "the tool's fastening");
  const FindingPart sphere{about_target(target("S2")), {{"shift", 2.0, "mm", 0.05}}};
  EXPECT_EQ(said(FindingKind::kUpdateContradicted, about_tool("tool"), shift, {sphere}),
            "not updated: more than one change found (8 touches): tool shifted by 1.30 ± 0.04 mm "
            "(k=2); next likely: S2 moved by 2.00 ± 0.10 mm (k=2). Run a full session: 'cellcal "
            "run --cell CELL'");
  EXPECT_EQ(said(FindingKind::kUpdateNotResolved, about_tool("tool"), shift),
            "not updated: tool shifted by 1.30 ± 0.04 mm (k=2), probability 99.0 %, 8 touches: not "
            "resolved; 0.120 mm predicted over the workspace, 0.110 mm before the change. Run a "
            "full session: 'cellcal run --cell CELL'");
}

TEST(FindingWords, OfWhatWentWrong) {
  Touch one;
  one.line = 13;
  const std::vector<Quantity> shift = {
      {"shift", 0.52, "mm", 0.03}, {"x", 0.1, "mm"}, {"y", -0.5, "mm"}, {"z", 0.1, "mm"}};
  EXPECT_EQ(said(FindingKind::kMovedTarget, after(about_target(target("S2")), 11, one), shift),
            "moved target: S2 moved by 0.52 ± 0.03 mm (+0.10, -0.50, +0.10) after touch 12 (line "
            "13). Clamp it and calibrate again");
  std::vector<Quantity> by_time = shift;
  by_time.push_back({"rank", 3.0, ""});
  EXPECT_EQ(said(FindingKind::kMovedTarget, after(about_target(target("S2")), 11, one), by_time),
            "moved target: S2 moved by 0.52 ± 0.03 mm (+0.10, -0.50, +0.10) after touch 3 in time "
            "(row 12, line 13). Clamp it and calibrate again");
  std::vector<Quantity> or_lengths = shift;
  or_lengths.push_back({"or_lengths", 1.0, ""});
  EXPECT_EQ(said(FindingKind::kMovedTarget, after(about_target(target("S2")), 11, one), or_lengths),
            "moved target or wrong certified length: S2 moved by 0.52 ± 0.03 mm (+0.10, -0.50, "
            "+0.10) after touch 12 (line 13). Clamp it and calibrate again. Or correct the "
            "certified lengths: without them the change is not significant");
  const FindingPart slipped{after(about_joint("A3"), 49, {}), {{"turn", 0.05, "deg", 0.004}}};
  const FindingPart knocked{after(about_tool("tool"), 49, {}), shift};
  EXPECT_EQ(said(FindingKind::kJumped, {}, {{"touches", 100.0, ""}}, {slipped}),
            "slipped joint: zero of A3 jumped by +0.050 ± 0.004 deg after about touch 50 of 100. "
            "Check belt, coupling and brake, master the joint and calibrate again");
  EXPECT_EQ(said(FindingKind::kJumped, {}, {{"touches", 100.0, ""}}, {knocked}),
            "knocked tool: tool tip moved by 0.52 ± 0.03 mm (+0.10, -0.50, +0.10) in the flange "
            "frame after about touch 50 of 100. Check its fastening and calibrate again");
  EXPECT_EQ(
      said(FindingKind::kJumped, {}, {{"touches", 100.0, ""}}, {slipped, knocked}),
      "change during the session: 100 touches fit more than one cause: zero of A3 jumped by "
      "+0.050 ± 0.004 deg after about touch 50, or tool tip moved by 0.52 ± 0.03 mm (+0.10, "
      "-0.50, +0.10) in the flange frame after about touch 50. Check each, then calibrate again");
  EXPECT_EQ(
      said(FindingKind::kChangeAccepted, {},
           {{"apart", 1.5, "mm"},
            {"expected", 0.25, "mm"},
            {"ratio", 6.0, ""},
            {"workspace", 1.0, ""}},
           {}, "session 7"),
      "since the last calibration: 1.500 mm mean TCP change since session 7, over the workspace "
      "(expected 0.250 mm, ratio 6.0); change accepted");
  EXPECT_EQ(said(FindingKind::kRecorded, {}, {}, {}, "as it was written"), "as it was written");
}

}  // namespace
}  // namespace cellcal::calib
