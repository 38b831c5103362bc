// Sentences of likely causes: deviation and what to check.

#include <gtest/gtest.h>

#include <string>

#include "calib/result/calibration.h"
#include "calib/result/finding.h"
#include "calib/result/likely_cause.h"
#include "tests/calib/result/target.h"

namespace cellcal::calib {
namespace {

constexpr int kCauses = static_cast<int>(LikelyCause::kAllCentres) + 1;

using testing::target;

FindingPart named_as(const std::string& id, const std::string& really) {
  FindingPart part{about_target(target(id)), {}};
  part.about.other_end = really;
  return part;
}

FindingPart field(const char* joint, const char* name, double should_be, double stated,
                  const char* unit = "") {
  return {about_joint(joint), {{name, should_be, unit}, {"stated", stated, unit}}};
}

/// As if correcting it would let the result pass.
Finding mending(Finding finding) {
  finding.evidence.push_back({"mends", 1.0, ""});
  return finding;
}

TEST(CauseNames, AreReadBackAsTheyAreWritten) {
  for (int k = 0; k < kCauses; ++k) {
    const auto cause = static_cast<LikelyCause>(k);
    EXPECT_STRNE(to_string(cause), "") << k;
    EXPECT_EQ(by_own_name<LikelyCause>(to_string(cause)), cause) << k;
  }
  EXPECT_FALSE(by_own_name<LikelyCause>("gremlins"));
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
  EXPECT_EQ(cause_words(likely(LikelyCause::kRadians, {}, {{"largest", 3.04, "deg"}})),
            "largest joint angle 3.0 deg: the angles are in radians. Give them in degrees");
  EXPECT_EQ(cause_words(likely(LikelyCause::kAxisSign, about_joint("A3"))),
            "A3 turns the other way. Check its sign in the robot file");
  EXPECT_EQ(cause_words(likely(LikelyCause::kMastering, about_joint("A3"), {{"add", -2.0, "deg"}})),
            "zero of A3 off by -2.00 deg (true minus read angle). Check its mastering");
  EXPECT_EQ(cause_words(likely(LikelyCause::kExchangedColumns, {}, {},
                               {{about_joint("A4"), {}}, {about_joint("A6"), {}}})),
            "angles of A4 and A6 are exchanged. Check the columns");
}

TEST(CauseWords, OfTargets) {
  const Finding swapped =
      likely(LikelyCause::kTargetNames, {}, {}, {named_as("S1", "S3"), named_as("S3", "S1")});
  EXPECT_EQ(cause_words(swapped), "touches of S1 and S3 are exchanged. Correct their target names");
  EXPECT_EQ(cause_words(mending(swapped)), cause_words(swapped));
  EXPECT_EQ(cause_words(likely(LikelyCause::kTargetNames, {}, {},
                               {named_as("S1", "S2"), named_as("S2", "S3"), named_as("S3", "S1")})),
            "touches of S1 fit S2, touches of S2 fit S3, touches of S3 fit S1. "
            "Correct their target names");
  Finding scattered = likely(LikelyCause::kScatteredTouches, about_target(target("S1")),
                             {{"together", 7.0, ""}, {"touches", 20.0, ""}, {"others", 3.0, ""}});
  EXPECT_EQ(
      cause_words(scattered),
      "S1: at most 7 of 20 touches agree on one place (3 more targets likewise). Check in this "
      "order: target column, order of the angle columns, robot file, whether S1 was moved");
  scattered.evidence.back().value = 1.0;
  EXPECT_NE(cause_words(scattered).find("(1 more target likewise)"), std::string::npos);
  Touch touch;
  EXPECT_EQ(cause_words(likely(LikelyCause::kMoved, after(about_target(target("S2")), 41, touch),
                               {{"shift", 4.98, "mm"}})),
            "S2 moved by 4.98 mm at about touch 42. Clamp it and calibrate again");
}

TEST(CauseWords, OfLengthsInAnotherUnit) {
  EXPECT_EQ(cause_words(likely(LikelyCause::kLengthsUnit, {}, {{"unit", 25.4, "mm"}})),
            "the certified lengths are in inches. Give them in millimetres");
}

TEST(CauseWords, OfReadings) {
  const auto unit = [](double mm) {
    return cause_words(likely(LikelyCause::kReadingsUnit, {}, {{"unit", mm, "mm"}},
                              {{about_target(target("T1", TargetKind::kTracker)), {}},
                               {about_target(target("W1", TargetKind::kWire)), {}}}));
  };
  EXPECT_EQ(unit(25.4), "readings of T1, W1 are in inches. Give them in millimetres");
  EXPECT_NE(unit(1000.0).find("are in metres"), std::string::npos);
  EXPECT_NE(unit(0.001).find("are in micrometres"), std::string::npos);
  EXPECT_EQ(cause_words(likely(LikelyCause::kReadingsHandedness, {}, {},
                               {{about_target(target("T1", TargetKind::kTracker)), {}}})),
            "readings of T1 are left-handed. "
            "Check the columns for a wrong sign or an exchange");
}

TEST(CauseWords, OfTheTool) {
  EXPECT_EQ(cause_words(likely(LikelyCause::kToolUnit, {}, {{"reach", 0.418, "mm"}})),
            "tool length 0.418 mm: given in metres. Give it in millimetres");
  Finding tip =
      likely(LikelyCause::kToolTip, {}, {{"x", 12.0, "mm"}, {"y", -8.04, "mm"}, {"z", 20.0, "mm"}});
  EXPECT_EQ(cause_words(tip),
            "tool tip off by about (12.0, -8.0, 20.0) mm in the flange frame. "
            "Compare the tool with the cell file");
  tip.evidence.push_back({"turn", 1.0, ""});
  EXPECT_TRUE(
      cause_words(tip).ends_with("with the cell file, and check the mastering of the last axis"));
}

TEST(CauseWords, OfTheRobotFile) {
  Finding dimension = likely(LikelyCause::kDimension, {}, {}, {field("A6", "d_mm", 80.24, 115.0)});
  EXPECT_EQ(cause_words(dimension),
            "d_mm of A6: 115.0 mm stated, 80.2 mm fits. Check the robot file");
  dimension.evidence = {{"last", 1.0, ""}};
  EXPECT_TRUE(cause_words(dimension).ends_with("the robot file and the tool's length"));
  EXPECT_EQ(cause_words(
                likely(LikelyCause::kAxisConvention, {}, {},
                       {field("A2", "offset_deg", 0.0, -90.0, "deg"), field("A4", "sign", -1, 1)})),
            "offset_deg of A2: -90 deg stated, 0 deg fits; sign of A4: 1 stated, -1 fits. "
            "Check the robot file");
  Finding other = likely(
      LikelyCause::kOtherRobot, about_robot("kr5_r1400", "KUKA KR 5"), {{"differences", 1.0, ""}},
      {{about_robot("KUKA KR 16", {}), {}}, field("A1", "d_mm", 400.0, 0.4, "mm")});
  EXPECT_EQ(cause_words(other),
            "robot file kr5_r1400 (KUKA KR 5) fits the touches, that of KUKA KR 16 does not "
            "(d_mm of A1: 0.4 mm stated, 400 mm fits). Check the type plate of the arm");
  other.parts.resize(1);
  other.parts[0].about.name = "KUKA KR 5";
  other.evidence[0].value = 12.0;
  EXPECT_EQ(cause_words(other),
            "robot file kr5_r1400 (KUKA KR 5) fits the touches, the cell's own of that name does "
            "not. Check the type plate of the arm");
  EXPECT_EQ(cause_words(likely(LikelyCause::kGravity, {},
                               {{"x", 0.0, "m/s^2"}, {"y", 0.0, "m/s^2"}, {"z", -9.81, "m/s^2"}})),
            "gravity acts along -z of the base. "
            "Check how the arm is mounted, and gravity in the robot file");
}

TEST(CauseWords, OfSizes) {
  EXPECT_EQ(cause_words(likely(LikelyCause::kAllDiameters, {}, {{"off", -6.0, "mm"}})),
            "all diameters: -6.00 mm from stated. Check diameter_mm and tip_radius_mm");
  EXPECT_EQ(
      cause_words(likely(LikelyCause::kDiameter, about_target(target("S1")), {{"off", 8.0, "mm"}})),
      "diameter of S1: +8.00 mm from stated. Check diameter_mm");
  const FindingPart sphere{about_target(target("S2")),
                           {{"measured", 61.8, "mm", 0.02}, {"stated", 61.4, "mm"}}};
  const FindingPart wires{{}, {{"longer", -0.4, "mm", 0.05}}};
  EXPECT_EQ(cause_words(likely(LikelyCause::kArtefactSize, {}, {}, {wires})),
            "readings of all wires: 0.40 ± 0.05 mm too long. Check where the wire reads zero");
  EXPECT_EQ(cause_words(likely(LikelyCause::kArtefactSize, {}, {}, {sphere, wires})),
            "diameter of S2: 61.400 mm stated, 61.80 ± 0.02 mm measured, or readings of all wires: "
            "0.40 ± 0.05 mm too long. Check diameter_mm, and clean the sphere");
  EXPECT_TRUE(cause_words(likely(LikelyCause::kArtefactSize, {}, {{"lengths", 1.0, ""}}, {sphere}))
                  .ends_with("Check diameter_mm and the certified lengths, and clean the sphere"));
}

TEST(CauseWords, OfLengths) {
  EXPECT_EQ(cause_words(likely(LikelyCause::kCertifiedLength, about_length("S1", "S2"),
                               {{"stated", 400.0, "mm"}, {"measured", 400.1, "mm", 0.01}})),
            "certified length S1-S2: 400.000 mm stated, 400.100 ± 0.010 mm measured. Measure it "
            "again, or check that neither target was moved");
  EXPECT_NE(cause_words(likely(LikelyCause::kCertifiedLength, about_length("S1", "S2"),
                               {{"stated", 400.0, "mm"}}))
                .find("400.000 mm stated, contradicted by all other data. Measure it again"),
            std::string::npos);
  EXPECT_EQ(cause_words(likely(LikelyCause::kExchangedLengths, {}, {},
                               {{about_length("S1", "S2"), {}}, {about_length("S2", "S4"), {}}})),
            "certified lengths S1-S2 and S2-S4 are exchanged. Check which is which");
  EXPECT_EQ(cause_words(likely(LikelyCause::kLengthsOfTarget, about_target(target("S2")),
                               {{"lengths", 3.0, ""}})),
            "all 3 certified lengths of S2 contradict the touches. "
            "Measure them again, or put S2 back where it stood");
  EXPECT_TRUE(cause_words(likely(LikelyCause::kAllLengths))
                  .starts_with("more than one certified length contradicts the touches. "));
}

TEST(CauseWords, OfCentres) {
  const Finding held = likely(LikelyCause::kStatedCentre, about_target(target("S2")));
  EXPECT_EQ(cause_words(mending(held)),
            "centre of S2: contradicted by all other data. "
            "Check centre_mm, or state a larger centre_sigma_mm");
  EXPECT_EQ(cause_words(likely(LikelyCause::kStatedCentre, held.about, {{"off", 49.96, "mm"}})),
            "centre of S2: 50.0 mm from stated. "
            "Check centre_mm, or state a larger centre_sigma_mm");
  EXPECT_EQ(cause_words(likely(LikelyCause::kAllCentres)),
            "stated centres do not fit the touches. Check centre_mm, which may be in another "
            "frame than the arm's base, or state a larger centre_sigma_mm");
  EXPECT_EQ(cause_words(mending(likely(LikelyCause::kAllCentres))),
            "stated centres do not fit the touches. "
            "Check centre_mm, or state a larger centre_sigma_mm");
}

TEST(CauseWords, OfWhatIsStillWrongBesideAModelErrorAreThoseOfTheFinding) {
  Finding still{FindingKind::kStillWithModelError, Severity::kWarns};
  still.still = {likely(LikelyCause::kAllLengths)};
  EXPECT_EQ(words(still), "also with the model error estimated: likely cause: " +
                              cause_words(still.still.front()));
}

}  // namespace
}  // namespace cellcal::calib
