// Control charts over simulated checks: no alarm while nothing changes, for any common offset; an alarm with
// onset, rate and advice for a creep or a step.

#include "calib/check/charts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>

#include "calib/check/drift.h"
#include "calib/files/calibration_json.h"
#include "calib/model/linear.h"

namespace cellcal::calib {
namespace {

std::string state_words(const DriftChart& chart) { return words(state_phrase(chart)); }

constexpr double kSigmaM = 0.025e-3;
constexpr double kDayS = 86400.0;
const Eigen::Vector3d kShared(0.4e-3, -0.3e-3, 0.2e-3);  // common offset left by the calibration

using Trend = std::function<Eigen::Vector3d(double days)>;

Eigen::Vector3d still(double) { return Eigen::Vector3d::Zero(); }

/// Three checks a day.
std::vector<CheckMeasurement> checks_of(int count, const Trend& trend, std::uint64_t seed = 1) {
  Random random(seed);
  std::vector<CheckMeasurement> checks;
  for (int k = 0; k < count; ++k) {
    CheckMeasurement check;
    check.session = 10 + k;
    check.time_s = 1.8e9 + k * kDayS / 3.0;
    check.verdict = CheckVerdict::kHolds;
    check.covariance_m2 = kSigmaM * kSigmaM * Eigen::Matrix3d::Identity();
    check.shift_m = kShared + trend(k / 3.0);
    for (double& one : check.shift_m) one += kSigmaM * random.normal();
    checks.push_back(check);
  }
  return checks;
}

Trend creep(double mm_a_month, double from_day) {
  return [=](double day) {
    return Eigen::Vector3d(0, mm_a_month * 1e-3 * std::max(0.0, day - from_day) / 30.0, 0);
  };
}
Trend step(double mm, double from_day) {
  return [=](double day) { return Eigen::Vector3d(day >= from_day ? mm * 1e-3 : 0.0, 0, 0); };
}

/// Appends an undecided check.
void give_up(std::vector<CheckMeasurement>& checks) {
  CheckMeasurement next = checks.back();
  next.session += 1;
  next.time_s += kDayS / 3.0;
  next.left_out = LeftOut::kUndecided;
  next.verdict = CheckVerdict::kUndecided;
  checks.push_back(next);
}

TEST(DriftCharts, IsUnknownAndNotInControlWhereTheNewestCheckIsUndecided) {
  std::vector<CheckMeasurement> checks = checks_of(9, still);
  give_up(checks);
  const DriftChart chart = drift_chart(checks);
  EXPECT_EQ(chart.undecided, 1U);
  EXPECT_EQ(chart.state, DriftState::kUnknown);
  EXPECT_EQ(chart.advice, DriftAdvice::kCheckAgain);
  EXPECT_NE(state_words(chart).find("last decided check of " + date_words(checks[8].time_s)),
            std::string::npos)
      << state_words(chart);
  EXPECT_EQ(nlohmann::json::parse(drift_to_json(chart)).at("decided_s"), checks[8].time_s);
  CheckMeasurement decided = checks[8];
  decided.time_s = checks.back().time_s + kDayS;
  checks.push_back(decided);
  EXPECT_EQ(drift_chart(checks).state, DriftState::kInControl) << "a check that decides ends it";
}

TEST(DriftCharts, AreAtTheirAlarmLimitInWordsOnlyWhereTheyReachIt) {
  DriftChart chart = drift_chart(checks_of(9, still));
  const auto percent = [&](double share) {
    chart.points.back().share = share;
    const std::string words = state_words(chart), before = "of its checks, ";
    const std::size_t at = words.find(before);
    return at == words.npos
               ? words
               : words.substr(at + before.size(), words.find('%') - at - before.size());
  };
  EXPECT_EQ(percent(0.412), "41 ");
  EXPECT_EQ(percent(0.997), "99.7 ");
  EXPECT_EQ(percent(1.0), "100 ");
}

TEST(DriftCharts, SaysInControlNoLongerThanTwoWeeks) {
  const std::vector<CheckMeasurement> checks = checks_of(9, still);
  const auto at = [&](double days) {
    DriftChart chart = drift_chart(checks);
    age(chart, checks.back().time_s + days * kDayS);
    return chart;
  };
  EXPECT_EQ(at(kMostDays - 0.01).state, DriftState::kInControl);
  EXPECT_EQ(at(-0.9).state, DriftState::kInControl);
  EXPECT_EQ(at(-1.1).state, DriftState::kUnknown) << "a clock that was set back";
  EXPECT_EQ(at(kMostDays + 0.01).state, DriftState::kUnknown);
  EXPECT_EQ(at(kMostDays + 0.01).advice, DriftAdvice::kCheckAgain);
}

/// By (0.8, -0.5, 0.3) mm, so that no check holds.
void knock(std::vector<CheckMeasurement>& checks, std::size_t from) {
  for (std::size_t k = from; k < checks.size(); ++k) {
    const Eigen::Vector3d by_m(0.8e-3, -0.5e-3, 0.3e-3);
    checks[k].shift_m += by_m;
    checks[k].verdict = CheckVerdict::kDoesNotHold;
    checks[k].change = Explanation{.kind = ChangeKind::kTool, .name = "probe", .shift_m = by_m};
    checks[k].tcp_shift_m = by_m.norm();
    checks[k].u_tcp_shift_m = 0.05e-3;
  }
}

TEST(DriftCharts, AlarmsFromTheFirstCheckOnWhereNoneEverHeld) {
  for (const int count : {1, 4, 7, 30}) {
    auto checks = checks_of(count, still);
    knock(checks, 0);
    const DriftChart chart = drift_chart(checks);
    EXPECT_EQ(chart.state, DriftState::kAlarms) << count;
    EXPECT_EQ(chart.counted, 0U) << "no reference is made of what does not hold";
    ASSERT_TRUE(chart.not_held);
    EXPECT_EQ(chart.not_held->since, checks.front().session);
    EXPECT_EQ(chart.not_held->checks, checks.size());
    EXPECT_EQ(chart.advice, DriftAdvice::kReMeasureTcp);
    EXPECT_EQ(state_words(chart).find("alarm: check "), 0U) << state_words(chart);
    EXPECT_NE(state_words(chart).find("does not hold: TCP shift 0.99 ± 0.05 mm (k=2)"),
              std::string::npos)
        << state_words(chart);
    const auto json = nlohmann::json::parse(drift_to_json(chart));
    EXPECT_EQ(json.at("not_held").at("cause").at("kind"), "tool");
    EXPECT_TRUE(json.at("points").back().at("off_mm").is_null()) << "no check held: of no centre";
  }
}

TEST(DriftCharts, StateNoShiftOfTheTcpWhereASphereMoved) {
  auto checks = checks_of(4, still);
  knock(checks, 3);
  checks[3].change =
      Explanation{.kind = ChangeKind::kSphere, .name = "S3", .shift_m = {0.0, 1e-3, 0.0}};
  const std::string words = state_words(drift_chart(checks));
  EXPECT_EQ(words.find("TCP shift"), std::string::npos) << words;
  EXPECT_NE(words.find("does not hold; S3 moved by 1.00"), std::string::npos) << words;
}

TEST(DriftCharts, AlarmsAtTheFirstCheckThatDoesNotHoldAfterSomeThatDid) {
  for (const int held : {1, 3, 4, 5, 20}) {
    auto checks = checks_of(held + 1, still);
    knock(checks, static_cast<std::size_t>(held));
    const DriftChart chart = drift_chart(checks);
    EXPECT_EQ(chart.state, DriftState::kAlarms) << held;
    EXPECT_EQ(chart.counted, static_cast<std::size_t>(held));
    EXPECT_EQ(chart.not_held->since, checks.back().session);
    ASSERT_TRUE(chart.trend) << held;
    EXPECT_EQ(chart.trend->since, checks.back().session) << held;
    EXPECT_NEAR(chart.trend->now_m.norm(), 0.99e-3, 0.1e-3) << held;
  }
}

/// At `days` after the newest check.
Holding holding_at(const std::vector<CheckMeasurement>& checks, double days) {
  const double now_s = checks.back().time_s + days * kDayS;
  DriftChart chart = drift_chart(checks);
  age(chart, now_s);
  return standing_of(chart, checks.front().time_s - kDayS, now_s).holding;
}

TEST(DriftCharts, LetACalibrationHoldAsItsNewestCheckDoesAndForTwoWeeks) {
  for (const int count : {1, 4, 9}) {  // with and without enough checks for a chart
    std::vector<CheckMeasurement> checks = checks_of(count, still);
    EXPECT_EQ(holding_at(checks, 0.1), Holding::kHolds) << count;
    EXPECT_EQ(holding_at(checks, kMostDays + 0.1), Holding::kUnknown) << count;
    EXPECT_EQ(holding_at(checks, -300.0), Holding::kUnknown) << "a clock that was set back";
    give_up(checks);
    EXPECT_EQ(holding_at(checks, 0.1), Holding::kUnknown) << count;
    checks.pop_back();
    knock(checks, checks.size() - 1);
    EXPECT_EQ(holding_at(checks, 0.1), Holding::kDoesNotHold) << count;
    EXPECT_EQ(holding_at(checks, 1000.0), Holding::kDoesNotHold) << "however old";
  }
}

TEST(DriftCharts, LetACalibrationWithoutACheckHoldForTwoWeeks) {
  const double calibrated_s = 1.8e9;
  const Standing fresh = standing_of(drift_chart({}), calibrated_s, calibrated_s + kDayS);
  EXPECT_EQ(fresh.holding, Holding::kHolds);
  EXPECT_FALSE(fresh.by_check);
  EXPECT_EQ(fresh.evidence_s, calibrated_s);
  EXPECT_EQ(fresh.due_s, calibrated_s + kMostDays * kDayS);
  const double late_s = fresh.due_s + 1.0;
  EXPECT_EQ(standing_of(drift_chart({}), calibrated_s, late_s).holding, Holding::kUnknown);
  const double before_s = calibrated_s - 2.0 * kDayS;
  EXPECT_EQ(standing_of(drift_chart({}), calibrated_s, before_s).holding, Holding::kUnknown);
}

TEST(DriftCharts, LetNoCalibrationHoldThatHasCreptAwayNorAnUndecidedCheckSayOtherwise) {
  std::vector<CheckMeasurement> checks = checks_of(90, creep(0.3, 10.0));
  ASSERT_EQ(checks.back().verdict, CheckVerdict::kHolds);
  EXPECT_EQ(holding_at(checks, 0.1), Holding::kDoesNotHold);
  const DriftAdvice advice = drift_chart(checks).advice;
  EXPECT_NE(advice, DriftAdvice::kCheckAgain);
  give_up(checks);
  EXPECT_EQ(holding_at(checks, 0.1), Holding::kDoesNotHold);
  EXPECT_EQ(drift_chart(checks).advice, advice);
  for (CheckMeasurement& check : checks) check.temperature_c = 20.0;
  checks.back().temperature_c = 5.0;  // of a check that found nothing
  EXPECT_EQ(drift_chart(checks).advice, advice);
}

TEST(DriftCharts, LeaveOpenWhetherACalibrationHoldsWhereOneCheckAloneAlarms) {
  const std::vector<CheckMeasurement> checks = checks_of(61, step(0.3, 20.0));
  const DriftChart chart = drift_chart(checks);
  ASSERT_EQ(chart.state, DriftState::kAlarms);
  ASSERT_EQ(chart.advice, DriftAdvice::kCheckAgain);
  EXPECT_EQ(holding_at(checks, 0.1), Holding::kUnknown);
}

TEST(DriftCharts, OfAnAlarmIsNotEndedByAnUndecidedCheck) {
  auto checks = checks_of(8, still);
  knock(checks, 7);
  give_up(checks);
  const DriftChart chart = drift_chart(checks);
  EXPECT_EQ(chart.state, DriftState::kAlarms);
  EXPECT_TRUE(chart.not_held);
  EXPECT_EQ(chart.advice, DriftAdvice::kCheckAgain);
}

TEST(DriftCharts, OfARepairedToolIsInControlOnlyWhenBothStatisticsAreBelowTheirWarnings) {
  const auto still_checks = checks_of(60, still);
  auto checks = std::vector(still_checks.begin(), still_checks.begin() + 9);
  knock(checks, 6);
  std::size_t until_good = 0;
  for (std::size_t k = 9; k < still_checks.size(); ++k) {
    checks.push_back(still_checks[k]);
    const DriftChart chart = drift_chart(checks);
    EXPECT_FALSE(chart.not_held);
    const DriftPoint& newest = chart.points.back();
    const bool below = newest.ewma <= kWarnLimits.ewma && newest.cusum <= kWarnLimits.cusum;
    EXPECT_EQ(chart.state == DriftState::kInControl, below) << k;
    if (chart.state == DriftState::kAlarms) {
      EXPECT_FALSE(chart.trend) << "it was put back: no step, no creep";
      EXPECT_EQ(chart.advice, DriftAdvice::kCheckAgain);
      EXPECT_EQ(state_words(chart).find("alarm of check " + std::to_string(checks[6].session) +
                                        " active: check "),
                0U)
          << state_words(chart);
    }
    if (chart.state != DriftState::kAlarms && until_good == 0) until_good = k - 8;
  }
  EXPECT_GT(until_good, 1U);
  EXPECT_LT(until_good, 15U);
}

TEST(DriftCharts, OfAnAlarmStaysOneHoweverOld) {
  std::vector<CheckMeasurement> checks = checks_of(60, step(0.3, 10.0));
  for (int k = 0; k < 5; ++k) give_up(checks);
  DriftChart chart = drift_chart(checks);
  age(chart, checks.back().time_s + 1000.0 * kDayS);
  EXPECT_EQ(chart.state, DriftState::kAlarms);
}

TEST(DriftCharts, IsSilentWhateverAllChecksShare) {
  const DriftChart chart = drift_chart(checks_of(90, still));
  EXPECT_EQ(chart.state, DriftState::kInControl) << drift_to_json(chart);
  EXPECT_EQ(chart.advice, DriftAdvice::kNone);
  EXPECT_FALSE(chart.trend);
  EXPECT_LT(chart.points.back().off_m.norm(), 4 * kSigmaM)
      << "of the centre, not of the calibration";
}

TEST(DriftCharts, SaysHowManyChecksItLacks) {
  const DriftChart one = drift_chart(checks_of(1, still));
  EXPECT_EQ(one.state, DriftState::kTooFew);
  EXPECT_EQ(state_words(one), "not enough checks: 1 of 5");
  EXPECT_EQ(drift_chart({}).state, DriftState::kTooFew);
  EXPECT_EQ(state_words(drift_chart({})), "not enough checks: 0 of 5");
  EXPECT_EQ(words(state_phrase(one), Language::of("de").value()), "zu wenige Prüfungen: 1 von 5");
  EXPECT_EQ(drift_chart(checks_of(5, still)).state, DriftState::kInControl);
}

/// Mean number of checks until a limit is exceeded, from runs truncated at twelve times the target.
double run_length(const ControlLimits& limits, int runs) {
  double sum = 0.0;
  Random random(7);
  for (int run = 0; run < runs; ++run) {
    Charts charts(std::nullopt);
    CheckMeasurement check;
    for (int k = 1; k <= static_cast<int>(12 * limits.run_length); ++k, ++sum) {
      for (double& one : check.shift_m) one = random.normal();
      const auto at = charts.take(check);
      charts.learn(check);
      if (k >= static_cast<int>(kLeastChecks) && (at.ewma > limits.ewma || at.cusum > limits.cusum))
        break;
    }
  }
  return sum / runs;
}

TEST(DriftCharts, HasLimitsOfTheRunLengthThatIsStated) {
  // 600 nearly exponential runs: 4 % 1 sigma.
  EXPECT_NEAR(run_length(kWarnLimits, 600) / kWarnLimits.run_length, 1.0, 0.15);
  EXPECT_NEAR(run_length(kAlarmLimits, 300) / kAlarmLimits.run_length, 1.0, 0.2);
}

TEST(DriftCharts, FindsACreepLongBeforeASingleCheckDoesAndSaysSinceWhenAndHowFast) {
  const DriftChart chart = drift_chart(checks_of(150, creep(0.1, 20.0)));
  ASSERT_EQ(chart.state, DriftState::kAlarms);
  ASSERT_TRUE(chart.trend);
  EXPECT_EQ(chart.trend->shape, DriftShape::kCreep);
  EXPECT_NEAR(static_cast<double>(chart.trend->since), 70.0, 20.0);
  const double month_s = 30 * kDayS;
  const double rate = chart.trend->rate_m_s.norm() * month_s * 1e3;
  EXPECT_NEAR(rate, 0.1, 3 * chart.trend->rate_sigma_m_s * month_s * 1e3 + 0.01);
  ASSERT_TRUE(chart.alarmed_at);
  // Detected below 0.09 mm.
  EXPECT_LT(*chart.alarmed_at, 70 + 81);
  EXPECT_EQ(chart.advice, DriftAdvice::kReMeasureTcp);
}

TEST(DriftCharts, StatesNoRateOfACreepThatWasWatchedForTwoDays) {
  std::vector<CheckMeasurement> days = checks_of(150, creep(0.1, 20.0));
  for (std::size_t i = 0; i < days.size(); ++i) days[i].time_s = 1200.0 * static_cast<double>(i);
  const DriftChart chart = drift_chart(days);
  ASSERT_TRUE(chart.trend);
  ASSERT_EQ(chart.trend->shape, DriftShape::kCreep);
  EXPECT_FALSE(chart.trend->has_rate());
  EXPECT_EQ(words(trend_phrase(chart)).find("month"), std::string::npos)
      << words(trend_phrase(chart));
  EXPECT_NE(words(trend_phrase(chart)).find("shift of "), std::string::npos)
      << words(trend_phrase(chart));
  EXPECT_TRUE(drift_chart(checks_of(150, creep(0.1, 20.0))).trend->has_rate());
}

TEST(DriftCharts, DoesNotTakeACreepForTheNewNormal) {
  // Three months without change, then a persistent step: reported while it persists.
  const DriftChart chart = drift_chart(checks_of(400, step(0.08, 90.0)));
  EXPECT_EQ(chart.state, DriftState::kAlarms);
  EXPECT_EQ(chart.trend->shape, DriftShape::kStep);
  EXPECT_NEAR(static_cast<double>(chart.trend->since), 280.0, 2.0);
  EXPECT_NEAR(chart.trend->now_m.norm(), 0.08e-3, 0.02e-3);
}

TEST(DriftCharts, IsInControlAgainWhenWhatShiftedWasPutBack) {
  auto checks = checks_of(120, step(0.2, 20.0));
  for (std::size_t k = 65; k < checks.size(); ++k) checks[k].shift_m.x() -= 0.2e-3;
  std::vector<CheckMeasurement> early(checks.begin(), checks.begin() + 64);
  EXPECT_EQ(drift_chart(early).state, DriftState::kAlarms);
  const DriftChart chart = drift_chart(checks);
  EXPECT_EQ(chart.state, DriftState::kInControl);
  EXPECT_FALSE(chart.alarmed_at);
  EXPECT_LT(chart.points.back().off_m.norm(), 4 * kSigmaM);
}

TEST(DriftCharts, AsksForAnotherCheckWhereOneAloneSaysSo) {
  const DriftChart chart = drift_chart(checks_of(61, step(0.3, 20.0)));
  ASSERT_EQ(chart.state, DriftState::kAlarms);
  EXPECT_EQ(chart.trend->checks, 1U);
  EXPECT_EQ(chart.advice, DriftAdvice::kCheckAgain);
}

TEST(DriftCharts, ShowsWhatItLeavesOutAndIsNotMovedByIt) {
  auto checks = checks_of(60, still);
  const DriftChart without = drift_chart(checks);
  CheckMeasurement dirt = checks.back();
  dirt.session = 99;
  dirt.verdict = CheckVerdict::kDoesNotHold;
  dirt.change = Explanation{.kind = ChangeKind::kTouch, .name = "S2"};
  dirt.left_out = LeftOut::kNotTheTool;
  dirt.shift_m = Eigen::Vector3d(1, 1, 1);
  checks.push_back(dirt);
  const DriftChart with = drift_chart(checks);
  EXPECT_EQ(with.points.size(), 61U);
  EXPECT_EQ(with.counted, 60U);
  EXPECT_EQ(with.state, DriftState::kAlarms) << "the newest check does not hold";
  EXPECT_FALSE(with.trend) << "the statistics have nothing of it";
  EXPECT_EQ(with.advice, DriftAdvice::kCheckAgain) << "one touch alone is wrong";
  checks.back().change->kind = ChangeKind::kGrowth;
  EXPECT_EQ(drift_chart(checks).advice, DriftAdvice::kLetItWarmUp);
  checks.back().change->kind = ChangeKind::kJoint;
  EXPECT_EQ(drift_chart(checks).advice, DriftAdvice::kRecalibrate);
  checks.back().verdict = CheckVerdict::kUndecided;
  EXPECT_EQ(drift_chart(checks).advice, DriftAdvice::kCheckAgain);
  CheckMeasurement clean = checks[59];
  clean.session = 100;
  checks.push_back(clean);
  EXPECT_EQ(drift_chart(checks).state, without.state) << "cleaned, and checked again";
}

TEST(DriftCharts, TakesOutWhatTheTemperatureDoesWhereItIsKnown) {
  auto checks = checks_of(150, still);
  for (std::size_t k = 0; k < checks.size(); ++k) {
    const double warmer =
        6.0 * static_cast<double>(k) / 150.0 + std::sin(0.7 * static_cast<double>(k));
    checks[k].shift_m.z() += 0.02e-3 * warmer;
    checks[k].temperature_c = 21.0 + warmer;
  }
  const DriftChart known = drift_chart(checks);
  EXPECT_EQ(known.state, DriftState::kInControl);
  ASSERT_TRUE(known.per_kelvin_m);
  EXPECT_NEAR(known.per_kelvin_m->z(), 0.02e-3, 0.004e-3);
  for (CheckMeasurement& check : checks) check.temperature_c.reset();
  EXPECT_EQ(drift_chart(checks).state, DriftState::kAlarms) << "where it is not known, it creeps";
}

TEST(DriftCharts, StatesATemperatureEffectThatIsNotZero) {
  const auto states = [](double per_kelvin_m) {
    DriftChart chart = drift_chart(checks_of(61, still));
    chart.per_kelvin_m = Eigen::Vector3d(0.0, per_kelvin_m, 0.0);
    const auto lines = words(chart);
    return std::ranges::any_of(
        lines, [](const std::string& line) { return line.find("um/K") != std::string::npos; });
  };
  EXPECT_FALSE(states(0.04e-6));
  EXPECT_TRUE(states(0.06e-6));
}

TEST(DriftCharts, LearnsFromChecksWithoutATemperatureAndAdvisesToLetAColdArmWarmUp) {
  auto checks = checks_of(61, still);
  for (std::size_t k = 0; k < checks.size(); k += 2) checks[k].temperature_c = 21.0;
  EXPECT_EQ(drift_chart(checks).state, DriftState::kInControl);
  for (std::size_t k : {58U, 59U, 60U}) {
    checks[k].temperature_c = 9.0;
    checks[k].shift_m.z() -= 1e-3;
  }
  checks[58].temperature_c = checks[59].temperature_c = std::nullopt;
  const DriftChart cold = drift_chart(checks);
  EXPECT_EQ(cold.state, DriftState::kAlarms);
  EXPECT_EQ(cold.advice, DriftAdvice::kLetItWarmUp);
}

TEST(DriftCharts, LearnsHowMuchChecksScatter) {
  auto checks = checks_of(200, still);
  for (CheckMeasurement& check : checks) check.covariance_m2 /= 4.0;
  EXPECT_NEAR(drift_chart(checks).noise, 2.0, 0.25);
  EXPECT_NEAR(drift_chart(checks_of(200, creep(0.3, 0.0))).noise, 1.0, 0.12)
      << "a creep is no scatter";
}

TEST(DriftCharts, DoesNotCareWhenChecksWereMade) {
  auto checks = checks_of(90, still);
  std::erase_if(checks, [](const CheckMeasurement& check) { return check.session % 7 == 3; });
  for (std::size_t k = 40; k < checks.size(); ++k) checks[k].time_s += 60 * kDayS;
  EXPECT_EQ(drift_chart(checks).state, DriftState::kInControl);
  for (CheckMeasurement& check : checks) check.time_s = 1.8e9;  // all at once
  checks.back().shift_m.x() += 1e-3;
  const DriftChart at_once = drift_chart(checks);
  ASSERT_TRUE(at_once.trend);
  EXPECT_EQ(at_once.trend->shape, DriftShape::kStep);
  for (std::size_t k = 0; k < checks.size(); ++k) {
    checks[k].time_s = 1.8e9 + 60.0 * static_cast<double>(k);  // minutes apart
    checks[k].shift_m.x() += k > 60 ? 1e-5 * static_cast<double>(k - 60) : 0.0;
  }
  const DriftChart in_an_hour = drift_chart(checks);
  ASSERT_TRUE(in_an_hour.trend);
  EXPECT_EQ(in_an_hour.trend->shape, DriftShape::kStep) << "no rate per month of minutes";
  EXPECT_TRUE(std::isfinite(at_once.trend->now_sigma_m));
}

TEST(DriftCharts, AsADocumentHasItsStateTrendLimitsAndWords) {
  auto checks = checks_of(150, creep(0.1, 20.0));
  checks[3].left_out = LeftOut::kUndecided;
  checks[3].verdict = CheckVerdict::kUndecided;
  const auto json = nlohmann::json::parse(drift_to_json(drift_chart(checks)));
  EXPECT_EQ(json.at("format"), "cellcal.drift/1");
  EXPECT_EQ(json.at("state"), "alarms");
  EXPECT_EQ(json.at("advice"), "re_measure_tcp");
  EXPECT_EQ(json.at("counted"), 149);
  EXPECT_NEAR(json.at("course").at("mm_per_month").get<double>(), 0.1, 0.03);
  EXPECT_EQ(json.at("alarms").at("run_length"), 1000);
  ASSERT_EQ(json.at("points").size(), 150U);
  EXPECT_TRUE(json.at("points").at(3).at("off_mm").is_null());
  EXPECT_EQ(json.at("points").at(3).at("left_out"), "undecided");
  EXPECT_TRUE(json.at("points").at(3).at("holds").is_null());
  EXPECT_GT(json.at("points").at(149).at("share").get<double>(), 1.0);
  EXPECT_NE(json.at("words").dump().find("mm/month (k=2) since check"), std::string::npos)
      << json.at("words");
}

}  // namespace
}  // namespace cellcal::calib
