#include "calib/result/drift_chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "calib/model/units.h"
#include "calib/result/tcp_check.h"

namespace cellcal::calib {

const CheckMeasurement* DriftChart::newest_decided() const {
  const auto newest = std::find_if(points.rbegin(), points.rend(), [](const DriftPoint& one) {
    return one.check.verdict != CheckVerdict::kUndecided;
  });
  return newest == points.rend() ? nullptr : &newest->check;
}

DriftAdvice remedy_of(CheckVerdict verdict, ChangeKind change) {
  if (verdict == CheckVerdict::kHolds) return DriftAdvice::kNone;
  if (verdict == CheckVerdict::kUndecided) return DriftAdvice::kCheckAgain;
  switch (change) {
    case ChangeKind::kTouch:
      return DriftAdvice::kCheckAgain;
    case ChangeKind::kGrowth:
      return DriftAdvice::kLetItWarmUp;
    case ChangeKind::kTool:
      return DriftAdvice::kReMeasureTcp;
    case ChangeKind::kNothing:  // too few touches made contact
    case ChangeKind::kSphere:
    case ChangeKind::kJoint:
    case ChangeKind::kPositioner:
      break;
  }
  return DriftAdvice::kRecalibrate;
}

namespace {

constexpr double kDriftCoverage = 2.0;
constexpr double kMonthS = 30.0 * 86400.0;

const DriftPoint* newest_counted(const DriftChart& chart) {
  for (std::size_t k = chart.points.size(); k-- > 0;)
    if (chart.points[k].check.left_out == LeftOut::kNo) return &chart.points[k];
  return nullptr;
}

/// Sigma of the shift along itself.
double sigma_m(const DriftPoint& point, double noise) {
  const double length = point.off_m.norm();
  if (!(length > 0.0)) return noise * std::sqrt(point.check.covariance_m2.trace() / 3.0);
  const Eigen::Vector3d along = point.off_m / length;
  return noise * std::sqrt(along.dot(point.check.covariance_m2 * along));
}

const char* opening(DriftState state) {
  return state == DriftState::kAlarms  ? "alarm"
         : state == DriftState::kWarns ? "warning"
                                       : "in control";
}

/// "23 min", "5.0 h", "2.1 days".
std::string span_words(double span_s) {
  constexpr double kMinS = 60.0, kHourS = 3600.0, kDayS = 86400.0;
  if (span_s < 2.0 * kHourS) return fmt::format("{:.0f} min", span_s / kMinS);
  if (span_s < 2.0 * kDayS) return fmt::format("{:.1f} h", span_s / kHourS);
  return fmt::format("{:.1f} days", span_s / kDayS);
}

}  // namespace

std::string date_words(double time_s) {
  const std::chrono::sys_days day{
      std::chrono::days(static_cast<int>(std::floor(time_s / 86400.0)))};
  const std::chrono::year_month_day date(day);
  return fmt::format("{:04}-{:02}-{:02}", static_cast<int>(date.year()),
                     static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()));
}

namespace {

/// "check 7 (2026-11-26) does not hold: TCP shift 0.99 +- 0.05 mm (k=2), since check 2 (2026-11-25); tool shifted by ..."
std::string not_held_words(const CheckMeasurement& newest, const NotHeld& run) {
  std::string text =
      fmt::format("check {} ({}) does not hold", newest.session, date_words(newest.time_s));
  if (newest.tcp_shift_m && (!newest.change || newest.change->kind == ChangeKind::kTool))
    text += fmt::format(": TCP shift {:.2f} +- {:.2f} mm (k=2)", *newest.tcp_shift_m * kMmPerM,
                        newest.u_tcp_shift_m * kMmPerM);
  if (run.since != newest.session)
    text += fmt::format(", since check {} ({})", run.since, date_words(run.since_s));
  return newest.change ? text + "; " + words(*newest.change) : text;
}

}  // namespace

std::string state_words(const DriftChart& chart) {
  if (chart.not_held && chart.newest_decided() != nullptr)
    return "alarm: " + not_held_words(*chart.newest_decided(), *chart.not_held);
  const DriftPoint* newest = newest_counted(chart);
  if (chart.state == DriftState::kTooFew || newest == nullptr || chart.newest_decided() == nullptr)
    return fmt::format("not enough checks: {} of {}", chart.counted, chart.least);
  if (chart.state == DriftState::kUnknown)
    return fmt::format(
        "unknown: last decided check of {}, {} undecided since; it was in control then",
        date_words(chart.newest_decided()->time_s), chart.undecided);
  if (chart.state == DriftState::kAlarms && !chart.trend && chart.alarmed_at)
    return fmt::format(
        "alarm of check {} active: check {} holds, {:.0f} % of the alarm limit. The alarm ends when both statistics are "
        "below their warning limits",
        *chart.alarmed_at, newest->check.session, 100.0 * newest->share);
  return fmt::format(
      "{}: TCP {:.3f} +- {:.3f} mm (k=2) off the centre of its checks, {:.0f} % of the alarm limit, {} checks",
      opening(chart.state), newest->off_m.norm() * kMmPerM,
      kDriftCoverage * sigma_m(*newest, chart.noise) * kMmPerM, 100.0 * newest->share,
      chart.counted);
}

