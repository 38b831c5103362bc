// Position of a sphere, from a few tips of an arm with errors of millimetres.

#include "calib/estimate/start.h"

#include <glog/logging.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "calib/estimate/solve.h"
#include "calib/estimate/target.h"
#include "calib/model/error.h"
#include "calib/model/kinematics.h"
#include "calib/model/linear.h"
#include "tests/calib/simulate.h"
#include "tests/calib/thrown.h"

namespace cellcal::calib {
namespace {

using Eigen::Vector3d;

constexpr double kRadiusM = 0.0307;

/// Tips on the cap of half-angle `cap_rad` about `side`, each with an error of `noise_m`.
std::vector<Vector3d> cap(const Vector3d& centre_m, const Vector3d& side, double cap_rad, int count,
                          double noise_m, Random& random) {
  std::vector<Vector3d> tips;
  while (static_cast<int>(tips.size()) < count) {
    const Vector3d n = Vector3d(random.normal(), random.normal(), random.normal()).normalized();
    if (n.dot(side) < std::cos(cap_rad)) continue;
    tips.push_back(centre_m + kRadiusM * n +
                   noise_m * Vector3d(random.normal(), random.normal(), random.normal()));
  }
  return tips;
}

constexpr double kCapRad = 0.6, kNoiseM = 1e-3;
constexpr int kTips = 5, kDraws = 300;

/// Number of fits closer to the mirrored centre on the other side of the tips.
int on_the_other_side(bool stated, bool side_known) {
  int wrong = 0;
  for (unsigned seed = 1; seed <= kDraws; ++seed) {
    Random random(seed);
    const Vector3d side = Vector3d(random.normal(), random.normal(), random.normal()).normalized();
    const Vector3d centre(1.06, 0.38, 0.33);
    const auto tips = cap(centre, side, kCapRad, kTips, kNoiseM, random);
    const Vector3d said =
        centre + 5e-3 * Vector3d(random.normal(), random.normal(), random.normal());
    CentreHints hints;
    if (stated) hints = {&said, 0.01};
    if (side_known) hints.outwards = side;
    const SphereFit fit = fit_centre(tips, std::vector<double>(kTips, kRadiusM), hints);
    wrong += (fit.centre_m - centre).dot(side) > kRadiusM;
  }
  return wrong;
}

TEST(QuietSolver, WarnsOfNothingOnStandardError) {
  quiet_solver();
  ::testing::internal::CaptureStderr();
  LOG(WARNING) << "Linear solver failure. Failed to compute a step";  // as Ceres itself does
  LOG(ERROR) << "likewise";
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST(FitCentre, OfAFewTipsOnOneSideStaysWhereTheSphereIsStated) {
  EXPECT_GT(on_the_other_side(false, false), kDraws / 20) << "such tips do not tell by themselves";
  EXPECT_EQ(on_the_other_side(true, false), 0);
}

TEST(FitCentre, OfTipsOnOneSideIsOnTheOtherSideOfTheTool) {
  EXPECT_LE(on_the_other_side(false, true), kDraws / 100);
}

TEST(FitCentre, OfTipsAllAroundNeedsNoHintsAndBelievesNoWrongOnes) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    Random random(seed);
    const Vector3d centre(0.6, -0.6, 0.6), far = centre + Vector3d(0.05, 0.0, -0.04);
    auto tips = cap(centre, Vector3d::UnitZ(), 1.6, 20, 0.0, random);
    tips[3] += Vector3d(0.02, 0.0, 0.0);  // gross
    for (const CentreHints& hints :
         {CentreHints{}, CentreHints{&far, 0.01}, CentreHints{&far, 0.0, -Vector3d::UnitZ()}}) {
      const SphereFit fit = fit_centre(tips, std::vector<double>(tips.size(), kRadiusM), hints);
      EXPECT_TRUE(fit.determined);
      EXPECT_LT((fit.centre_m - centre).norm(), 2.5e-3);
    }
  }
}

TEST(FitCentre, IsNotDeterminedByTipsOfOnePlaceOrAPlaneAndStaysNearWhereItIsStated) {
  const Vector3d centre(1.0, 0.0, 0.3), said(1.003, 0.001, 0.302);
  const std::vector<double> radii(6, kRadiusM);
  const std::vector<Vector3d> one(6, centre + Vector3d(0.0, 0.0, kRadiusM));
  SphereFit fit = fit_centre(one, radii, {&said, 0.01});
  EXPECT_FALSE(fit.determined);
  EXPECT_NEAR((fit.centre_m - one[0]).norm(), kRadiusM, 1e-3);
  EXPECT_LT((fit.centre_m - said).norm(), 5e-3);
  EXPECT_FALSE(fit_centre(one, radii).determined);
  EXPECT_EQ(fit_centre(one, radii, {&said, 0.0}).centre_m, said);
  EXPECT_FALSE(fit_centre({}, {}).determined);
}

TEST(OfOneTarget, LeavesOutThoseThatLieApart) {
  const std::vector<double> at = {0.0, 0.1, 5.0, 0.2, 7.0};
  const auto near = [&](std::size_t a, std::size_t b) { return std::abs(at[a] - at[b]) < 1.0; };
  EXPECT_EQ(of_one_target(at.size(), near), (std::vector<std::size_t>{0, 1, 3}));
}

TEST(OfOneTarget, IsTheLargestOfSeveralHeaps) {
  const std::vector<double> at = {0.0, 0.1, 5.0, 7.0, 7.1, 7.2};
  const auto near = [&](std::size_t a, std::size_t b) { return std::abs(at[a] - at[b]) < 1.0; };
  EXPECT_EQ(of_one_target(at.size(), near), (std::vector<std::size_t>{3, 4, 5}));
  EXPECT_TRUE(of_one_target(0, near).empty());
}

TEST(VisiblePlaces, AreNoneWhereTheTouchesOfATargetDoNotSayAndTheWordsAreWhatIsThrown) {
  const Cell& stated = testing::demo_cell();
  Cell cell = stated;
  for (Target& target : cell.targets) target.has_centre = false;
  const ArmModel arm(cell);
  const std::vector<Touch> touches =
      testing::make_touches(stated, testing::plain_truth(stated, 1), {.fit = 40}).touches;
  const auto seen = seen_places(cell, arm, touches);
  ASSERT_TRUE(seen);
  EXPECT_EQ(seen->size(), cell.targets.size());
  const std::vector<Touch> few(touches.begin(), touches.begin() + 4);
  EXPECT_FALSE(seen_places(cell, arm, few));
  const auto error = testing::thrown<IdentifyError>([&] { (void)starting_places(cell, arm, few); });
  EXPECT_EQ(error.kind, IdentifyError::Kind::kUndetermined) << error.what();
  EXPECT_TRUE(std::any_of(few.begin(), few.end(), [&](const Touch& touch) {
    return touch.target == error.target;
  })) << error.target;
}

}  // namespace
}  // namespace cellcal::calib
