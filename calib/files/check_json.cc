#include <nlohmann/json.hpp>

#include "calib/files/calibration_json.h"
#include "calib/model/units.h"
#include "calib/result/drift_chart.h"
#include "calib/result/finding_phrase.h"
#include "calib/result/tcp_check.h"
#include "calib/words/phrase_json.h"

namespace cellcal::calib {

namespace {

using nlohmann::ordered_json;

constexpr double kCoverage = 2.0;

ordered_json vector_mm(const Eigen::Vector3d& m) {
  return {m.x() * kMmPerM, m.y() * kMmPerM, m.z() * kMmPerM};
}

ordered_json explanation_to_json(const Explanation& one) {
  ordered_json json{{"kind", to_string(one.kind)},
                    {"name", one.name},
                    {"probability", one.probability},
                    {"log_likelihood", one.log_likelihood},
                    {"words", words(one)}};
  switch (one.kind) {
    case ChangeKind::kTool:
    case ChangeKind::kSphere:
      json["shift_mm"] = vector_mm(one.shift_m);
      json["length_mm"] = one.shift_m.norm() * kMmPerM;
      json["u_mm"] = kCoverage * one.sigma * kMmPerM;
      if (one.amount > 0.0) json["at_least_mm"] = one.amount * kMmPerM;
      break;
    case ChangeKind::kJoint:
      json["angle_deg"] = one.amount * kDegPerRad;
      json["u_deg"] = kCoverage * one.sigma * kDegPerRad;
      break;
    case ChangeKind::kGrowth:
      json["growth_ppm"] = one.amount * kPerMillion;
      json["u_ppm"] = kCoverage * one.sigma * kPerMillion;
      break;
    case ChangeKind::kTouch:
      json["touch"] = one.touch + 1;
      json["off_mm"] = one.amount * kMmPerM;
      json["u_mm"] = kCoverage * one.sigma * kMmPerM;
      break;
    case ChangeKind::kPositioner:
      json["shift_mm"] = vector_mm(one.shift_m);
      json["length_mm"] = one.shift_m.norm() * kMmPerM;
      json["u_mm"] = kCoverage * one.sigma * kMmPerM;
      json["turn_deg"] = one.amount * kDegPerRad;
      json["u_turn_deg"] = kCoverage * one.turn_sigma * kDegPerRad;
      break;
    case ChangeKind::kNothing: break;
  }
  return json;
}

constexpr double kMonthS = 30.0 * 86400.0;

template <typename T>
ordered_json or_null(const std::optional<T>& value) {
  return value ? ordered_json(*value) : ordered_json(nullptr);
}

ordered_json limits_to_json(const ControlLimits& limits) {
  return {{"ewma", limits.ewma}, {"cusum", limits.cusum}, {"run_length", limits.run_length}};
}

/// Null if undecided.
ordered_json holds(const CheckMeasurement& check) {
  if (check.verdict == CheckVerdict::kUndecided) return nullptr;
  return check.verdict == CheckVerdict::kHolds;
}

bool measured(const CheckMeasurement& check) {
  return check.left_out == LeftOut::kNo || check.left_out == LeftOut::kNotTheTool;
}

ordered_json point_to_json(const DriftPoint& point, double noise) {
  const CheckMeasurement& check = point.check;
  ordered_json json{
      {"session", check.session},
      {"time_s", check.time_s},
      {"temperature_c", or_null(check.temperature_c)},
      {"holds", holds(check)},
      {"left_out", check.left_out == LeftOut::kNo ? ordered_json(nullptr)
                                                  : ordered_json(to_string(check.left_out))},
      {"off_mm", nullptr},
      {"u_mm", nullptr},
      {"ewma", point.ewma},
      {"cusum", point.cusum},
      {"share", point.share},
      {"state", to_string(point.state)}};
  if (!measured(check) || !(noise > 0.0)) return json;  // no reference yet
  const Eigen::Vector3d sigma_m = noise * check.covariance_m2.diagonal().cwiseSqrt();
  json["off_mm"] = vector_mm(point.off_m);
  json["u_mm"] = vector_mm(kCoverage * sigma_m);
  return json;
}

ordered_json cause_to_json(const Explanation& one) {
  return {{"kind", to_string(one.kind)},
          {"name", one.name},
          {"probability", one.probability},
          {"words", words(one)}};
}

ordered_json trend_to_json(const DriftTrend& trend) {
  ordered_json json{{"shape", to_string(trend.shape)},
                    {"since", trend.since},
                    {"since_s", trend.since_s},
                    {"checks", trend.checks},
                    {"off_mm", trend.now_m.norm() * kMmPerM},
                    {"u_off_mm", kCoverage * trend.now_sigma_m * kMmPerM},
                    {"off_xyz_mm", vector_mm(trend.now_m)},
                    {"mm_per_month", nullptr},
                    {"u_mm_per_month", nullptr},
                    {"causes", ordered_json::array()}};
  if (trend.has_rate()) {
    json["mm_per_month"] = trend.rate_m_s.norm() * kMonthS * kMmPerM;
    json["u_mm_per_month"] = kCoverage * trend.rate_sigma_m_s * kMonthS * kMmPerM;
  }
  for (const Explanation& one : trend.causes) json["causes"].push_back(cause_to_json(one));
  return json;
}

/// Null if the newest decided check holds, or if there is none.
ordered_json not_held_to_json(const DriftChart& chart) {
  const CheckMeasurement* newest = chart.newest_decided();
  if (!chart.not_held || newest == nullptr) return nullptr;
  ordered_json json{{"session", newest->session},       {"time_s", newest->time_s},
                    {"since", chart.not_held->since},   {"since_s", chart.not_held->since_s},
                    {"checks", chart.not_held->checks}, {"tcp_shift_mm", nullptr},
                    {"u_tcp_shift_mm", nullptr},        {"cause", nullptr}};
  if (newest->tcp_shift_m) {
    json["tcp_shift_mm"] = *newest->tcp_shift_m * kMmPerM;
    json["u_tcp_shift_mm"] = newest->u_tcp_shift_m * kMmPerM;
  }
  if (newest->change) json["cause"] = cause_to_json(*newest->change);
  return json;
}

ordered_json points_to_json(const std::vector<DriftPoint>& points, double noise) {
  ordered_json list = ordered_json::array();
  for (const DriftPoint& point : points) list.push_back(point_to_json(point, noise));
  return list;
}

ordered_json event_to_json(const DriftEvent& event, const Language& language) {
  return {{"kind", to_string(event.kind)},
          {"session", event.session},
          {"time_s", event.time_s},
          {"cell_changed", event.cell_changed},
          {"robot_changed", event.robot_changed},
          {"tcp_moved_mm",
           event.tcp_moved_m ? ordered_json(*event.tcp_moved_m * kMmPerM) : ordered_json(nullptr)},
          {"accepted", event.accepted},
          {"by", event.by},
          {"reason", event.reason},
          {"words", words(phrase(event), language)}};
}

}  // namespace

std::string check_to_json(const TcpCheck& check) {
  ordered_json json{{"format", "cellcal.check/1"},
                    {"holds", check.holds},
                    {"touches", check.touches},
                    {"tcp_shift_mm", nullptr},
                    {"changed", nullptr},
                    {"explanations", ordered_json::array()},
                    {"not_found", ordered_json::array()},
                    {"unsteady", ordered_json::array()},
                    {"words", ordered_json::array()},
                    {"said", ordered_json::array()}};
  for (const Phrase& line : phrases(check)) {
    json["words"].push_back(words(line));
    json["said"].emplace_back(calib::to_json(line));
  }
  for (const UnsteadyTouch& one : check.unsteady)
    json["unsteady"].push_back({{"touch", one.touch + 1}, {"target", one.target}});
  for (const NotFound& one : check.not_found)
    json["not_found"].push_back(
        {{"touch", one.touch + 1}, {"target", one.target}, {"beyond_mm", one.beyond_m * kMmPerM}});
  if (check.explanations.empty()) return json.dump(1);
  ordered_json covariance = ordered_json::array();
  for (int row = 0; row < 3; ++row)
    covariance.push_back(vector_mm(check.covariance_m2.row(row).transpose() * kMmPerM));
  json["tcp_shift_mm"] = {{"frame", "flange"},
                          {"xyz", vector_mm(check.shift_m)},
                          {"u_xyz", vector_mm({check.u_m(0), check.u_m(1), check.u_m(2)})},
                          {"length", check.shift_m.norm() * kMmPerM},
                          {"u_length", check.u_along_m() * kMmPerM},
                          {"covariance_mm2", covariance}};
  json["rms_mm"] = check.rms_m * kMmPerM;
  json["log_odds"] = check.log_odds;
  json["log_odds_alarm"] = check.log_alarm;
  json["false_alarms"] = check.false_alarms;
  json["finds"] = {{"tool_shift_mm", check.finds_m * kMmPerM}, {"share", check.found}};
  if (const Explanation* change = check.change(); !check.holds && change != nullptr)
    json["changed"] = to_string(change->kind);
  for (const Explanation& one : check.explanations)
    json["explanations"].push_back(explanation_to_json(one));
  return json.dump(1);
}

std::string drift_to_json(const DriftChart& chart, const Language& language) {
  ordered_json json{{"format", "cellcal.drift/1"},
                    {"state", to_string(chart.state)},
                    {"advice", to_string(chart.advice)},
                    {"counted", chart.counted},
                    {"least", chart.least},
                    {"undecided", chart.undecided},
                    {"decided_s", nullptr},
                    {"warns", limits_to_json(chart.warns)},
                    {"alarms", limits_to_json(chart.alarms)},
                    {"noise", chart.noise},
                    {"um_per_kelvin", nullptr},
                    {"alarmed_at", or_null(chart.alarmed_at)},
                    {"not_held", not_held_to_json(chart)},
                    {"course", nullptr},
                    {"points", points_to_json(chart.points, chart.counted > 0 ? chart.noise : 0.0)},
                    {"others", ordered_json::array()},
                    {"events", ordered_json::array()},
                    {"words", all_words(phrases(chart), language)}};
  if (chart.per_kelvin_m) json["um_per_kelvin"] = vector_mm(*chart.per_kelvin_m * 1e3);
  if (chart.trend) json["course"] = trend_to_json(*chart.trend);
  if (const CheckMeasurement* decided = chart.newest_decided()) json["decided_s"] = decided->time_s;
  for (const OtherChart& other : chart.others)
    json["others"].push_back({{"calibration", other.calibration},
                              {"points", points_to_json(other.points, other.noise)}});
  for (const DriftEvent& event : chart.events)
    json["events"].push_back(event_to_json(event, language));
  return json.dump(1, ' ', false, ordered_json::error_handler_t::replace);
}

}  // namespace cellcal::calib
