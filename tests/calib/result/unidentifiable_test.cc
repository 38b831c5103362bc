// The sentences of directions that touches do not decide; no other test looks into them.

#include "calib/result/unidentifiable.h"

#include <gtest/gtest.h>

namespace cellcal::calib {
namespace {

using Kind = UnidentifiableKind;

Cell cell() {
  Cell one;
  for (const char* name : {"A1", "A2", "A3"}) one.robot.joints.emplace_back().name = name;
  one.targets.emplace_back().id = "S1";
  return one;
}

std::string said(Kind kind, const std::vector<ParameterKey>& parameters = {},
                 std::size_t more = 0) {
  return words(cell(), {kind, parameters, more});
}

const ParameterKey kA = joint_parameter(ParameterKind::kA, 1),
                   kD = joint_parameter(ParameterKind::kD, 2),
                   kX = target_parameter(ParameterKind::kCentre, 0, 0);

TEST(UnidentifiableKinds, AreReadBackAsTheyAreWritten) {
  for (int k = 0; k <= static_cast<int>(Kind::kRecorded); ++k) {
    const auto kind = static_cast<Kind>(k);
    EXPECT_STRNE(to_string(kind), "") << k;
    EXPECT_EQ(unidentifiable_kind(to_string(kind)), kind) << k;
  }
  EXPECT_FALSE(unidentifiable_kind("frame"));
}

TEST(UnidentifiableWords, OfTheFrameSayThatItIsAConvention) {
  EXPECT_EQ(
      said(Kind::kZeroOfFirstJoint),
      "turning the zero of A1 is the same as turning all targets about the base axis; fixed by "
      "convention");
  EXPECT_EQ(said(Kind::kHeightOfBase),
            "raising the arm on its base (A1.d) is the same as lowering all targets; fixed by "
            "convention");
  EXPECT_EQ(said(Kind::kBehindLastJoint, {kD, kA}),
            "behind the last axis A3.d and A2.a move the tip in three directions only: one "
            "combination of them never shows; fixed by convention");
  EXPECT_EQ(said(Kind::kNothingMoves, {kD, kA, kX}, 3),
            "A3.d, A2.a, S1.x and 3 more can change together without anything moving; fixed by "
            "convention");
  for (const Kind kind :
       {Kind::kZeroOfFirstJoint, Kind::kHeightOfBase, Kind::kBehindLastJoint, Kind::kNothingMoves})
    EXPECT_TRUE(is_of_frame(kind));
}

TEST(UnidentifiableWords, OfWeakDirectionsSayWhatWouldTellThem) {
  EXPECT_EQ(
      said(Kind::kWeak, {kD}),
      "these touches do not tell A3.d; the tolerances decide. Touches in other postures would "
      "resolve it");
  EXPECT_EQ(
      said(Kind::kScale, {kD, kA}),
      "these touches do not tell A3.d and A2.a apart; the tolerances decide. All lengths grow "
      "together here: touch a second sphere at a certified distance");
  EXPECT_EQ(said(Kind::kNoEffect, {joint_parameter(ParameterKind::kCompliance, 2)}),
            "A3.compliance moves the tip by less than a micrometre, so that no touch tells it and "
            "nothing depends on it; the tolerances decide");
  UnidentifiableDirection last{Kind::kWeak, {kD, kA}};
  last.more_as_weak = 4;
  EXPECT_TRUE(words(cell(), last).ends_with("; 4 further directions are as weak"));
  for (const Kind kind : {Kind::kNoEffect, Kind::kScale, Kind::kWeak, Kind::kRecorded})
    EXPECT_FALSE(is_of_frame(kind));
}

TEST(UnidentifiableWords, OfARecordAreTheRecords) {
  UnidentifiableDirection recorded;
  recorded.text = "as an earlier version said";
  EXPECT_EQ(words(cell(), recorded), recorded.text);
}

}  // namespace
}  // namespace cellcal::calib
