// Latch delay from touches at two speeds; without them, its prior.

#include <gtest/gtest.h>

#include <cmath>

#include "calib/estimate/incremental_estimate.h"
#include "calib/estimate/problem.h"
#include "calib/files/calibration_json.h"
#include "calib/identify/identify.h"
#include "sim/cell/compare.h"
#include "tests/calib/findings.h"
#include "tests/calib/millimetre.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::demo_cell;
using testing::kMm;
using testing::Made;
using testing::make_touches;
using testing::Making;
using testing::plain_truth;

constexpr double kMs = 1e-3;
constexpr double kFast = 0.010, kSlow = 0.002, kDelay = 3.0 * kMs;
constexpr double kNoise = 1e-5;

/// A wire with unknown delay, and precise touches of 0.01 mm.
Cell unknown_wire() {
  Cell cell = demo_cell();
  cell.touch_sigma_m = kNoise;
  cell.latch_delay_sigma_s = 5.0 * kMs;
  return cell;
}

Making two_speeds(unsigned seed) {
  return {.fit = 120,
          .noise_m = kNoise,
          .cone_rad = 1.4,
          .delay_s = kDelay,
          .speed_m_s = kFast,
          .slow_speed_m_s = kSlow,
          .seed = seed};
}

std::vector<Touch> without_speeds(std::vector<Touch> touches) {
  for (Touch& touch : touches) touch.speed_m_s = 0.0;
  return touches;
}

const ParameterResult* delay_of(const Calibration& c) { return find(c, latch_delay_parameter()); }

/// Mean error of the spheres' radii [m].
double radius_off_m(const Calibration& c, const sim::Truth& truth) {
  double off = 0.0;
  for (std::size_t t = 0; t < c.targets.size(); ++t)
    off += (c.targets[t].effective_radius_m - truth.radius_m[t]) /
           static_cast<double>(c.targets.size());
  return off;
}

double workspace_m(const Calibration& c, const sim::Truth& truth,
                   const std::vector<Touch>& touches) {
  std::vector<JointVector> joints;
  for (const Touch& touch : touches) joints.push_back(touch.joint_rad);
  return sim::truth_figures(truth, c, joints).workspace.mean_m;
}

TEST(LatchDelay, IsFoundFromTwoSpeedsAndLeavesTheEffectiveRadiusAlone) {
  constexpr int kCells = 6;
  double squares = 0.0, off = 0.0, off_without = 0.0, m3 = 0.0, m3_without = 0.0;
  for (unsigned seed = 1; seed <= kCells; ++seed) {
    SCOPED_TRACE(seed);
    const Cell cell = unknown_wire();
    const sim::Truth truth = plain_truth(cell, seed);
    const std::vector<Touch> touches = make_touches(cell, truth, two_speeds(seed)).touches;
    const Calibration with = identify(cell, touches);
    const Calibration without = identify(cell, without_speeds(touches));
    const ParameterResult* delay = delay_of(with);
    ASSERT_NE(delay, nullptr);
    EXPECT_EQ(delay->unit, "ms");
    EXPECT_EQ(delay->decided_by, DecidedBy::kData);
    EXPECT_NEAR(delay->correction, kDelay, 3.0 * delay->sigma);
    // If all else were known: 15 of 120 touches determine the slope over 8 mm/s.
    const double least = kNoise / (kFast - kSlow) / std::sqrt(120.0 * 7 / 64);
    EXPECT_GT(delay->sigma, 0.9 * least);
    EXPECT_LT(delay->sigma, 3.0 * least);
    squares += std::pow((delay->correction - kDelay) / delay->sigma, 2);
    EXPECT_EQ(delay_of(without), nullptr);
    off += radius_off_m(with, truth) / kCells;
    off_without += radius_off_m(without, truth) / kCells;
    m3 += workspace_m(with, truth, touches) / kCells;
    m3_without += workspace_m(without, truth, touches) / kCells;
  }
  std::printf("delay: rms %.2f sigma; radius off %.1f um, %.1f without; M3 %.4f mm, %.4f without\n",
              std::sqrt(squares / kCells), 1e6 * off, 1e6 * off_without, m3 / kMm,
              m3_without / kMm);
  EXPECT_LT(squares, 18.5);  // chi^2 of 6: exceeded by 1 in 200
  EXPECT_NEAR(off, 0.0, 0.010 * kMm);
  EXPECT_NEAR(off_without, -kFast * kDelay, 0.012 * kMm);  // 30 um, less the effect of 15 slow ones
  EXPECT_LT(m3, 1.02 * m3_without);
}

