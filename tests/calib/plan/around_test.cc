// Variations of a candidate: near it, and feasible as well.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "calib/plan/choose.h"
#include "calib/plan/plan.h"
#include "calib/plan/pool.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;

double angle_rad(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return Eigen::AngleAxisd(a.transpose() * b).angle();
}

TEST(Around, ACandidateAreOthersOfItsTargetWithinTheConeAndTheLimits) {
  PlanOptions options;
  Pool pool(demo_cell(), options, 60);
  const ArmModel& arm = pool.arm();
  const std::size_t before = pool.candidates().size();
  Random random(1);
  constexpr double kByRad = 0.1;
  pool.vary({3, before - 1}, 200, kByRad, random);
  ASSERT_GT(pool.candidates().size(), before + 50);
  ASSERT_LE(pool.candidates().size(), before + 200);
  const Eigen::Vector3d shaft =
      demo_cell().tool.tcp.linear().transpose() * demo_cell().tool.tcp.translation().normalized();
  bool of_both[2] = {false, false};
  for (std::size_t k = before; k < pool.candidates().size(); ++k) {
    const Candidate& c = pool.candidates()[k];
    const Target& target = demo_cell().targets[c.target];
    const Candidate* like = nullptr;
    for (const std::size_t i : {std::size_t{3}, before - 1})
      if (pool.candidates()[i].target == c.target &&
          (like == nullptr ||
           (pool.candidates()[i].normal - c.normal).norm() < (like->normal - c.normal).norm()))
        like = &pool.candidates()[i];
    ASSERT_NE(like, nullptr);
    of_both[like == &pool.candidates()[3] ? 0 : 1] = true;
    // rms in three directions; one in ten thousand is beyond five.
    EXPECT_LT(std::acos(c.normal.dot(like->normal)), 5.0 * kByRad);
    EXPECT_LT(angle_rad(c.orientation, like->orientation), 5.0 * kByRad);
    EXPECT_GT((c.orientation * shaft).dot(-c.normal), std::cos(0.7001));
    const double radius = target.diameter_m / 2.0 + demo_cell().tool.tip_radius_m;
    EXPECT_NEAR((arm.nominal_tip_m(c.contact) - target.centre_m - radius * c.normal).norm(), 0.0,
                1e-8);
    for (const JointVector* q : {&c.contact, &c.standoff, &c.end, &c.clear})
      for (std::size_t i = 0; i < q->size(); ++i) {
        EXPECT_GE((*q)[i], demo_cell().robot.joints[i].min_rad + options.limit_margin_rad - 1e-9);
        EXPECT_LE((*q)[i], demo_cell().robot.joints[i].max_rad - options.limit_margin_rad + 1e-9);
      }
    EXPECT_TRUE(pool.clearance().clear_search(c.clear, c.end, c.target));
  }
  EXPECT_TRUE(of_both[0] && of_both[1]);
}

TEST(Around, WhatIsForgottenLeavesTheRestAsItWas) {
  Pool pool(demo_cell(), {}, 40);
  const std::size_t spread = pool.candidates().size();
  Random random(2);
  pool.vary({0, 1, 2}, 90, 0.2, random);
  const std::vector<std::size_t> kept{spread + 9, 4, spread + 2, spread};
  std::vector<JointVector> before;
  std::vector<bool> connected;
  for (const std::size_t k : kept) {
    before.push_back(pool.candidates()[k].contact);
    connected.push_back(pool.connected(k));
  }
  const std::vector<std::size_t> now = pool.forget(spread, kept);
  EXPECT_EQ(pool.candidates().size(), spread + 3);
  EXPECT_EQ(now, (std::vector<std::size_t>{spread + 2, 4, spread + 1, spread}));
  for (std::size_t i = 0; i < now.size(); ++i) {
    EXPECT_EQ(pool.candidates()[now[i]].contact, before[i]);
    EXPECT_EQ(pool.connected(now[i]), connected[i]);
  }
}

TEST(Around, WhatWasPickedBetterTouchesAreFound) {
  PlanOptions options;
  options.fit_touches = 40;
  options.check_touches = 0;
  Pool pool(demo_cell(), options, 500);
  ChooseOptions how;
  how.count = options.fit_touches;
  how.exchanges = 6;
  how.possible = [&](std::size_t c) { return pool.connected(c); };
  const double spread_out = choose(demo_cell(), pool.candidates(), how).predicted_mean_m;
  const double planned = make_plan(demo_cell(), options).predicted_mean_m;
  std::printf("40 touches: %.3f mm from candidates spread out, %.3f mm as planned\n",
              spread_out * 1e3, planned * 1e3);
  EXPECT_LT(planned, 0.95 * spread_out);
}

}  // namespace
}  // namespace cellcal::calib
