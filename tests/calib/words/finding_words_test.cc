// The sentences that a user reads, all in one place; no other test looks into them.

#include "calib/words/finding_words.h"

#include <gtest/gtest.h>

#include <vector>

namespace cellcal::calib {
namespace {

Target target(const std::string& id, TargetKind kind = TargetKind::kSphere) {
  Target one;
  one.id = id;
  one.kind = kind;
  return one;
}

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
    EXPECT_EQ(finding_kind(to_string(kind)), kind) << k;
  }
  EXPECT_FALSE(finding_kind("chi^2"));
  for (const Severity one : {Severity::kWithholds, Severity::kWarns, Severity::kInforms})
    EXPECT_EQ(severity(to_string(one)), one);
  for (int k = 0; k <= static_cast<int>(Subject::Of::kRobot); ++k)
    EXPECT_EQ(subject_of(to_string(static_cast<Subject::Of>(k))), static_cast<Subject::Of>(k));
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

TEST(FindingWords, OfTouches) {
  EXPECT_EQ(
      said(FindingKind::kTouchScatter, {},
           {{"scatter", 0.2, "mm"}, {"ratio", 4.0, ""}, {"stated", 0.05, "mm"}}),
      "touch scatter (chi^2): 0.200 mm, 4.0 times the 0.050 mm that the cell file states "
      "(sigma_mm). State what the instrument repeats to, not what the fit leaves; five places "
      "touched four times each measure it");
  EXPECT_EQ(
      said(FindingKind::kDuplicateTouches, {}, {{"duplicates", 100.0, ""}, {"touches", 200.0, ""}},
           {{touch(100, 102, "S1"), {}}, {touch(0, 2, "S1"), {}}}),
      "duplicate touches: 100 of 200 touches repeat others to the last digit (touch 101 (line "
      "102) is touch 1 (line 2)), as in a file that was pasted twice. Leave them out");
  EXPECT_EQ(said(FindingKind::kOutliersOfTarget, about_target(target("P", TargetKind::kPoint)),
                 {{"outliers", 2.0, ""}, {"touches", 10.0, ""}}),
            "outliers: 2 of 10 fit touches of P do not fit it, and the others are too few to hold "
            "its place. Check that the tip seats in it and touch it again");
  EXPECT_EQ(said(FindingKind::kCheckTouches, {}, {{"rms", 0.5, "mm"}, {"ratio", 3.2, ""}},
                 {{touch(4, 0, "S1", "S2"), {}}}),
            "check touches: 0.500 mm rms at held-out touches, 3.2 times what the calibration "
            "predicts for them. touch 5 of S1 lies on S2: correct its target");
  const FindingPart off{touch(4, 0, "S1"), {{"off", 1.2, "mm"}}};
  EXPECT_EQ(
      said(FindingKind::kGrossCheckTouches, {}, {}, {off, off, off, off}, {}, Severity::kWarns),
      "gross check touches: touch 5 of S1 1.20 mm off, touch 5 of S1 1.20 mm off, touch 5 of "
      "S1 1.20 mm off, and 1 more; judged without");
  EXPECT_EQ(said(FindingKind::kTemperature, {},
                 {{"coldest", -1.2, "degrees C"},
                  {"hottest", 21.5, "degrees C"},
                  {"stated", 2.0, ""},
                  {"touches", 4.0, ""}}),
            "temperature: -1.2 to 21.5 degrees C at 2 of 4 touches. No model corrects for it; 10 K "
            "make 0.1 to 0.2 mm per metre");
  EXPECT_EQ(
      said(FindingKind::kTooFewDirections, about_target(target("W", TargetKind::kWire)),
           {{"touches", 1.0, ""}}),
      "too few directions: W was pulled 1 time in directions too much alike. Measure from more "
      "sides");
  EXPECT_EQ(said(FindingKind::kNotTouched, {}, {{"idle_lengths", 1.0, ""}},
                 {{about_target(target("S4")), {}}}),
            "not touched: S4 of the cell file; 1 certified length ends there and holds nothing");
}

TEST(FindingWords, OfWhatTheFilesState) {
  EXPECT_EQ(said(FindingKind::kCertifiedLength, about_length("S1", "S2"),
                 {{"certified", 400.0, "mm", 0.01},
                  {"measured", 400.1, "mm", 0.01},
                  {"apart", 7.0, "sigma"},
                  {"others", 0.0, ""}}),
            "certified length S1-S2: 400.000 mm stated, 400.100 +- 0.010 mm measured (7 sigma). "
            "Measure it again, or check that neither target was moved");
  EXPECT_EQ(
      said(FindingKind::kCertifiedTwice, about_length("S1", "S2"),
           {{"certified", 400.0, "mm"}, {"certified_again", 400.5, "mm"}}),
      "certified length S1-S2: 400.000 mm stated, and 400.500 mm; both cannot be right. Leave "
      "the wrong one out");
  EXPECT_EQ(said(FindingKind::kArtefactSize, about_target(target("S2")),
                 {{"stated", 61.4, "mm"}, {"measured", 61.8, "mm", 0.02}, {"apart", 9.0, "sigma"}}),
            "diameter of S2: 61.400 mm stated, 61.80 +- 0.02 mm measured (9 sigma). Check "
            "diameter_mm, and that it is clean");
  EXPECT_EQ(
      said(FindingKind::kArtefactSize, {}, {{"longer", -0.4, "mm", 0.05}, {"apart", 8.0, "sigma"}}),
      "all wires: readings -0.40 +- 0.05 mm longer than stated (8 sigma). Check where the wire "
      "reads zero");
  Subject a4_theta;
  a4_theta.of = Subject::Of::kParameter;
  a4_theta.name = "A4.theta";
  EXPECT_EQ(said(FindingKind::kOffNominal, {}, {{"may_be_so", 1.0, ""}},
                 {{a4_theta, {{"off", 1.1, "deg"}, {"tolerances", 22.0, ""}}}}),
            "far from the drawing: A4.theta off by 1.1 deg (22 tolerances). Check robot file and "
            "tool, and whether the arm is mastered; if all are right, state a larger tolerance");
  EXPECT_EQ(said(FindingKind::kEffectiveRadius, {}, {{"off", -1.5, "mm"}, {"apart", 5.0, "sigma"}},
                 {}, {}, Severity::kWarns),
            "radius offset: -1.50 mm off (5.0 times radius_offset_sigma_mm), as if all diameters "
            "were 3.0 mm smaller than stated. Check diameter_mm and tip_radius_mm");
}

TEST(FindingWords, OfScopeAndAccuracy) {
  EXPECT_EQ(said(FindingKind::kScaleByLengths, {}, {{"lengths", 6.0, ""}, {"unseen", 0.62, "%"}}),
            "scope: 6 certified lengths hold the scale, touched at both ends; an error that all of "
            "them share would be noticed from 0.62 % on");
  EXPECT_EQ(
      sentence({FindingKind::kScaleByLengths, Severity::kInforms, {}, {{"lengths", 1.0, ""}}}),
      "1 certified length holds the scale, touched at both ends");
  EXPECT_EQ(
      said(FindingKind::kUncheckedLength, about_length("S1", "S2"),
           {{"unseen", 1.5, "mm"}, {"certified", 700.0, "mm"}}),
      "unchecked scale: an error below 1.5 mm of the certified length S1-S2 (700.000 mm) would "
      "not be noticed, and all lengths of the arm would be wrong in proportion. Certify a "
      "second length between touched targets, or have this one measured again");
  const std::vector<Quantity> foreseen = {
      {"predicted", 0.13, "mm"},      {"nominal", 4.5, "mm"},  {"of_nominal", 2.9, "%"},
      {"most_of_nominal", 80.0, "%"}, {"required", 2.0, "mm"}, {"required_is_stated", 0.0, ""},
      {"workspace", 1.0, ""}};
  EXPECT_EQ(
      said(FindingKind::kGain, {}, foreseen),
      "accuracy: 0.13 mm predicted over the workspace, 4.50 mm with the nominal arm (3 %); 2.00 mm "
      "allowed (required_mm not stated)");
  EXPECT_EQ(
      said(FindingKind::kModelError, {},
           {{"sigma", 0.1, "mm"}, {"estimated", 0.0, ""}, {"scatter", 0.2, "mm"}}),
      "model error: 0.100 mm in every bound: touches scatter by 0.200 mm, and no repeats show "
      "that it is noise. Touch five places four times each: what repeats scatter is noise, and "
      "leaves the bounds");
}

TEST(FindingWords, OfWhatWentWrong) {
  Touch one;
  one.line = 13;
  const std::vector<Quantity> shift = {
      {"shift", 0.52, "mm", 0.03}, {"x", 0.1, "mm"}, {"y", -0.5, "mm"}, {"z", 0.1, "mm"}};
  EXPECT_EQ(said(FindingKind::kMovedTarget, after(about_target(target("S2")), 11, one), shift),
            "moved target: S2 moved by 0.52 +- 0.03 mm (+0.10, -0.50, +0.10) after touch 12 (line "
            "13). Clamp it, and repeat from there");
  const FindingPart slipped{after(about_joint("A3"), 49, {}), {{"turn", 0.05, "deg", 0.004}}};
  const FindingPart knocked{after(about_tool("tool"), 49, {}), shift};
  EXPECT_EQ(said(FindingKind::kJumped, {}, {{"touches", 100.0, ""}}, {slipped}),
            "slipped joint: the zero of A3 seems to have jumped by +0.050 +- 0.004 deg after about "
            "touch 50 (of 100). Look for a slipping belt, coupling or brake, master the joint and "
            "calibrate again");
  EXPECT_EQ(said(FindingKind::kJumped, {}, {{"touches", 100.0, ""}}, {knocked}),
            "knocked tool: its tip seems to have moved by 0.52 +- 0.03 mm (+0.10, -0.50, +0.10) on "
            "the flange after about touch 50 (of 100). Check its fastening and calibrate again");
  EXPECT_EQ(
      said(FindingKind::kJumped, {}, {{"touches", 100.0, ""}}, {slipped, knocked}),
      "something moved in the middle of the session: the touches (100) do not tell for certain "
      "which: A3's zero by +0.050 +- 0.004 deg after about touch 50, or the tool's tip on the "
      "flange by 0.52 +- 0.03 mm (+0.10, -0.50, +0.10) after about touch 50. Check these and "
      "calibrate again");
  EXPECT_EQ(
      said(FindingKind::kChangeAccepted, {},
           {{"apart", 1.5, "mm"}, {"ratio", 6.0, ""}, {"workspace", 1.0, ""}}, {}, "session 7"),
      "since the last one: 1.500 mm between the tips of this calibration and of session 7, in "
      "the mean over the workspace, 6.0 times what both together predict; accepted");
  EXPECT_EQ(said(FindingKind::kRecorded, {}, {}, {}, "as it was written"), "as it was written");
}

}  // namespace
}  // namespace cellcal::calib