std::string trend_words(const DriftChart& chart) {
  if (!chart.trend) return "";
  const DriftTrend& trend = *chart.trend;
  const std::string off = fmt::format("{:.3f} +- {:.3f} mm (k=2)", trend.now_m.norm() * kMmPerM,
                                      kDriftCoverage * trend.now_sigma_m * kMmPerM);
  const std::string since =
      fmt::format("since check {} ({})", trend.since, date_words(trend.since_s));
  std::string text =
      trend.shape == DriftShape::kCreep && !trend.has_rate()
          ? fmt::format("shift of {} within {} {}", off, span_words(trend.over_s), since)
      : trend.shape == DriftShape::kStep
          ? fmt::format("step of {} {}", off, since)
          : fmt::format("creep of {:.3f} +- {:.3f} mm/month (k=2) {}, {} by now",
                        trend.rate_m_s.norm() * kMonthS * kMmPerM,
                        kDriftCoverage * trend.rate_sigma_m_s * kMonthS * kMmPerM, since, off);
  if (trend.causes.empty()) return text;
  const Explanation& cause = trend.causes.front();
  return text +
         fmt::format(", likeliest cause {:.0f} %: {}", 100.0 * cause.probability, words(cause));
}

std::string advice_words(const DriftChart& chart) {
  switch (chart.advice) {
    case DriftAdvice::kCheckAgain:
      return "Clean tip and spheres and check again: 'cellcal check'";
    case DriftAdvice::kLetItWarmUp:
      return "Let the arm come to its usual temperature and check again; if that is the new one, calibrate again";
    case DriftAdvice::kReMeasureTcp:
      return "Check the tool's fastening and its tip; then measure the TCP or calibrate again";
    case DriftAdvice::kRecalibrate:
      return "Look at what the check names, then calibrate again: 'cellcal run'";
    case DriftAdvice::kNone:
      break;
  }
  return chart.state == DriftState::kTooFew ? "Check once a shift: 'cellcal check'" : "";
}

std::string limit_words(const DriftChart& chart) {
  return fmt::format(
      "limits: EWMA {:.2f}, CUSUM {:.2f} sigma alarm once in {:.0f} checks of an unchanged cell; {:.2f}, {:.2f} warn "
      "once in {:.0f}",
      chart.alarms.ewma, chart.alarms.cusum, chart.alarms.run_length, chart.warns.ewma,
      chart.warns.cusum, chart.warns.run_length);
}

std::vector<std::string> words(const DriftChart& chart) {
  std::vector<std::string> lines{state_words(chart)};
  if (const std::string trend = trend_words(chart); !trend.empty()) lines.push_back(trend);
  if (const std::string advice = advice_words(chart); !advice.empty()) lines.push_back(advice);
  if (chart.per_kelvin_m)
    lines.push_back(
        fmt::format("{:.1f} um/K of temperature effect removed", chart.per_kelvin_m->norm() * 1e6));
  constexpr double kMuchMore = 1.3;
  if (chart.noise > kMuchMore)
    lines.push_back(fmt::format(
        "checks scatter {:.1f} times as much as the calibration states. Clean tip and spheres",
        chart.noise));
  lines.push_back(limit_words(chart));
  return lines;
}

namespace {

Phrase opening_of(const DriftEvent& event) {
  switch (event.kind) {
    case DriftEventKind::kUpdated:
      return {"say.event.updated", {{"session", event.session}}};
    case DriftEventKind::kActivated:
      return {"say.event.activated",
              {{"session", event.session}, {"by", event.by}, {"reason", event.reason}}};
    case DriftEventKind::kCalibrated:
      break;
  }
  return {"say.event.calibrated", {{"session", event.session}}};
}

}  // namespace

Phrase phrase(const DriftEvent& event) {
  constexpr const char* kJoin = "say.join.comma";
  Phrase changes;
  if (event.tcp_moved_m)
    changes = {"say.event.tool", {{"moved", *event.tcp_moved_m * kMmPerM}}};
  else if (event.cell_changed)
    changes = "say.event.cell";
  if (event.robot_changed) changes = joined(kJoin, changes, "say.event.robot");
  if (event.accepted) changes = joined(kJoin, changes, "say.event.accepted");
  return joined("say.join.colon", opening_of(event), changes);
}

}  // namespace cellcal::calib
