// Sentences of outliers; tested here only.

#include "calib/result/outlier.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace cellcal::calib {
namespace {

Outlier off(TargetKind target, double residual_mm, OutlierKind kind = OutlierKind::kOffItsTarget) {
  Outlier one;
  one.residual_m = residual_mm * 1e-3;
  one.leverage = 0.87;
  one.kind = kind;
  one.target = "S1";
  one.target_kind = target;
  one.sigmas = 12.4;
  return one;
}

TEST(OutlierKinds, AreReadBackAsTheyAreWritten) {
  for (int k = 0; k <= static_cast<int>(OutlierKind::kRecorded); ++k) {
    const auto kind = static_cast<OutlierKind>(k);
    EXPECT_STRNE(to_string(kind), "") << k;
    EXPECT_EQ(by_own_name<OutlierKind>(to_string(kind)), kind) << k;
  }
  EXPECT_FALSE(by_own_name<OutlierKind>("off"));
}

TEST(OutlierWords, HaveTheSideWhereThereIsOne) {
  EXPECT_EQ(words(off(TargetKind::kSphere, 0.5)),
            "+0.500 mm off S1 (12 sigma): contact detected before the surface");
  EXPECT_EQ(words(off(TargetKind::kPlane, -0.5)),
            "-0.500 mm off S1 (12 sigma): contact detected too late");
  EXPECT_EQ(words(off(TargetKind::kWire, 0.5)),
            "+0.500 mm off S1 (12 sigma): wire reads too short. Check its zero, and that it was "
            "taut");
  EXPECT_EQ(words(off(TargetKind::kWire, -0.5)),
            "-0.500 mm off S1 (12 sigma): wire reads too long. Check that nothing held or bent it");
  EXPECT_EQ(words(off(TargetKind::kPoint, -0.5)),
            "0.500 mm off S1 (12 sigma). Check that the tip was seated");
  EXPECT_EQ(words(off(TargetKind::kTracker, 0.5)),
            "0.500 mm off S1 (12 sigma). Check the line of sight and the reflector");
}

TEST(OutlierWords, SayWhatToDoWhereMoreIsKnown) {
  Outlier other = off(TargetKind::kSphere, 12.0, OutlierKind::kOnAnotherTarget);
  other.lies_on = "S3";
  EXPECT_EQ(words(other), "+12.000 mm off S1 (12 sigma): it lies on S3. Correct its target");
  EXPECT_EQ(words(off(TargetKind::kSphere, 0.5, OutlierKind::kHoldsItself)),
            "+0.500 mm off S1 (12 sigma): contact detected before the surface. Leverage 87 %: "
            "hardly any other touch determines this place. Touch there again");
  EXPECT_TRUE(words(off(TargetKind::kTracker, 0.5, OutlierKind::kHoldsItself))
                  .ends_with("determines this place. Measure there again"));
}

TEST(OutlierWords, LeaveOutFiguresThatAreNone) {
  Outlier one = off(TargetKind::kSphere, std::nan(""), OutlierKind::kHoldsItself);
  one.sigmas = one.leverage = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(words(one).starts_with("off S1")) << words(one);
  for (const char* none : {"nan", "inf"})
    EXPECT_EQ(words(one).find(none), std::string::npos) << words(one);
}

TEST(OutlierWords, OfARecordAreTheRecords) {
  Outlier recorded = off(TargetKind::kSphere, 0.5, OutlierKind::kRecorded);
  recorded.text = "as an earlier version said";
  EXPECT_EQ(words(recorded), recorded.text);
}

}  // namespace
}  // namespace cellcal::calib
