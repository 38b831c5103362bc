// The sentences of likely causes: what was put right for the touches to make sense, what to check.

#include "calib/words/cause_words.h"

#include <gtest/gtest.h>

#include <string>

#include "calib/words/finding_words.h"

namespace cellcal::calib {
namespace {

constexpr int kCauses = static_cast<int>(LikelyCause::kAllCentres) + 1;

Target target(const std::string& id, TargetKind kind = TargetKind::kSphere) {
  Target one;
  one.id = id;
  one.kind = kind;
  return one;
}

FindingPart named_as(const std::string& id, const std::string& really) {
  FindingPart part{about_target(target(id)), {}};
  part.about.other_end = really;
  return part;
}

FindingPart field(const char* joint, const char* name, double should_be, double stated) {
  return {about_joint(joint), {{name, should_be, ""}, {"stated", stated, ""}}};
}

/// As where the result would be let through with it put right.
Finding mending(Finding finding) {
  finding.evidence.push_back({"mends", 1.0, ""});
  return finding;
}

TEST(CauseNames, AreReadBackAsTheyAreWritten) {
  for (int k = 0; k < kCauses; ++k) {
    const auto cause = static_cast<LikelyCause>(k);
    EXPECT_STRNE(to_string(cause), "") << k;
    EXPECT_EQ(likely_cause(to_string(cause)), cause) << k;
  }
  EXPECT_FALSE(likely_cause("gremlins"));
}

TEST(CauseWords, AreASentenceForEveryCauseWhateverItsEvidence) {
  for (int k = 0; k < kCauses; ++k) {
    const Finding bare = likely(static_cast<LikelyCause>(k));
    EXPECT_FALSE(cause_words(bare).empty()) << k;
    EXPECT_EQ(words(bare), "likely cause: " + cause_words(bare));
  }
}

TEST(CauseWords, OfAFileThatHoldsThemAloneAreItsOwn) {
  Finding finding{FindingKind::kLikelyCause};
  finding.text = "with all of it put right";
  EXPECT_EQ(words(finding), "likely cause: with all of it put right");
}

TEST(CauseWords, OfAngles) {
  EXPECT_EQ(
      cause_words(likely(LikelyCause::kRadians, {}, {{"largest", 3.04, "deg"}})),
      "no joint angle is above 3.0 deg, and read as radians the touches make sense; give them "
      "in degrees");
  EXPECT_EQ(
      cause_words(likely(LikelyCause::kAxisSign, about_joint("A3"))),
      "with A3 turning the other way the touches make sense; check its sign in the robot file");
  EXPECT_EQ(cause_words(likely(LikelyCause::kMastering, about_joint("A3"), {{"add", -2.0, "deg"}})),
            "with -2.00 deg added to all angles of A3 the touches make sense; has it lost its "
            "mastering?");
  EXPECT_EQ(cause_words(likely(LikelyCause::kExchangedColumns, {}, {},
                               {{about_joint("A4"), {}}, {about_joint("A6"), {}}})),
            "with the angles of A4 and A6 exchanged the touches make sense; check the columns");
}

TEST(CauseWords, OfTargets) {
  const Finding swapped =
      likely(LikelyCause::kTargetNames, {}, {}, {named_as("S1", "S3"), named_as("S3", "S1")});
  EXPECT_EQ(cause_words(swapped),
            "with S1 and S3 swapped the touches make sense; check which is which");
  EXPECT_EQ(cause_words(mending(swapped)),
            "with the touches of S1 taken for S3's, of S3 for S1's all makes sense; check which is "
            "which");
  EXPECT_EQ(
      cause_words(likely(LikelyCause::kTargetNames, {}, {},
                         {named_as("S1", "S2"), named_as("S2", "S3"), named_as("S3", "S1")})),
      "with the touches of S1 taken for S2's, of S2 for S3's, of S3 for S1's all makes sense; "
      "check which is which");
  Finding scattered = likely(LikelyCause::kScatteredTouches, about_target(target("S1")),
                             {{"together", 7.0, ""}, {"touches", 20.0, ""}, {"others", 3.0, ""}});
  EXPECT_EQ(cause_words(scattered),
            "the touches of S1 lie all over, no more than 7 of 20 together (and so do those of 3 "
            "other targets); check the target column, the order of the angles' columns and the "
            "robot file, and whether it was moved");
  scattered.evidence.back().value = 1.0;
  EXPECT_NE(cause_words(scattered).find("those of 1 other target)"), std::string::npos);
  Touch touch;
  EXPECT_EQ(cause_words(likely(LikelyCause::kMoved, after(about_target(target("S2")), 41, touch),
                               {{"shift", 4.98, "mm"}})),
            "S2 seems to have moved by 4.98 mm at about touch 42; fix it, and touch again");
}

TEST(CauseWords, OfReadings) {
  const auto unit = [](double mm) {
    return cause_words(likely(LikelyCause::kReadingsUnit, {}, {{"unit", mm, "mm"}},
                              {{about_target(target("T1", TargetKind::kTracker)), {}},
                               {about_target(target("W1", TargetKind::kWire)), {}}}));
  };
  EXPECT_EQ(unit(25.4),
            "with the readings of T1, W1 taken as inches the touches make sense; give "
            "them in millimetres");
  EXPECT_NE(unit(1000.0).find("taken as metres"), std::string::npos);
  EXPECT_NE(unit(0.001).find("taken as micrometres"), std::string::npos);
  EXPECT_EQ(cause_words(likely(LikelyCause::kReadingsHandedness, {}, {},
                               {{about_target(target("T1", TargetKind::kTracker)), {}}})),
            "with one axis of the readings of T1 turned about the touches make sense; has one of "
            "the columns the wrong sign, or are two of them exchanged?");
}

TEST(CauseWords, OfTheTool) {
  EXPECT_EQ(cause_words(likely(LikelyCause::kToolUnit, {}, {{"reach", 0.418, "mm"}})),
            "the tool is 0.418 mm long, and read as metres the touches make sense; give it in "
            "millimetres");
  Finding tip =
      likely(LikelyCause::kToolTip, {}, {{"x", 12.0, "mm"}, {"y", -8.04, "mm"}, {"z", 20.0, "mm"}});
  EXPECT_EQ(
      cause_words(tip),
      "with the tool's tip moved by about (12.0, -8.0, 20.0) mm on the flange the touches make "
      "sense; is it the tool of the cell file?");
  tip.evidence.push_back({"turn", 1.0, ""});
  EXPECT_TRUE(cause_words(tip).ends_with(
      "is it the tool of the cell file, and has the last axis its mastering?"));
}

TEST(CauseWords, OfTheRobotFile) {
  Finding dimension = likely(LikelyCause::kDimension, {}, {}, {field("A6", "d_mm", 80.24, 115.0)});
  EXPECT_EQ(cause_words(dimension),
            "with d_mm of A6 80.2 instead of 115.0 the touches make sense; check it in the robot "
            "file");
  dimension.evidence = {{"last", 1.0, ""}};
  EXPECT_TRUE(cause_words(dimension).ends_with("in the robot file, and the tool's length"));
  EXPECT_EQ(
      cause_words(likely(LikelyCause::kAxisConvention, {}, {},
                         {field("A2", "offset_deg", 0.0, -90.0), field("A4", "sign", -1, 1)})),
      "with offset_deg of A2 0 instead of -90, sign of A4 -1 instead of 1 the touches make "
      "sense; check the robot file");
  Finding other = likely(LikelyCause::kOtherRobot, about_robot("kr5_r1400", "KUKA KR 5"),
                         {{"differences", 1.0, ""}},
                         {{about_robot("KUKA KR 16", {}), {}}, field("A1", "d_mm", 400.0, 0.4)});
  EXPECT_EQ(
      cause_words(other),
      "with the robot file kr5_r1400 (KUKA KR 5) the touches make sense, and not with that of "
      "KUKA KR 16; it has d_mm of A1 400 instead of 0.4; check these");
  other.parts.resize(1);
  other.parts[0].about.name = "KUKA KR 5";
  other.evidence[0].value = 12.0;
  EXPECT_EQ(cause_words(other),
            "with the robot file kr5_r1400 (KUKA KR 5) the touches make sense, and not with the "
            "cell's own of that name; which arm is it?");
  EXPECT_EQ(
      cause_words(likely(LikelyCause::kGravity, {},
                         {{"x", 0.0, "m/s^2"}, {"y", 0.0, "m/s^2"}, {"z", -9.81, "m/s^2"}})),
      "with gravity along -z of the base the touches make sense; check how the arm is mounted, "
      "and gravity in the robot file");
}

TEST(CauseWords, OfSizes) {
  EXPECT_EQ(cause_words(likely(LikelyCause::kAllDiameters, {}, {{"off", -6.0, "mm"}})),
            "with diameters -6.00 mm off what the cell file states the touches make sense; check "
            "diameter_mm and tip_radius_mm");
  EXPECT_EQ(
      cause_words(likely(LikelyCause::kDiameter, about_target(target("S1")), {{"off", 8.0, "mm"}})),
      "with the diameter of S1 +8.00 mm off what the cell file states the touches make sense; check "
      "its diameter_mm");
  const FindingPart sphere{about_target(target("S2")),
                           {{"measured", 61.8, "mm", 0.02}, {"stated", 61.4, "mm"}}};
  const FindingPart wires{{}, {{"longer", -0.4, "mm", 0.05}}};
  EXPECT_EQ(cause_words(likely(LikelyCause::kArtefactSize, {}, {}, {wires})),
            "with all readings of all wires -0.40 +- 0.05 mm longer everything makes sense; check "
            "where the wire reads zero");
  EXPECT_EQ(
      cause_words(likely(LikelyCause::kArtefactSize, {}, {}, {sphere, wires})),
      "with the diameter of S2 61.80 +- 0.02 mm instead of 61.400 mm, or with all readings of "
      "all wires -0.40 +- 0.05 mm longer everything makes sense; check diameter_mm, and that "
      "it is clean");
  EXPECT_TRUE(cause_words(likely(LikelyCause::kArtefactSize, {}, {{"lengths", 1.0, ""}}, {sphere}))
                  .ends_with("check diameter_mm, that it is clean, and its certified lengths"));
}

TEST(CauseWords, OfLengths) {
  EXPECT_EQ(cause_words(likely(LikelyCause::kCertifiedLength, about_length("S1", "S2"),
                               {{"stated", 400.0, "mm"}, {"measured", 400.1, "mm", 0.01}})),
            "without the certified length of S1 and S2 everything makes sense, and they lie 400.10 "
            "+- 0.01 mm apart instead of 400.000 mm; check it, and whether one of them was moved "
            "since it was measured");
  EXPECT_NE(cause_words(likely(LikelyCause::kCertifiedLength, about_length("S1", "S2"),
                               {{"stated", 400.0, "mm"}}))
                .find("and nothing tells of it; check it"),
            std::string::npos);
  EXPECT_EQ(cause_words(likely(LikelyCause::kExchangedLengths, {}, {},
                               {{about_length("S1", "S2"), {}}, {about_length("S2", "S4"), {}}})),
            "with the certified lengths of S1-S2 and S2-S4 exchanged the touches make sense; check "
            "which is which");
  EXPECT_EQ(cause_words(likely(LikelyCause::kLengthsOfTarget, about_target(target("S2")),
                               {{"lengths", 3.0, ""}})),
            "without the 3 certified lengths of S2 everything makes sense; does it stand where it "
            "stood when they were measured?");
  EXPECT_TRUE(
      cause_words(likely(LikelyCause::kAllLengths))
          .starts_with("without any certified length everything makes sense; more than one"));
}

TEST(CauseWords, OfCentres) {
  const Finding held = likely(LikelyCause::kStatedCentre, about_target(target("S2")));
  EXPECT_EQ(cause_words(mending(held)),
            "with S2 not held where the cell file states it everything makes sense; check its "
            "centre_mm, or state a larger centre_sigma_mm");
  EXPECT_EQ(cause_words(likely(LikelyCause::kStatedCentre, held.about, {{"off", 49.96, "mm"}})),
            "with S2 50.0 mm from where the cell file states it the touches make sense; check its "
            "centre_mm, or state a larger centre_sigma_mm");
  EXPECT_EQ(cause_words(likely(LikelyCause::kAllCentres)),
            "with no centre held where the cell file states it the touches make sense; check "
            "centre_mm (of the arm's base frame?), or state a larger centre_sigma_mm");
  EXPECT_EQ(cause_words(mending(likely(LikelyCause::kAllCentres))),
            "with no centre held where the cell file states it everything makes sense; check "
            "centre_mm, or state a larger centre_sigma_mm");
}

TEST(CauseWords, OfWhatIsStillWrongBesideAModelErrorAreThoseOfTheFinding) {
  Finding still{FindingKind::kStillWithModelError, Severity::kWarns};
  still.still = {likely(LikelyCause::kAllLengths)};
  EXPECT_EQ(words(still), "model error: with it estimated, too, there is likely cause: " +
                              cause_words(still.still.front()));
}

}  // namespace
}  // namespace cellcal::calib