/// Touches of a session: with the demo's noise, every eighth slow.
TEST(LatchDelay, OfASessionIsAsSureAsTheReadmeSaysAndCostsNoAccuracy) {
  constexpr int kCells = 8;
  struct Wire {
    double delay_s, sigma_s, least_s, most_s;
  };
  for (const Wire& wire : {Wire{0.15 * kMs, 0.2 * kMs, 0.19 * kMs, 0.2 * kMs},
                           Wire{3.0 * kMs, 5.0 * kMs, 1.0 * kMs, 1.8 * kMs}}) {
    Cell cell = demo_cell();
    cell.latch_delay_sigma_s = wire.sigma_s;
    double sigma_s = 0.0, square_s = 0.0, m3 = 0.0, m3_without = 0.0;
    for (unsigned seed = 1; seed <= kCells; ++seed) {
      const sim::Truth truth = plain_truth(cell, seed);
      const std::vector<Touch> touches = make_touches(cell, truth,
                                                      {.fit = 100,
                                                       .cone_rad = 1.4,
                                                       .delay_s = wire.delay_s,
                                                       .speed_m_s = kFast,
                                                       .slow_speed_m_s = kSlow,
                                                       .seed = seed})
                                             .touches;
      const Calibration with = identify(cell, touches);
      const Calibration without = identify(cell, without_speeds(touches));
      ASSERT_NE(delay_of(with), nullptr);
      sigma_s += delay_of(with)->sigma / kCells;
      const ParameterResult& found = *delay_of(with);
      square_s += std::pow(found.nominal + found.correction - wire.delay_s, 2) / kCells;
      m3 += workspace_m(with, truth, touches) / kCells;
      m3_without += workspace_m(without, truth, touches) / kCells;
    }
    std::printf(
        "prior %.1f ms, true %.2f ms: sigma %.2f ms, true error rms %.2f ms; M3 %.4f mm, "
        "%.4f without\n",
        wire.sigma_s / kMs, wire.delay_s / kMs, sigma_s / kMs, std::sqrt(square_s) / kMs, m3 / kMm,
        m3_without / kMm);
    EXPECT_GT(sigma_s, wire.least_s);
    EXPECT_LE(sigma_s, wire.most_s);
    EXPECT_LT(m3, 1.02 * m3_without);
  }
}

TEST(LatchDelay, IsWhatItsPriorSaysWhereAllTouchesAreOfOneSpeed) {
  Cell cell = demo_cell();
  cell.latch_delay_s = 0.5 * kMs;
  const sim::Truth truth = plain_truth(cell, 3);
  const std::vector<Touch> touches =
      make_touches(cell, truth, {.delay_s = 0.5 * kMs, .speed_m_s = kFast, .seed = 3}).touches;
  const Calibration c = identify(cell, touches);
  const ParameterResult* delay = delay_of(c);
  ASSERT_NE(delay, nullptr);
  EXPECT_EQ(delay->decided_by, DecidedBy::kPrior);
  EXPECT_EQ(delay->nominal, 0.5 * kMs);
  EXPECT_NEAR(delay->sigma, 0.2 * kMs, 1e-3 * 0.2 * kMs);
  EXPECT_NEAR(delay->correction, 0.0, 0.02 * kMs);
  // Delay and radius are separated by the prior only, which is not reported as a fault.
  const Calibration without = identify(cell, without_speeds(touches));
  EXPECT_EQ(c.unidentifiable.size(), without.unidentifiable.size());
  for (const UnidentifiableDirection& one : c.unidentifiable)
    for (const auto& [key, share] : one.direction)
      EXPECT_LT(key == latch_delay_parameter() ? std::abs(share) : 0.0, 1e-3);
  EXPECT_EQ(c.verdict.findings.size(), without.verdict.findings.size())
      << testing::words_of(c) << "\nwithout:\n"
      << testing::words_of(without);
  // The radius includes it: its additional uncertainty is the delay's sigma times the speed.
  const ParameterKey rho = tool_parameter(ParameterKind::kEffectiveRadius, 0);
  EXPECT_GE(find(c, rho)->sigma, find(without, rho)->sigma);
  EXPECT_NEAR(radius_off_m(c, truth), radius_off_m(without, truth) + kFast * 0.5 * kMs,
              0.5e-6);  // the radius's prior retains a tenth of it
}

