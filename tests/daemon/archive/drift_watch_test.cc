// The control chart from a journal: checks included, report of a creeping tool, restart of the chart.

#include "daemon/archive/drift_watch.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "calib/check/charts.h"
#include "calib/files/input_file.h"
#include "calib/result/drift_chart.h"
#include "tests/daemon/archive/checked_journal.h"

namespace cellcal::daemon {
namespace {

using calib::ChangeKind;
using calib::DriftAdvice;
using calib::DriftState;
using calib::LeftOut;
using Checked = testing::CheckedJournal;

struct AWatch : ::testing::Test {
  std::shared_ptr<const Drift> evaluate() { return watch.evaluate(); }
  void checks(int count, double creep_m = 0.0) {
    for (int k = 1; k <= count; ++k) checked.check({.shift_m = {k * creep_m, 0, 0}});
  }
  testing::CheckedJournal checked;
  DriftWatch watch{checked.journal, [this] { return now_s; }};
  double now_s = 1'600'000'000.0 + 10.0 * 86400.0;  ///< some days after the checks
};

TEST_F(AWatch, HasNoChartWithoutAPublishedCalibration) {
  Journal empty(checked.dir / "empty.db");
  DriftWatch of_it(empty);
  EXPECT_EQ(of_it.evaluate(), nullptr);
  EXPECT_EQ(watch.evaluate("/another.toml"), nullptr);
}

TEST_F(AWatch, CountsTheChecksOfTheNewestCalibrationAndBeginsAnewWithTheNext) {
  EXPECT_EQ(evaluate()->chart.counted, 0U);
  checks(6);
  EXPECT_EQ(evaluate()->calibrated, checked.calibrated);
  EXPECT_EQ(evaluate()->chart.counted, 6U);
  EXPECT_EQ(evaluate()->chart.state, DriftState::kInControl);
  checked.calibrate();
  EXPECT_EQ(evaluate()->chart.counted, 0U);
  checked.check();
  EXPECT_EQ(evaluate()->chart.counted, 1U);
  EXPECT_EQ(evaluate()->chart.state, DriftState::kTooFew);
}

TEST_F(AWatch, DoesNotSayInControlForEver) {
  constexpr double kDayS = 86400.0;
  checks(6);
  const double newest_s = evaluate()->chart.points.back().check.time_s;
  now_s = newest_s + 13.9 * kDayS;
  EXPECT_EQ(evaluate()->chart.state, DriftState::kInControl);
  now_s = newest_s + 14.1 * kDayS;  // nothing else has changed
  EXPECT_EQ(evaluate()->chart.state, DriftState::kUnknown);
  EXPECT_EQ(evaluate()->chart.advice, DriftAdvice::kCheckAgain);
  checks(1);
  now_s = evaluate()->chart.points.back().check.time_s + kDayS;
  EXPECT_EQ(evaluate()->chart.state, DriftState::kInControl);
}

TEST_F(AWatch, StatesWhetherTheCalibrationHoldsAtTheTimeItIsAsked) {
  constexpr double kDayS = 86400.0;
  const auto holding_now = [&] { return evaluate()->standing.holding; };
  now_s = evaluate()->standing.evidence_s + kDayS;
  EXPECT_FALSE(evaluate()->standing.by_check);
  EXPECT_EQ(holding_now(), calib::Holding::kHolds) << "it is its own evidence";
  now_s = evaluate()->standing.due_s + 1.0;
  EXPECT_EQ(holding_now(), calib::Holding::kUnknown);
  checks(1);
  now_s = evaluate()->standing.evidence_s;
  EXPECT_TRUE(evaluate()->standing.by_check);
  EXPECT_EQ(holding_now(), calib::Holding::kHolds);
  checked.check({.result = Checked::that_does_not_hold(ChangeKind::kSphere)});
  EXPECT_EQ(holding_now(), calib::Holding::kDoesNotHold);
}

TEST_F(AWatch, GoesBackToTheChecksOfACalibrationThatIsPutIntoUseAgain) {
  checks(6);
  const std::int64_t first = checked.calibrated;
  checked.calibrate();
  EXPECT_EQ(evaluate()->chart.counted, 0U);
  checked.journal.activate(
      {.session = first, .time = "2026-03-01T00:00:00.000Z", .who = "anna", .reason = "a test"});
  EXPECT_EQ(evaluate()->calibrated, first);
  EXPECT_EQ(evaluate()->chart.counted, 6U);
}

TEST_F(AWatch, SaysThatTheToolCreepsSinceWhenAndWhatToDo) {
  checks(24);
  checks(30, 0.008e-3);
  const auto drift = evaluate();
  ASSERT_EQ(drift->chart.state, DriftState::kAlarms);
  ASSERT_TRUE(drift->chart.trend);
  EXPECT_NEAR(static_cast<double>(drift->chart.trend->since), 26.0, 12.0);
  EXPECT_NEAR(drift->chart.trend->now_m.norm(), 0.24e-3, 0.08e-3);
  ASSERT_FALSE(drift->chart.trend->causes.empty());
  EXPECT_EQ(drift->chart.trend->causes.front().kind, calib::ChangeKind::kTool);
  EXPECT_EQ(drift->chart.advice, DriftAdvice::kReMeasureTcp);
}

TEST_F(AWatch, HasNoCheckInItsChartThatEndedAtNoTime) {
  checks(2);
  checked.check({.ended = "yesterday"});
  EXPECT_EQ(evaluate()->chart.points.size(), 2U);
}

TEST_F(AWatch, LeavesOutWhatSaysNothingOfTheToolAndShowsIt) {
  checks(5);
  checked.check({.result = Checked::that_does_not_hold(ChangeKind::kSphere)});
  calib::TcpCheck given_up = Checked::that_holds();
  given_up.holds = false;
  given_up.unsteady = {{2, "S1"}};
  checked.check({.result = given_up});
  checked.check({.result = std::nullopt});  // without a recorded outcome
  calib::TcpCheck missed = Checked::that_does_not_hold(ChangeKind::kTool);
  missed.not_found = {{3, "S2", 0.012}};
  checked.check({.result = missed});
  checked.check({.ends = false});
  const auto drift = evaluate();
  ASSERT_EQ(drift->chart.points.size(), 9U);
  EXPECT_EQ(drift->chart.counted, 5U);
  EXPECT_EQ(drift->chart.points[5].check.left_out, LeftOut::kNotTheTool);
  EXPECT_EQ(drift->chart.points[6].check.left_out, LeftOut::kUndecided);
  EXPECT_EQ(drift->chart.points[6].state, DriftState::kAlarms) << "the one before did not hold";
  EXPECT_EQ(drift->chart.points[7].check.verdict, calib::CheckVerdict::kUndecided);
  EXPECT_EQ(drift->chart.points[7].check.left_out, LeftOut::kUndecided);
  EXPECT_EQ(drift->chart.points[8].check.left_out, LeftOut::kIncomplete);
  EXPECT_EQ(drift->chart.state, DriftState::kAlarms);
}

TEST_F(AWatch, AlarmsWhereEveryCheckSinceTheCalibrationFails) {
  const Eigen::Vector3d knocked_m(0.8e-3, -0.5e-3, 0.3e-3);
  for (int k = 1; k <= 7; ++k) {
    checked.check({.shift_m = knocked_m, .result = Checked::that_does_not_hold(ChangeKind::kTool)});
    const auto drift = evaluate();
    EXPECT_EQ(drift->chart.state, DriftState::kAlarms) << k;
    EXPECT_EQ(drift->chart.advice, DriftAdvice::kReMeasureTcp) << k;
    ASSERT_TRUE(drift->chart.not_held);
    EXPECT_EQ(drift->chart.not_held->since, checked.calibrated + 1);
    EXPECT_NEAR(*drift->chart.newest_decided()->tcp_shift_m, 0.99e-3, 0.01e-3);
    EXPECT_EQ(drift->chart.newest_decided()->change->kind, ChangeKind::kTool);
  }
  EXPECT_EQ(evaluate()->chart.counted, 0U) << "what does not hold is no reference";
}

TEST_F(AWatch, AlarmsAtOnceAlsoWhereTheCheckThatFailsIsOfOtherTouches) {
  checks(6);
  checked.check(
      {.result = Checked::that_does_not_hold(ChangeKind::kSphere), .other_touches = true});
  EXPECT_EQ(evaluate()->chart.state, DriftState::kAlarms);
  EXPECT_EQ(evaluate()->chart.advice, DriftAdvice::kRecalibrate);
}

TEST_F(AWatch, ComparesChecksByTheSameTouchesAlone) {
  checks(5);
  for (int k = 0; k < 2; ++k) checked.check({.other_touches = true});
  const auto drift = evaluate();
  EXPECT_EQ(drift->chart.counted, 2U) << "the newest ones count";
  EXPECT_EQ(drift->chart.points[0].check.left_out, LeftOut::kOtherTouches);
}

TEST_F(AWatch, KeepsAnAlarmUntilOtherTouchesHaveAChartOfTheirOwn) {
  for (int k = 0; k < 12; ++k) checked.check();
  for (int k = 0; k < 8; ++k) checked.check({.shift_m = {0.0, 0.0, 0.2e-3}});
  ASSERT_EQ(evaluate()->chart.state, DriftState::kAlarms);
  for (std::size_t k = 1; k < calib::kLeastChecks; ++k) {
    checked.check({.shift_m = {0.0, 0.0, 0.2e-3}, .other_touches = true});
    EXPECT_EQ(evaluate()->chart.state, DriftState::kAlarms) << k;
    EXPECT_EQ(evaluate()->chart.points.back().check.left_out, LeftOut::kOtherTouches);
  }
  checked.check({.other_touches = true});
  EXPECT_EQ(evaluate()->chart.counted, calib::kLeastChecks);
  EXPECT_EQ(evaluate()->chart.points.front().check.left_out, LeftOut::kOtherTouches);
}

TEST_F(AWatch, KnowsTheTemperatureThatWasStated) {
  checked.check({.temperature_c = 21.5});
  checked.check();
  EXPECT_EQ(evaluate()->chart.points[0].check.temperature_c, 21.5);
  EXPECT_FALSE(evaluate()->chart.points[1].check.temperature_c);
  EXPECT_TRUE(evaluate()->chart.per_kelvin_m);
  checked.check({.temperature_c = 1e200});
  EXPECT_FALSE(evaluate()->chart.points[2].check.temperature_c) << "no cell is that warm";
}

TEST_F(AWatch, ShowsTheChecksOfTheCalibrationsBeforeEachOfItsOwn) {
  checks(6);
  const std::int64_t first = checked.calibrated;
  const std::int64_t second = checked.calibrate();
  checks(2);
  const auto drift = evaluate();
  EXPECT_EQ(drift->chart.counted, 2U);
  ASSERT_EQ(drift->chart.others.size(), 1U);
  EXPECT_EQ(drift->chart.others[0].calibration, first);
  EXPECT_EQ(drift->chart.others[0].points.size(), 6U);
  EXPECT_GT(drift->chart.others[0].noise, 0.0);
  for (int k = 0; k < 4; ++k) checked.calibrate();
  const auto later = evaluate();
  EXPECT_EQ(later->chart.others.size(), 3U) << "the newest ones";
  for (const calib::OtherChart& other : later->chart.others) EXPECT_GT(other.calibration, second);
  for (const calib::DriftEvent& event : later->chart.events) EXPECT_GT(event.session, second);
}

TEST_F(AWatch, NamesTheChangesOfTheCellWithTheirDates) {
  const std::string robot = calib::read_file(CELLCAL_DEMO_ROBOT);
  const std::string cell = calib::read_file(CELLCAL_DEMO_CELL);
  std::string other_tool = cell;
  const std::size_t at = other_tool.find("xyz_mm = [");
  ASSERT_NE(at, std::string::npos);
  other_tool.insert(at + std::string("xyz_mm = [").size(), "1");  // 60 mm: 160 mm
  const std::int64_t first = checked.calibrate({}, {cell, robot});
  checked.check();
  SessionOptions update, accepted;
  update.update = true;
  accepted.accept_change = true;
  checked.calibrate(update, {cell, robot});
  checked.calibrate(accepted, {other_tool, robot + "\n"});
  checked.journal.activate({.session = first,
                            .time = "2026-03-01T00:00:00.000Z",
                            .who = "anna",
                            .reason = "the torch was put back"});
  const auto drift = evaluate();
  const std::vector<calib::DriftEvent>& events = drift->chart.events;
  ASSERT_EQ(events.size(), 5U);
  std::vector<std::string> words;
  for (const calib::DriftEvent& event : events) words.push_back(calib::words(phrase(event)));
  EXPECT_EQ(words[0], "calibration of session 1");
  EXPECT_EQ(words[1], "calibration of session 2: cell file changed, robot file changed");
  EXPECT_EQ(words[2], "update of session 4");
  EXPECT_EQ(words[3],
            "calibration of session 5: tool changed, TCP moved by 100.000 mm, robot file changed, "
            "change of the arm accepted");
  EXPECT_EQ(words[4], "calibration of session 2 in use again, by anna (the torch was put back)");
  EXPECT_EQ(calib::date_words(events[4].time_s), "2026-03-01");
  EXPECT_TRUE(std::ranges::is_sorted(events, {}, &calib::DriftEvent::time_s));
  EXPECT_EQ(calib::words(phrase(events[2]), *calib::Language::of("de")),
            "Aktualisierung aus Sitzung 4");
}

TEST_F(AWatch, WorksTheChartOutOncePerCheckThatEnds) {
  checks(2);
  const auto first = evaluate();
  EXPECT_EQ(evaluate(), first);
  checked.check();
  EXPECT_NE(evaluate(), first);
}

}  // namespace
}  // namespace cellcal::daemon
