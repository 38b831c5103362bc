// Comparison of an arm with its last calibration.

#include "calib/verdict/change.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include "calib/identify/identify.h"
#include "tests/calib/findings.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::found;
using testing::make_touches;
using testing::one_sphere_cell;
using testing::plain_truth;
using testing::words_of;

struct Calibrated {
  std::vector<Touch> touches;
  Calibration calibration;
};

Calibrated calibrated(const Cell& cell, std::uint64_t arm, unsigned seed, int fit = 80) {
  Calibrated result;
  result.touches = make_touches(cell, plain_truth(cell, arm), {.fit = fit, .seed = seed}).touches;
  result.calibration = identify(cell, result.touches);
  return result;
}

TEST(Change, OfAnArmThatIsTheSameIsANote) {
  for (unsigned arm = 1; arm <= 10; ++arm)
    for (const Cell* cell : {&demo_cell(), &one_sphere_cell()}) {
      const Calibrated last = calibrated(*cell, arm, 100 + arm);
      Calibrated now = calibrated(*cell, arm, 200 + arm);
      ASSERT_TRUE(now.calibration.verdict.publish()) << words_of(now.calibration);
      judge_change(last.calibration, "session 7", false, now.touches, now.calibration);
      EXPECT_TRUE(now.calibration.verdict.publish()) << words_of(now.calibration);
      EXPECT_TRUE(found(now.calibration, FindingKind::kUnchanged)) << words_of(now.calibration);
    }
}

TEST(Change, ToAnotherArmIsWithheldUnlessItIsAccepted) {
  for (unsigned arm = 1; arm <= 10; ++arm) {
    const Calibrated last = calibrated(demo_cell(), arm, 100 + arm);
    Calibrated now = calibrated(demo_cell(), arm + 50, 200 + arm);
    Calibration accepted = now.calibration;
    judge_change(last.calibration, "session 7", false, now.touches, now.calibration);
    EXPECT_FALSE(now.calibration.verdict.publish()) << words_of(now.calibration);
    EXPECT_EQ(now.calibration.verdict.findings.front().kind, FindingKind::kChanged);
    EXPECT_EQ(now.calibration.verdict.findings.front().text, "session 7");
    judge_change(last.calibration, "session 7", true, now.touches, accepted);
    EXPECT_TRUE(accepted.verdict.publish()) << words_of(accepted);
    EXPECT_TRUE(found(accepted, FindingKind::kChangeAccepted));
  }
}

TEST(Change, OfAMasteringByATenthOfADegreeIsFound) {
  // 0.05 deg at A2 of the calibrated arm: a millimetre at a metre. From then on all its angles read
  // less by this.
  const Calibrated last = calibrated(demo_cell(), 3, 103);
  Calibrated now = calibrated(demo_cell(), 3, 203);
  for (Touch& touch : now.touches) touch.joint_rad[1] += 0.1 * 3.14159265358979 / 180.0;
  now.calibration = identify(demo_cell(), now.touches);
  const auto change = change_since(last.calibration, now.calibration, now.touches);
  ASSERT_TRUE(change);
  EXPECT_TRUE(change->workspace);
  EXPECT_GT(change->mean_m, 0.2e-3);
  EXPECT_GT(change->mean_m, 3.0 * change->expected_m);
}

TEST(Change, HasOneSizeInVerdictAndComparison) {
  const Calibrated last = calibrated(demo_cell(), 3, 103), now = calibrated(demo_cell(), 7, 203);
  const auto change = change_since(last.calibration, now.calibration, now.touches);
  const auto compared =
      apart_in_scope(&last.calibration, now.calibration, now.touches, change->workspace);
  EXPECT_NEAR(change->mean_m, compared->mean_apart_m, 1e-12);
}

TEST(Change, ThatNothingIsForeseenOfIsNotJudged) {
  Calibrated last = calibrated(demo_cell(), 1, 101);
  Calibrated now = calibrated(demo_cell(), 51, 201);
  ASSERT_TRUE(change_since(last.calibration, now.calibration, now.touches));
  last.calibration.covariance.setZero();
  now.calibration.covariance.setZero();
  EXPECT_FALSE(change_since(last.calibration, now.calibration, now.touches));
  judge_change(last.calibration, "session 7", false, now.touches, now.calibration);
  EXPECT_TRUE(now.calibration.verdict.publish()) << words_of(now.calibration);
}

TEST(Change, WithAnotherToolIsNotJudged) {
  const Calibrated last = calibrated(demo_cell(), 1, 101);
  Cell other = demo_cell();
  other.tool.tcp.translation().z() += 0.02;
  Calibrated now = calibrated(other, 1, 201);
  EXPECT_FALSE(change_since(last.calibration, now.calibration, now.touches));
  judge_change(last.calibration, "session 7", false, now.touches, now.calibration);
  EXPECT_TRUE(now.calibration.verdict.publish()) << words_of(now.calibration);
  EXPECT_TRUE(found(now.calibration, FindingKind::kNotCompared));
}

}  // namespace
}  // namespace cellcal::calib
