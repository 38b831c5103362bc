// Sentences of undetermined directions; tested here only.

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
    EXPECT_EQ(by_own_name<UnidentifiableKind>(to_string(kind)), kind) << k;
  }
  EXPECT_FALSE(by_own_name<UnidentifiableKind>("frame"));
}

TEST(UnidentifiableWords, OfTheFrameSayThatItIsAConvention) {
  EXPECT_EQ(said(Kind::kZeroOfFirstJoint),
            "zero of A1: the same as turning all targets about the base axis. Fixed by convention "
            "(gauge)");
  EXPECT_EQ(said(Kind::kHeightOfBase),
            "height of the arm on its base (A1.d): the same as lowering all targets. Fixed by "
            "convention (gauge)");
  EXPECT_EQ(said(Kind::kBehindLastJoint, {kD, kA}),
            "A3.d and A2.a move the tip in three directions only, behind the last axis: one "
            "combination is not observable. Fixed by convention (gauge)");
  EXPECT_EQ(said(Kind::kNothingMoves, {kD, kA, kX}, 3),
            "A3.d, A2.a, S1.x and 3 more can change together without moving anything. Fixed by "
            "convention (gauge)");
}

TEST(UnidentifiableWords, OfWeakDirectionsSayWhatToTouch) {
  EXPECT_EQ(said(Kind::kWeak, {kD}),
            "A3.d is not determined by these touches; its tolerance decides. Touch in other "
            "postures");
  EXPECT_EQ(said(Kind::kScale, {kD, kA}),
            "A3.d and A2.a cannot be separated by these touches; their tolerances decide. All "
            "lengths scale together: touch a second sphere at a certified distance");
  EXPECT_EQ(said(Kind::kNoEffect, {joint_parameter(ParameterKind::kCompliance, 2)}),
            "A3.compliance moves the tip by less than 0.001 mm: not observable, and without "
            "effect; its tolerance decides");
  UnidentifiableDirection last{Kind::kWeak, {kD, kA}};
  last.more_as_weak = 4;
  EXPECT_TRUE(words(cell(), last).ends_with(". 4 further directions are as weak"));
}

TEST(UnidentifiableWords, OfARecordAreTheRecords) {
  UnidentifiableDirection recorded;
  recorded.text = "as an earlier version said";
  EXPECT_EQ(words(cell(), recorded), recorded.text);
}

}  // namespace
}  // namespace cellcal::calib
