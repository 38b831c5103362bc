// Touches that are not checked by the others: a wrong contact is not detected, and shifts the tip.

#include <gtest/gtest.h>

#include <cmath>

#include "calib/identify/identify.h"
#include "calib/model/kinematics.h"
#include "calib/verdict/change.h"
#include "tests/calib/findings.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::found;
using testing::make_touches;
using testing::plain_truth;
using testing::the;
using testing::words_of;

std::vector<Touch> touches_of(int fit, unsigned seed) {
  return make_touches(demo_cell(), plain_truth(demo_cell(), seed), {.fit = fit, .seed = seed})
      .touches;
}

/// The touch with its contact `early_m` too early, by a rotation of the axis with the longest lever.
Touch wrong_by(const Touch& touch, const Eigen::Vector3d& outward, double early_m) {
  constexpr double kStepRad = 1e-6;
  const ArmModel arm(demo_cell());
  Touch wrong = touch;
  double most_m_per_rad = 0.0;
  std::size_t by = 0;
  for (std::size_t joint = 0; joint < 3; ++joint) {
    JointVector turned(touch.joint_rad.begin(), touch.joint_rad.end());
    turned[joint] += kStepRad;
    const double m_per_rad =
        outward.dot(arm.nominal_tip_m(turned) - arm.nominal_tip_m(touch.joint_rad)) / kStepRad;
    if (std::abs(m_per_rad) <= std::abs(most_m_per_rad)) continue;
    most_m_per_rad = m_per_rad;
    by = joint;
  }
  wrong.joint_rad[by] += early_m / most_m_per_rad;
  return wrong;
}

TEST(UncheckedTouch, IsWarnedOfAndCanBeWrongUnseenWithTheShiftThatIsSaid) {
  int tried = 0, unseen = 0;
  for (unsigned seed = 1; seed <= 30 && tried < 3; ++seed) {
    std::vector<Touch> touches = touches_of(28, seed);
    const Calibration right = identify(demo_cell(), touches);
    if (!found(right, FindingKind::kUncheckedTouch) || !right.outliers.empty()) continue;
    ++tried;
    const Finding finding = the(right, FindingKind::kUncheckedTouch);
    EXPECT_EQ(finding.severity, Severity::kWarns);
    ASSERT_TRUE(finding.about.touch);
    const std::size_t touch = *finding.about.touch;
    const double unseen_m = 1e-3 * value(finding.evidence, "unseen"),
                 shift_m = 1e-3 * value(finding.evidence, "shift");
    EXPECT_GT(shift_m, 5e-3 * value(finding.evidence, "predicted"));
    Eigen::Vector3d outward = Eigen::Vector3d::Zero();
    for (const TouchResidual& r : right.residuals)
      if (r.touch == touch) outward = r.direction;
    constexpr double kOfUnseen = 0.3;
    touches[touch] = wrong_by(touches[touch], outward, kOfUnseen * unseen_m);
    const Calibration wrong = identify(demo_cell(), touches);
    if (!wrong.outliers.empty()) continue;  // another one was excluded because of it
    ++unseen;
    const auto apart = apart_in_scope(&right, wrong, touches, right.verdict.workspace);
    ASSERT_TRUE(apart);
    EXPECT_GT(apart->mean_apart_m, 0.5 * kOfUnseen * shift_m) << seed << words_of(right);
    EXPECT_LT(apart->mean_apart_m, 2.0 * kOfUnseen * shift_m) << seed << words_of(right);
  }
  EXPECT_EQ(tried, 3) << "28 touches beside some hundred unknowns";
  EXPECT_GE(unseen, 2);
}

TEST(UncheckedTouch, IsNoneAmongAHundred) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const Calibration c = identify(demo_cell(), touches_of(100, seed));
    EXPECT_FALSE(found(c, FindingKind::kUncheckedTouch)) << words_of(c);
    EXPECT_LT(c.unchecked_workspace.shift_m, 3.0 * c.predicted_workspace_m);
  }
}

}  // namespace
}  // namespace cellcal::calib
