#include "calib/result/drift_chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "calib/model/units.h"
#include "calib/result/finding_phrase.h"

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
    case ChangeKind::kTouch: return DriftAdvice::kCheckAgain;
    case ChangeKind::kGrowth: return DriftAdvice::kLetItWarmUp;
    case ChangeKind::kTool: return DriftAdvice::kReMeasureTcp;
    case ChangeKind::kNothing:  // too few touches made contact
    case ChangeKind::kSphere:
    case ChangeKind::kJoint:
    case ChangeKind::kPositioner: break;
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

Phrase opening(DriftState state) {
  return state == DriftState::kAlarms  ? "say.drift.opening.alarm"
         : state == DriftState::kWarns ? "say.drift.opening.warning"
                                       : "say.drift.opening.in_control";
}

/// "23 min", "5.0 h", "2.1 days".
Phrase span_phrase(double span_s) {
  constexpr double kMinS = 60.0, kHourS = 3600.0, kDayS = 86400.0;
  if (span_s < 2.0 * kHourS) return {"say.drift.span.min", {{"n", span_s / kMinS}}};
  if (span_s < 2.0 * kDayS) return {"say.drift.span.h", {{"n", span_s / kHourS}}};
  return {"say.drift.span.days", {{"n", span_s / kDayS}}};
}

/// "since check 2 (2026-11-25)"
Phrase since_phrase(std::int64_t session, double time_s) {
  return {"say.drift.since", {{"session", session}, {"date", date_words(time_s)}}};
}

/// "check 7 (2026-11-26) does not hold: TCP shift 0.99 ± 0.05 mm (k=2), since check 2 (2026-11-25); tool shifted by ..."
Phrase not_held_phrase(const CheckMeasurement& newest, const NotHeld& run) {
  Phrase all{"say.drift.not_held",
             {{"session", newest.session}, {"date", date_words(newest.time_s)}}};
  if (newest.tcp_shift_m && (!newest.change || newest.change->kind == ChangeKind::kTool))
    all = joined("say.join.colon", all,
                 {"say.session.shift",
                  {{"mm", *newest.tcp_shift_m * kMmPerM}, {"u", newest.u_tcp_shift_m * kMmPerM}}});
  if (run.since != newest.session)
    all = joined("say.join.comma", all, since_phrase(run.since, run.since_s));
  return newest.change ? joined("say.join.semicolon", all, phrase(*newest.change)) : all;
}

Phrase advice_phrase(const DriftChart& chart) {
  if (chart.advice != DriftAdvice::kNone)
    return std::string("say.drift.do.") + to_string(chart.advice);
  return chart.state == DriftState::kTooFew ? "say.drift.do.once_a_shift" : "";
}

Phrase limits_phrase(const DriftChart& chart) {
  return {"say.drift.limits",
          {{"ewma", chart.alarms.ewma},
           {"cusum", chart.alarms.cusum},
           {"run", chart.alarms.run_length},
           {"warn_ewma", chart.warns.ewma},
           {"warn_cusum", chart.warns.cusum},
           {"warn_run", chart.warns.run_length}}};
}

Phrase opening_of(const DriftEvent& event) {
  switch (event.kind) {
    case DriftEventKind::kUpdated: return {"say.event.updated", {{"session", event.session}}};
    case DriftEventKind::kActivated:
      return {"say.event.activated",
              {{"session", event.session}, {"by", event.by}, {"reason", event.reason}}};
    case DriftEventKind::kCalibrated: break;
  }
  return {"say.event.calibrated", {{"session", event.session}}};
}

}  // namespace

std::string date_words(double time_s) {
  const std::chrono::sys_days day{
      std::chrono::days(static_cast<int>(std::floor(time_s / 86400.0)))};
  const std::chrono::year_month_day date(day);
  return fmt::format("{:04}-{:02}-{:02}", static_cast<int>(date.year()),
                     static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()));
}

Phrase state_phrase(const DriftChart& chart) {
  if (chart.not_held && chart.newest_decided() != nullptr)
    return {"say.drift.alarm",
            {{"what", not_held_phrase(*chart.newest_decided(), *chart.not_held)}}};
  const DriftPoint* newest = newest_counted(chart);
  if (chart.state == DriftState::kTooFew || newest == nullptr || chart.newest_decided() == nullptr)
    return {"say.drift.too_few", {{"counted", chart.counted}, {"least", chart.least}}};
  if (chart.state == DriftState::kUnknown)
    return {"say.drift.unknown",
            {{"date", date_words(chart.newest_decided()->time_s)}, {"undecided", chart.undecided}}};
  if (chart.state == DriftState::kAlarms && !chart.trend && chart.alarmed_at)
    return {"say.drift.active",
            {{"session", *chart.alarmed_at},
             {"newest", newest->check.session},
             {"percent", 100.0 * newest->share},
             {"limit", 100.0}}};
  return {"say.drift.state",
          {{"state", opening(chart.state)},
           {"mm", newest->off_m.norm() * kMmPerM},
           {"u", kDriftCoverage * sigma_m(*newest, chart.noise) * kMmPerM},
           {"percent", 100.0 * newest->share},
           {"limit", 100.0},
           {"checks", chart.counted}}};
}

Phrase trend_phrase(const DriftChart& chart) {
  if (!chart.trend) return {};
  const DriftTrend& trend = *chart.trend;
  const char* id = trend.shape == DriftShape::kStep ? "say.drift.step"
                   : trend.has_rate()               ? "say.drift.creep"
                                                    : "say.drift.shift";
  const Phrase course{id,
                      {{"mm", trend.now_m.norm() * kMmPerM},
                       {"u", kDriftCoverage * trend.now_sigma_m * kMmPerM},
                       {"rate", trend.rate_m_s.norm() * kMonthS * kMmPerM},
                       {"u_rate", kDriftCoverage * trend.rate_sigma_m_s * kMonthS * kMmPerM},
                       {"span", span_phrase(trend.over_s)},
                       {"since", since_phrase(trend.since, trend.since_s)}}};
  if (trend.causes.empty()) return course;
  const Explanation& cause = trend.causes.front();
  return joined(
      "say.join.comma", course,
      {"say.drift.cause", {{"percent", 100.0 * cause.probability}, {"cause", phrase(cause)}}});
}

std::vector<Phrase> phrases(const DriftChart& chart) {
  std::vector<Phrase> lines{state_phrase(chart)};
  if (Phrase trend = trend_phrase(chart); !trend.empty()) lines.push_back(std::move(trend));
  if (Phrase advice = advice_phrase(chart); !advice.empty()) lines.push_back(std::move(advice));
  constexpr double kShownM = 0.05e-6;
  if (chart.per_kelvin_m && chart.per_kelvin_m->norm() >= kShownM)
    lines.push_back({"say.drift.per_kelvin", {{"um", chart.per_kelvin_m->norm() * 1e6}}});
  constexpr double kMuchMore = 1.3;
  if (chart.noise > kMuchMore) lines.push_back({"say.drift.scatter", {{"times", chart.noise}}});
  lines.push_back(limits_phrase(chart));
  return lines;
}

std::vector<std::string> words(const DriftChart& chart) {
  std::vector<std::string> lines;
  for (const Phrase& line : phrases(chart)) lines.push_back(words(line));
  return lines;
}

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