TEST(LatchDelay, IsNoUnknownWhereNoTouchStatesASpeedOrItIsKnown) {
  Cell cell = demo_cell();
  const sim::Truth truth = plain_truth(cell, 4);
  const std::vector<Touch> silent = make_touches(cell, truth, {.seed = 4}).touches;
  const Calibration usual = identify(cell, silent);
  EXPECT_EQ(delay_of(usual), nullptr);
  cell.latch_delay_sigma_s = 5.0 * kMs;  // without any stated speed
  cell.latch_delay_s = 7.0 * kMs;
  const Calibration other = identify(cell, silent);
  ASSERT_EQ(other.parameters.size(), usual.parameters.size());
  for (std::size_t i = 0; i < usual.parameters.size(); ++i) {
    EXPECT_EQ(other.parameters[i].correction, usual.parameters[i].correction);
    EXPECT_EQ(other.parameters[i].sigma, usual.parameters[i].sigma);
  }
  // Known to be zero: the speeds have no effect. Known delay: the radius is correct again.
  cell.latch_delay_s = cell.latch_delay_sigma_s = 0.0;
  const std::vector<Touch> late =
      make_touches(cell, truth, {.delay_s = kDelay, .speed_m_s = kFast, .seed = 4}).touches;
  const Calibration punctual = identify(cell, late);
  EXPECT_EQ(delay_of(punctual), nullptr);
  cell.latch_delay_s = kDelay;
  const Calibration told = identify(cell, late);
  EXPECT_EQ(delay_of(told), nullptr);
  EXPECT_NEAR(radius_off_m(told, truth) - radius_off_m(punctual, truth), kFast * kDelay,
              0.1 * kFast * kDelay);  // retained by the radius's prior
}

TEST(LatchDelay, MovesATouchByItsSpeedAlongTheApproachAndNothingThatHasNoSurface) {
  Cell cell = demo_cell();
  const sim::Truth truth = plain_truth(cell, 5);
  std::vector<Touch> touches = make_touches(cell, truth, {.fit = 40, .seed = 5}).touches;
  const std::size_t wire = touches.size();
  cell.targets.push_back({});
  cell.targets.back().id = "W";
  cell.targets.back().kind = TargetKind::kWire;
  for (const std::size_t k : {0, 4, 8, 12, 16}) {
    touches.push_back(touches[k]);
    touches.back().target = "W";
    touches.back().radius_m = 0.4;
    touches.back().speed_m_s = kFast;
  }
  const ArmModel arm(cell);
  const std::vector<TargetPlace> places = starting_places(cell, arm, touches);
  const auto residual = [&](std::size_t touch, double delay_s) {
    const Problem problem(cell, arm, touches, places);
    EXPECT_EQ(problem.delay() >= 0, touches[0].speed_m_s > 0.0);
    Eigen::VectorXd x = problem.to_si(Eigen::VectorXd::Zero(problem.size()));
    if (problem.delay() >= 0) x[problem.delay()] = delay_s;
    double r[Problem::kMostRows];
    problem.residual_m(touch, problem.at(x.data()), r, nullptr, nullptr);
    return r[0];
  };
  const double still = residual(0, 0.0), held = residual(wire, 0.0);
  touches[0].speed_m_s = kFast;
  EXPECT_NEAR(residual(0, kDelay) - still, kFast * kDelay, 1e-15);
  EXPECT_EQ(residual(wire, kDelay), held);
  // For an oblique approach: its component along the inward direction.
  const Eigen::Vector3d inward =
      (places[0].centre_m - arm.position(arm.prepare(touches[0].joint_rad), nullptr)).normalized();
  const Eigen::Vector3d along =
      Eigen::AngleAxisd(0.7, inward.unitOrthogonal()).toRotationMatrix() * inward;
  touches[0].approach = {along.x(), along.y(), along.z()};
  EXPECT_NEAR(residual(0, kDelay) - still, kFast * kDelay * std::cos(0.7), 1e-12);
}

