// The order of visits is near-optimal, and its cost is as stated.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "calib/files/files.h"
#include "calib/model/linear.h"
#include "calib/plan/duration.h"
#include "calib/plan/visit.h"

namespace cellcal::calib {
namespace {

double length(const Eigen::MatrixXd& cost, const Eigen::VectorXd& from_start,
              const std::vector<std::size_t>& order) {
  double sum = from_start[static_cast<Eigen::Index>(order.front())];
  for (std::size_t k = 1; k < order.size(); ++k)
    sum += cost(static_cast<Eigen::Index>(order[k - 1]), static_cast<Eigen::Index>(order[k]));
  return sum;
}

struct Places {
  Eigen::MatrixXd cost;
  Eigen::VectorXd from_start;
};

/// Points in a square; uphill costs more.
Places places(int count, Random& random) {
  std::vector<Eigen::Vector2d> at;
  for (int i = 0; i <= count; ++i) at.emplace_back(random.uniform(), random.uniform());
  const auto way = [&](std::size_t a, std::size_t b) {
    return (at[a] - at[b]).norm() + 0.3 * std::max(0.0, at[b].y() - at[a].y());
  };
  Places p{Eigen::MatrixXd(count, count), Eigen::VectorXd(count)};
  for (int i = 0; i < count; ++i) {
    p.from_start[i] = way(static_cast<std::size_t>(count), static_cast<std::size_t>(i));
    for (int j = 0; j < count; ++j)
      p.cost(i, j) = way(static_cast<std::size_t>(i), static_cast<std::size_t>(j));
  }
  return p;
}

TEST(Order, OfFewVisitsIsTheShortestOrNext) {
  Random random(1);
  constexpr int kRuns = 30;
  double worst = 0.0, mean = 0.0;
  for (int k = 0; k < kRuns; ++k) {
    const Places p = places(7, random);
    std::vector<std::size_t> any(7);
    std::iota(any.begin(), any.end(), 0U);
    double best = 1e9;
    do best = std::min(best, length(p.cost, p.from_start, any));
    while (std::next_permutation(any.begin(), any.end()));
    const double ratio = length(p.cost, p.from_start, short_order(p.cost, p.from_start)) / best;
    worst = std::max(worst, ratio);
    mean += ratio / kRuns;
  }
  EXPECT_LT(worst, 1.2);
  EXPECT_LT(mean, 1.03);
}

TEST(Order, VisitsAllOnceAndMuchShorterThanInAnyOrder) {
  Random random(2);
  const Places p = places(150, random);
  std::vector<std::size_t> order = short_order(p.cost, p.from_start);
  const double found = length(p.cost, p.from_start, order);
  std::sort(order.begin(), order.end());
  std::vector<std::size_t> all(150);
  std::iota(all.begin(), all.end(), 0U);
  EXPECT_EQ(order, all);
  EXPECT_LT(found, 0.25 * length(p.cost, p.from_start, all));
}

TEST(Order, OfNothingIsNothing) {
  EXPECT_TRUE(short_order(Eigen::MatrixXd(0, 0), Eigen::VectorXd(0)).empty());
}

TEST(Duration, OfAMoveIsThatOfItsSlowestAxisWithItsRamps) {
  const Robot robot = load_robot(std::string(CELLCAL_ROBOTS_FOLDER) + "/kr5_r1400.toml");
  Pace pace;
  const JointVector zero(6, 0.0);
  EXPECT_EQ(move_s(robot, zero, zero, pace), 0.0);
  JointVector to = zero;
  to[0] = 6.0;
  const double speed = robot.joints[0].max_speed_rad_s;
  const double expected = 6.0 / speed + pace.ramp_s + pace.build_up_s;
  EXPECT_NEAR(move_s(robot, zero, to, pace), expected, 1e-12);
  to[5] = 0.01;  // a short turn of another axis costs nothing
  EXPECT_NEAR(move_s(robot, zero, to, pace), expected, 1e-12);
  pace.speed_fraction = 0.1;
  EXPECT_GT(move_s(robot, zero, to, pace), 5.0 * 6.0 / speed);
}

TEST(Duration, OfAPlanCountsTheSlowestAxisOfEachTurnOfThePositioner) {
  Robot robot = load_robot(CELLCAL_POSITIONER_ROBOT);
  robot.positioner[1].max_speed_rad_s = 0.5;
  Plan plan;
  plan.start.assign(6, 0.0);
  PlannedTouch touch;
  touch.standoff = touch.end = touch.clear = plan.start;
  plan.touches = {touch, touch};
  const double still_s = duration_s(plan, robot, {});
  plan.touches[1].wait_rad = {0.1, -1.0};
  plan.touches[1].positioner_rad = {0.2, 1.0};
  const Pace pace;
  EXPECT_NEAR(duration_s(plan, robot, pace) - still_s, 2.0 / 0.5 + pace.ramp_s + pace.build_up_s,
              1e-9);
}

}  // namespace
}  // namespace cellcal::calib
