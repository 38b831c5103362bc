// A sphere that is knocked during a session is named, with size and time; a stationary one is not.

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "calib/identify/identify.h"
#include "calib/identify/identify_once.h"
#include "calib/identify/jump.h"
#include "calib/verdict/session_order.h"
#include "tests/calib/findings.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::found;
using testing::make_touches;
using testing::Making;
using testing::plain_truth;
using testing::the;
using testing::words_of;

constexpr std::size_t kMovedAt = 48;

/// A hundred touches, spheres in turn; sphere `target` is displaced from touch kMovedAt on.
std::vector<Touch> knocked(std::size_t target, const Eigen::Vector3d& shift_m, unsigned seed,
                           Making making = {}) {
  making.fit = 100;
  making.seed = seed;
  const sim::Truth before = plain_truth(demo_cell(), seed);
  sim::Truth after = before;
  after.centre_m[target] += shift_m;
  auto touches = make_touches(demo_cell(), before, making).touches;
  const auto later = make_touches(demo_cell(), after, making).touches;
  for (std::size_t i = kMovedAt; i < touches.size(); ++i)
    if (touches[i].target == demo_cell().targets[target].id) touches[i] = later[i];
  return touches;
}

TEST(MovedTarget, OfTwoTenthsIsNamedWithSizeSideAndTouchThoughAllElseIsWell) {
  int named = 0, otherwise_fine = 0;
  constexpr int kRuns = 10;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    const std::size_t target = seed % 4;
    const Eigen::Vector3d shift(0.114e-3, -0.136e-3, 0.092e-3);
    const auto touches = knocked(target, shift, seed);
    otherwise_fine += identify_single_pass(demo_cell(), touches).verdict.publish();
    const Calibration c = identify(demo_cell(), touches);
    if (c.moved.empty()) continue;
    ++named;
    const MovedTarget& moved = c.moved[0];
    EXPECT_EQ(moved.target, demo_cell().targets[target].id) << seed;
    EXPECT_LT((moved.shift_m - shift).norm(), 6.0 * moved.sigma_m) << seed;
    EXPECT_LT(moved.sigma_m, 0.05e-3) << seed;
    EXPECT_GT(moved.squared_sigmas, 25.0) << seed;
    // Within two touches of that sphere, which is every fourth.
    EXPECT_NEAR(static_cast<double>(moved.after_touch), kMovedAt, 8.0) << seed;
    EXPECT_FALSE(c.verdict.publish());
    const Finding& finding = c.verdict.findings[0];
    EXPECT_EQ(finding.kind, FindingKind::kMovedTarget) << words_of(c);
    EXPECT_EQ(finding.about.name, moved.target);
    EXPECT_EQ(finding.about.touch, moved.after_touch);
    EXPECT_NEAR(value(finding.evidence, "shift"), moved.shift_m.norm() * 1e3, 1e-9);
  }
  std::printf("moved by 0.2 mm: %d of %d named, %d otherwise publishable\n", named, kRuns,
              otherwise_fine);
  EXPECT_GE(named, 8);
  EXPECT_EQ(otherwise_fine, kRuns);
}

TEST(MovedTarget, OfHalfAMillimetreIsNamedThoughSomeOfItsTouchesAreLeftOut) {
  for (unsigned seed = 11; seed <= 14; ++seed) {
    const std::size_t target = seed % 4;
    const auto touches = knocked(target, {0.3e-3, 0.3e-3, -0.25e-3}, seed);  // 0.49 mm
    const Calibration c = identify(demo_cell(), touches);
    EXPECT_FALSE(c.verdict.publish());
    ASSERT_EQ(c.moved.size(), 1u) << words_of(c);
    EXPECT_EQ(c.moved[0].target, demo_cell().targets[target].id);
    EXPECT_NEAR(c.moved[0].shift_m.norm(), 0.49e-3, 0.08e-3);
    // The lengths are correct.
    EXPECT_FALSE(found(c, FindingKind::kCertifiedLength)) << words_of(c);
    EXPECT_EQ(find(the(c, FindingKind::kMovedTarget).evidence, "or_lengths"), nullptr);
  }
}

TEST(MovedTarget, IsNamedWhateverOtherTargetsAreCalled) {
  constexpr unsigned kSeed = 11;
  constexpr std::size_t kTarget = 3;
  auto touches = knocked(kTarget, {0.3e-3, 0.3e-3, -0.25e-3}, kSeed);
  Cell cell = demo_cell();
  const std::string id = cell.targets[kTarget].id, other = cell.targets[0].id;
  cell.targets[0].id = id + " later";
  for (CertifiedLength& length : cell.lengths)
    for (std::string* end : {&length.from, &length.to})
      if (*end == other) *end = cell.targets[0].id;
  for (Touch& touch : touches)
    if (touch.target == other) touch.target = cell.targets[0].id;
  const Calibration c = identify(cell, touches);
  ASSERT_EQ(c.moved.size(), 1u) << words_of(c);
  EXPECT_EQ(c.moved[0].target, id);
}