TEST(LatchDelay, IsInWhatIsForeseenOfCheckTouchesOfAnotherSpeed) {
  const Cell cell = unknown_wire();
  const sim::Truth truth = plain_truth(cell, 6);
  std::vector<Touch> touches = make_touches(cell, truth, two_speeds(6)).touches;
  const std::size_t fit = touches.size();
  Making fast = two_speeds(16);
  fast.fit = 12;
  fast.speed_m_s = 0.030;  // three times as deep: 0.09 mm, fully corrected
  fast.slow_speed_m_s = 0.0;
  for (Touch& touch : make_touches(cell, truth, fast).touches) {
    touches.push_back(touch);
    touches.back().set = TouchSet::kCheck;
  }
  const Calibration told = identify(cell, touches);
  for (std::size_t i = fit; i < touches.size(); ++i) touches[i].speed_m_s = kFast;
  const Calibration mistaken = identify(cell, touches);
  EXPECT_EQ(told.check.count, 12);
  EXPECT_LT(told.check.rms_m, 0.04 * kMm);
  EXPECT_GT(mistaken.check.rms_m, 0.05 * kMm);
}

TEST(LatchDelay, BeginsWithTheFirstTouchThatStatesASpeedAlsoOneByOne) {
  const Cell cell = unknown_wire();
  const sim::Truth truth = plain_truth(cell, 7);
  std::vector<Touch> touches = make_touches(cell, truth, two_speeds(7)).touches;
  for (std::size_t i = 0; i < 30; ++i) touches[i].speed_m_s = 0.0;
  IncrementalEstimate running(cell, {touches.begin(), touches.begin() + 30});
  EXPECT_LT(running.problem().delay(), 0);
  EXPECT_TRUE(running.add(touches[30]).anew);
  ASSERT_GE(running.problem().delay(), 0);
  EXPECT_EQ(running.touches().size(), 31u);
  for (std::size_t i = 31; i < 60; ++i) (void)running.add(touches[i]);
  const int at = running.problem().delay();
  EXPECT_LT(std::sqrt(running.covariance_si()(at, at)), cell.latch_delay_sigma_s);
}

TEST(LatchDelay, StandsInTheCalibrationsFileInMilliseconds) {
  Cell cell = unknown_wire();
  cell.latch_delay_s = 1.0 * kMs;
  const sim::Truth truth = plain_truth(cell, 8);
  const Calibration c = identify(cell, make_touches(cell, truth, two_speeds(8)).touches);
  const std::string json = calibration_to_json(c);
  EXPECT_NE(json.find("\"latch_delay\""), std::string::npos);
  EXPECT_NE(json.find("\"ms\""), std::string::npos);
  const Calibration back = calibration_from_json(json, "c.json");
  const ParameterResult &one = *delay_of(c), &again = *delay_of(back);
  EXPECT_NEAR(again.nominal, 1.0 * kMs, 1e-15);
  EXPECT_NEAR(again.correction, one.correction, 1e-12);
  EXPECT_NEAR(again.sigma, one.sigma, 1e-12);
  EXPECT_EQ(back.cell.latch_delay_sigma_s, cell.latch_delay_sigma_s);
}

}  // namespace
}  // namespace cellcal::calib
