// A lever of 1 m that rotates about the vertical at constant speed, and a ball on its circle: the
// instants of contact are known analytically.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "sim/cell/physical_cell.h"

namespace cellcal::sim {
namespace {

using drivers::Duration;
using drivers::TimePoint;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr double kRadius = 0.03;
constexpr double kBallAt = 0.5;  // rad, on the circle
constexpr double kSpeed = 0.2;   // rad/s
constexpr TimePoint kStart{std::chrono::hours{1}};
constexpr Duration kCycle = milliseconds{4};

PhysicalCell lever() {
  calib::Robot robot;
  robot.joints.resize(1);
  robot.joints[0].name = "A1";
  robot.joints[0].a_m = 1.0;
  Truth truth{calib::ArmModel(robot, calib::Tool{}), Eigen::VectorXd(0), {}, {}};
  truth.centre_m = {{std::cos(kBallAt), std::sin(kBallAt), 0.0}};
  truth.radius_m = {kRadius};
  return PhysicalCell(std::move(truth));
}

/// Half the angle covered by the ball on the circle: the chord 2 sin(x/2) is its radius.
double half_angle() { return 2.0 * std::asin(kRadius / 2.0); }

TimePoint when(double angle) { return kStart + nanoseconds(std::llround(angle / kSpeed * 1e9)); }

std::vector<double> swinging(TimePoint t) {
  return {kSpeed * std::chrono::duration<double>(t - kStart).count()};
}

struct Edge {
  TimePoint t;
  bool closed;
};

TEST(PhysicalCell, KnowsTheGapOnTheCircle) {
  const PhysicalCell cell = lever();
  for (const double angle : {0.0, 0.3, 0.46, 0.5, 0.7}) {
    const double chord = 2.0 * std::sin(std::abs(angle - kBallAt) / 2.0);
    EXPECT_NEAR(cell.gap_m(std::vector{angle}), chord - kRadius, 1e-14) << angle;
  }
  EXPECT_NEAR(
      (cell.tip_m(std::vector{0.25}) - Eigen::Vector3d(std::cos(0.25), std::sin(0.25), 0.0)).norm(),
      0.0, 1e-15);
}

TEST(PhysicalCell, TakesTheNearestOfSeveralSpheresAndNoOtherTargets) {
  Truth truth = lever().truth();
  truth.centre_m.push_back({1.0, 0.1, 0.0});
  truth.radius_m.push_back(0.02);
  truth.centre_m.push_back({1.0, 0.0, 0.0});  // a socket: does not close the circuit
  truth.radius_m.push_back(0.0);
  EXPECT_NEAR(PhysicalCell(truth).gap_m(std::vector{0.0}), 0.08, 1e-14);
}

TEST(PhysicalCell, FeelsAPlateOnItsFaceAndBesideItsRim) {
  Truth truth = lever().truth();  // the tip swings from (1, 0, 0) to +y
  truth.radius_m.assign(1, 0.0);
  // Its face points to -y at y = 0.5, and its tips are balls of 2 mm.
  truth.faces.push_back({{1.0, 0.5, 0.0}, {0.0, -1.0, 0.0}, 0.2, 0.002});
  const PhysicalCell cell(truth);
  EXPECT_NEAR(cell.gap_m(std::vector{0.0}), 0.498, 1e-12);
  const double at = std::asin(0.498);
  EXPECT_NEAR(cell.gap_m(std::vector{at}), 0.0, 1e-12);
  EXPECT_LT(cell.gap_m(std::vector{at + 0.01}), 0.0);
  // A smaller one, whose rim is passed at 34 mm.
  truth.faces[0].reach_m = 0.1;
  EXPECT_NEAR(PhysicalCell(truth).gap_m(std::vector{std::asin(0.5)}),
              1.0 - std::cos(std::asin(0.5)) - 0.1 - 0.002, 1e-12);
}

TEST(ContactWatch, FindsBothEdgesToAHundredNanoseconds) {
  const PhysicalCell cell = lever();
  std::vector<Edge> edges;
  ContactWatch watch(cell, [&](TimePoint t, bool closed) { edges.push_back({t, closed}); });
  for (TimePoint t = kStart; t < when(1.0); t += kCycle) watch.update(t, t + kCycle, swinging);
  ASSERT_EQ(edges.size(), 2u);
  EXPECT_TRUE(edges[0].closed);
  EXPECT_FALSE(edges[1].closed);
  EXPECT_LE(std::abs((edges[0].t - when(kBallAt - half_angle())).count()), 101);
  EXPECT_LE(std::abs((edges[1].t - when(kBallAt + half_angle())).count()), 101);
  EXPECT_FALSE(watch.closed());
  EXPECT_EQ(watch.crashes(), 0);
  EXPECT_NEAR(watch.deepest_m(), kRadius, 1e-5);  // through the centre, within a cycle
}

TEST(ContactWatch, FindsTheInstantWhereverItLiesInTheCycle) {
  const PhysicalCell cell = lever();
  const TimePoint contact = when(kBallAt - half_angle());
  for (int share = 1; share < 100; ++share) {
    std::vector<Edge> edges;
    ContactWatch watch(cell, [&](TimePoint t, bool closed) { edges.push_back({t, closed}); });
    const TimePoint from = contact - kCycle * share / 100;
    watch.update(from, from + kCycle, swinging);
    ASSERT_EQ(edges.size(), 1u) << share;
    EXPECT_LE(std::abs((edges[0].t - contact).count()), 101) << share;
    EXPECT_TRUE(watch.closed());
  }
}

TEST(ContactWatch, ReportsTheEdgeWhenTheCircuitIsClosedAlready) {
  const PhysicalCell cell = lever();
  const TimePoint contact = when(kBallAt - half_angle());
  std::vector<Edge> edges;
  ContactWatch watch(cell, [&](TimePoint t, bool closed) { edges.push_back({t, closed}); });
  watch.update(contact - milliseconds{2}, contact + milliseconds{2}, swinging);
  watch.update(contact + milliseconds{2}, contact + milliseconds{6}, swinging);
  EXPECT_EQ(edges.size(), 1u);  // still closed: no second edge
}

TEST(ContactWatch, AMotionThatStopsShortReportsNothing) {
  const PhysicalCell cell = lever();
  int edges = 0;
  ContactWatch watch(cell, [&](TimePoint, bool) { ++edges; });
  const double short_of = kBallAt - half_angle() - 1e-6;
  watch.update(kStart, kStart + kCycle, [&](TimePoint) { return std::vector{short_of}; });
  EXPECT_EQ(edges, 0);
  EXPECT_EQ(watch.deepest_m(), 0.0);
}

/// The lever with a shaft of 0.3 m hanging from its flange, its tip at the circle's height.
PhysicalCell lever_with_shaft(double ball_height_m) {
  calib::Robot robot;
  robot.joints.resize(1);
  robot.joints[0].name = "A1";
  robot.joints[0].a_m = 1.0;
  robot.joints[0].d_m = 0.3;
  calib::Tool tool;
  tool.tcp.translation() = Eigen::Vector3d(0, 0, -0.3);
  Truth truth{calib::ArmModel(robot, tool), Eigen::VectorXd(0), {}, {}};
  truth.centre_m = {{std::cos(kBallAt), std::sin(kBallAt), ball_height_m}};
  truth.radius_m = {kRadius};
  return PhysicalCell(std::move(truth));
}

TEST(PhysicalCell, MeasuresTheShaftInsideASphereAsACylinderAboveTheTip) {
  constexpr double kNeckRadius = 0.012, kTipLength = 0.06;
  const PhysicalCell high = lever_with_shaft(0.15);
  EXPECT_NEAR(high.shaft_depth_m(std::vector{kBallAt}), kRadius + kNeckRadius, 1e-12);
  EXPECT_EQ(high.shaft_depth_m(std::vector{kBallAt - 0.1}), 0.0);
  // The slim end may be inside the sphere.
  EXPECT_EQ(lever_with_shaft(-0.01).shaft_depth_m(std::vector{kBallAt}), 0.0);
  EXPECT_NEAR(lever_with_shaft(0.0).shaft_depth_m(std::vector{kBallAt}),
              std::max(0.0, kRadius + kNeckRadius - kTipLength), 1e-12);
  EXPECT_EQ(lever().shaft_depth_m(std::vector{kBallAt}), 0.0);  // without a shaft
}

TEST(ContactWatch, CountsACrashOnceAndNotWhenItGoesOn) {
  const PhysicalCell cell = lever_with_shaft(0.15);
  int edges = 0;
  ContactWatch watch(cell, [&](TimePoint, bool) { ++edges; });
  for (TimePoint t = kStart; t < when(1.0); t += kCycle) watch.update(t, t + kCycle, swinging);
  EXPECT_EQ(watch.crashes(), 1);
  EXPECT_EQ(edges, 0);  // the tip itself never entered
}

TEST(PhysicalCell, GrowsWithWarmthInAllLengthsOfTheArmAndNotOfTheTool) {
  const Truth cold = lever_with_shaft(0.15).truth();  // 1 m out, 0.3 m up, the tool 0.3 m down
  Truth truth = cold;
  truth.growth = 1e-3;
  const PhysicalCell cell(truth);
  const std::vector<double> q{0.0};
  EXPECT_EQ(cell.tip_m(q), PhysicalCell(cold).tip_m(q));
  EXPECT_NEAR((cell.tip_m(q, 1.0) - Eigen::Vector3d(1.001, 0.0, 0.0003)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((cell.tip_m(q, 0.5) - Eigen::Vector3d(1.0005, 0.0, 0.00015)).norm(), 0.0, 1e-12);
}

/// One motion to the ball and back, as in a search: true gap at the start of each closing.
struct Swings {
  explicit Swings(const Truth& truth)
      : cell(truth), watch(cell, [this](TimePoint, bool closed) {
          edge = closed;
          ++edges;
        }) {}

  /// To the ball from `from_m` away until contact; the gap there. Then back by `back_m`.
  double touch(double from_m, double back_m) {
    const double ball = kBallAt - half_angle();
    const double step = 1e-5;  // rad, of a lever of 1 m
    double angle = ball - from_m;
    edge = false;
    while (!edge && angle < ball + 0.005) move(angle + step, angle);
    const double gap = cell.gap_m(std::vector{angle});
    const double end = angle - back_m;
    while (angle > end) move(angle - 1e-4, angle);
    return gap;
  }

  void move(double to, double& angle) {
    const double from = angle;
    watch.update(now, now + kCycle, [&](TimePoint t) {
      const double share = std::chrono::duration<double>(t - now) / kCycle;
      return std::vector{from + share * (to - from)};
    });
    now += kCycle;
    angle = to;
  }

  PhysicalCell cell;
  ContactWatch watch;
  TimePoint now = kStart;
  bool edge = false;
  int edges = 0;
};

TEST(Contacts, ScatterAnewWithEveryClosing) {
  Truth truth = lever().truth();
  truth.contacts.noise_m = 0.03e-3;
  Swings swings(truth);
  double sum = 0.0, squares = 0.0;
  constexpr int kTouches = 200;
  for (int i = 0; i < kTouches; ++i) {
    const double gap = swings.touch(0.001, 0.001);  // never far away: repeated closings
    sum += gap;
    squares += gap * gap;
  }
  const double mean = sum / kTouches;
  EXPECT_NEAR(mean, -0.005e-3, 0.008e-3);  // the step of the motion
  EXPECT_NEAR(std::sqrt(squares / kTouches - mean * mean), 0.03e-3, 0.005e-3);
}

TEST(Contacts, OfOneVisitHaveOneChipOrLoseIt) {
  Truth truth = lever().truth();
  truth.contacts.bad_share = 1.0;
  Swings swings(truth);
  swings.touch(0.01, 0.01);  // chips are drawn for visits from a distance
  int stayed = 0, fell = 0;
  for (int i = 0; i < 60; ++i) {
    const double first = swings.touch(0.01, 0.001);
    const double again = swings.touch(0.001, 0.01);
    EXPECT_GT(first, 0.28e-3);
    EXPECT_LT(first, 1.01e-3);
    (std::abs(again - first) < 0.02e-3 ? stayed : fell) += 1;
    if (std::abs(again - first) >= 0.02e-3) {
      EXPECT_NEAR(again, 0.0, 0.02e-3);
    }
  }
  EXPECT_GT(stayed, 15);
  EXPECT_GT(fell, 15);
}

TEST(Contacts, AreBadInTheShareAskedForAndNeverBounce) {
  Truth truth = lever().truth();
  truth.contacts = {0.03e-3, 0.1};
  int bad = 0;
  Swings swings(truth);
  constexpr int kVisits = 500;
  for (int i = 0; i < kVisits; ++i) bad += swings.touch(0.006, 0.006) > 0.2e-3 ? 1 : 0;
  EXPECT_NEAR(bad, 50, 25);
  EXPECT_EQ(swings.edges, 2 * kVisits);
}

}  // namespace
}  // namespace cellcal::sim
