#include "calib/files/drift_json.h"

#include <nlohmann/json.hpp>

#include "calib/model/units.h"
#include "calib/words/check_words.h"
#include "calib/words/drift_words.h"

namespace cellcal::calib {

namespace {

using nlohmann::ordered_json;

constexpr double kDriftCoverage = 2.0;
constexpr double kMonthS = 30.0 * 86400.0;

ordered_json xyz_mm(const Eigen::Vector3d& m) {
  return {m.x() * kMmPerM, m.y() * kMmPerM, m.z() * kMmPerM};
}

template <typename T>
ordered_json or_null(const std::optional<T>& value) {
  return value ? ordered_json(*value) : ordered_json(nullptr);
}

ordered_json limits_to_json(const ControlLimits& limits) {
  return {{"ewma", limits.ewma}, {"cusum", limits.cusum}, {"run_length", limits.run_length}};
}

bool measured(const CheckSeen& check) {
  return check.left_out == LeftOut::kNo || check.left_out == LeftOut::kNotTheTool;
}

ordered_json point_to_json(const DriftPoint& point, double noise) {
  const CheckSeen& check = point.check;
  ordered_json json{
      {"session", check.session},
      {"time_s", check.time_s},
      {"temperature_c", or_null(check.temperature_c)},
      {"holds", or_null(check.holds)},
      {"left_out", check.left_out == LeftOut::kNo ? ordered_json(nullptr)
                                                  : ordered_json(to_string(check.left_out))},
      {"off_mm", nullptr},
      {"u_mm", nullptr},
      {"ewma", point.ewma},
      {"cusum", point.cusum},
      {"share", point.share},
      {"state", to_string(point.state)}};
  if (!measured(check)) return json;
  const Eigen::Vector3d sigma_m = noise * check.covariance_m2.diagonal().cwiseSqrt();
  json["off_mm"] = xyz_mm(point.off_m);
  json["u_mm"] = xyz_mm(kDriftCoverage * sigma_m);
  return json;
}

ordered_json trend_to_json(const DriftTrend& trend) {
  ordered_json json{{"shape", to_string(trend.shape)},
                    {"since", trend.since},
                    {"since_s", trend.since_s},
                    {"checks", trend.checks},
                    {"off_mm", trend.now_m.norm() * kMmPerM},
                    {"u_off_mm", kDriftCoverage * trend.now_sigma_m * kMmPerM},
                    {"off_xyz_mm", xyz_mm(trend.now_m)},
                    {"mm_per_month", nullptr},
                    {"u_mm_per_month", nullptr},
                    {"causes", ordered_json::array()}};
  if (trend.has_rate()) {
    json["mm_per_month"] = trend.rate_m_s.norm() * kMonthS * kMmPerM;
    json["u_mm_per_month"] = kDriftCoverage * trend.rate_sigma_m_s * kMonthS * kMmPerM;
  }
  for (const Explanation& one : trend.causes)
    json["causes"].push_back({{"kind", to_string(one.kind)},
                              {"name", one.name},
                              {"probability", one.probability},
                              {"words", words(one)}});
  return json;
}

}  // namespace

std::string drift_to_json(const DriftChart& chart) {
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
                    {"course", nullptr},
                    {"points", ordered_json::array()},
                    {"words", words(chart)}};
  if (chart.per_kelvin_m) json["um_per_kelvin"] = xyz_mm(*chart.per_kelvin_m * 1e3);
  if (chart.trend) json["course"] = trend_to_json(*chart.trend);
  for (const DriftPoint& point : chart.points)
    if (point.check.left_out == LeftOut::kNo) json["decided_s"] = point.check.time_s;
  for (const DriftPoint& point : chart.points)
    json["points"].push_back(point_to_json(point, chart.noise));
  return json.dump(1);
}

}  // namespace cellcal::calib