TEST(MovedTarget, IsNamedAtAModelLevelThatWasAskedFor) {
  constexpr std::size_t kTarget = 3;
  const auto touches = knocked(kTarget, {0.3e-3, 0.3e-3, -0.25e-3}, 11);
  IdentifyOptions stiff;
  stiff.level = ModelLevel{0.0, 1.0, 0.0};
  const Calibration c = identify(demo_cell(), touches, stiff);
  ASSERT_EQ(c.moved.size(), 1u) << words_of(c);
  EXPECT_EQ(c.moved[0].target, demo_cell().targets[kTarget].id);
}

TEST(MovedTarget, IsNotSeenWhereNothingMoved) {
  for (unsigned seed = 21; seed <= 40; ++seed) {
    const auto touches = knocked(0, Eigen::Vector3d::Zero(), seed);
    const Calibration c = identify(demo_cell(), touches);
    EXPECT_TRUE(c.moved.empty()) << seed << "\n" << words_of(c);
    EXPECT_TRUE(c.verdict.publish()) << seed << "\n" << words_of(c);
  }
}

TEST(MovedTarget, IsNotMadeOfGrossErrors) {
  for (unsigned seed = 41; seed <= 60; ++seed) {
    const auto touches = knocked(0, Eigen::Vector3d::Zero(), seed, {.outlier_share = 0.05});
    EXPECT_TRUE(identify(demo_cell(), touches).moved.empty()) << seed;
  }
}

TEST(MovedTarget, IsNotMadeOfGrossErrorsThatFallTogether) {
  for (unsigned seed = 31; seed <= 36; ++seed) {
    Making making;
    making.fit = 200;
    making.seed = seed;
    auto touches = make_touches(demo_cell(), plain_truth(demo_cell(), seed), making).touches;
    std::vector<std::size_t> own;
    for (std::size_t i = 0; i < touches.size(); ++i)
      if (touches[i].set == TouchSet::kFit && touches[i].target == "S2") own.push_back(i);
    // Three of the last five, all on one side, and one long before.
    const std::size_t last = own.size();
    double gross_rad = 0.8e-3;  // a millimetre at a metre, and more
    for (const std::size_t k : {last - 1, last - 3, last - 5, last / 2})
      touches[own[k]].joint_rad[0] += gross_rad += 0.2e-3;
    const Calibration c = identify(demo_cell(), touches);
    EXPECT_TRUE(c.moved.empty()) << seed << " " << words_of(c);
  }
}

TEST(MovedTarget, IsFoundByTimeWhateverTheOrderOfTheRows) {
  auto touches = knocked(1, {0.15e-3, -0.12e-3, 0.08e-3}, 3);
  for (std::size_t i = 0; i < touches.size(); ++i)
    touches[i].time = "2026-01-01T00:" + std::to_string(10 + i / 60) + ":" +
                      std::to_string(10 + i % 60 / 2) + "Z";
  const Calibration straight = identify(demo_cell(), touches);
  ASSERT_EQ(straight.moved.size(), 1u);
  const std::string when = touches[straight.moved[0].after_touch].time;
  std::reverse(touches.begin(), touches.end());
  const Calibration reversed = identify(demo_cell(), touches);
  ASSERT_EQ(reversed.moved.size(), 1u);
  EXPECT_EQ(touches[reversed.moved[0].after_touch].time, when);
  EXPECT_LT((reversed.moved[0].shift_m - straight.moved[0].shift_m).norm(), 1e-6);
  // The row is no place in the session.
  const auto rank = static_cast<double>(straight.moved[0].after_touch + 1);
  // Touches of one second are in the order of the rows.
  EXPECT_NEAR(value(reversed.verdict.findings[0].evidence, "rank"), rank, 1.0)
      << words_of(reversed);
  EXPECT_EQ(find(straight.verdict.findings[0].evidence, "rank"), nullptr);
}

TEST(MovedTarget, IsOnlySuspectedWhereNobodyLooksCloser) {
  const auto touches = knocked(2, {0.15e-3, -0.12e-3, 0.08e-3}, 3);
  const Calibration c = identify_single_pass(demo_cell(), touches);
  ASSERT_FALSE(c.moved.empty());
  EXPECT_EQ(c.moved[0].target, "S3");
  EXPECT_EQ(c.moved[0].shift_m.norm(), 0.0);
  EXPECT_TRUE(c.verdict.publish());
}

TEST(ShareOf, ManyTouchesHoldsOfEachTargetFitAndCheckTouchesAlike) {
  std::vector<Touch> touches(4500);
  for (std::size_t i = 0; i < touches.size(); ++i) {
    touches[i].target = std::string("S") + "1234"[i % 4];
    touches[i].set = i % 5 == 0 ? TouchSet::kCheck : TouchSet::kFit;
  }
  std::map<std::pair<std::string, TouchSet>, int> held;
  const std::vector<std::size_t> share = share_of(touches, 1000);
  EXPECT_TRUE(std::is_sorted(share.begin(), share.end()));
  for (const std::size_t i : share) ++held[{touches[i].target, touches[i].set}];
  EXPECT_EQ(held.size(), 8u);
  for (const auto& [which, count] : held)
    EXPECT_NEAR(count, which.second == TouchSet::kFit ? 180 : 45, 1) << which.first;
}

TEST(ShareOf, FewTouchesIsAllOfThem) {
  EXPECT_EQ(share_of(std::vector<Touch>(1000), 1000).size(), 1000u);
  EXPECT_TRUE(share_of({}, 1000).empty());
}

}  // namespace
}  // namespace cellcal::calib
