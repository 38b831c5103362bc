#include "calib/files/check_json.h"

#include <nlohmann/json.hpp>

#include "calib/model/units.h"
#include "calib/words/check_words.h"

namespace cellcal::calib {

namespace {

using nlohmann::ordered_json;

constexpr double kCoverage = 2.0;
constexpr double kPerMillion = 1e6;

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
    case ChangeKind::kNothing:
      break;
  }
  return json;
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
                    {"words", words(check)}};
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
  if (!check.holds) json["changed"] = to_string(check.change()->kind);
  for (const Explanation& one : check.explanations)
    json["explanations"].push_back(explanation_to_json(one));
  return json.dump(1);
}

}  // namespace cellcal::calib
